# SPDX-License-Identifier: BSD-3-Clause
"""The command `evaluate` on small sequences made here, and on real ones."""

import csv
import json
import os
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from tld_follower.box import Box
from tld_follower.evaluation import sequences, shooting
from tld_follower.evaluation.evaluate import main, parse_settings
from tld_follower.evaluation.sequences import SequenceError
from tld_follower.tld.parameters import Parameters

KEYS = {
    "sequence",
    "tracker",
    "frames",
    "absent",
    "overlap",
    "boxes_while_absent",
    "reentries",
    "reentries_found",
    "failures",
    "cpu_ms_mean",
    "cpu_ms_p95",
    "cpu_ms_first_1000",
    "cpu_ms_last_1000",
    "templates",
}
ABSENT = range(10, 14)
FRAMES = 24


@pytest.fixture
def folder(tmp_path):
    """A sequence of 24 images; the target moves right and is away for four frames."""
    rng = np.random.default_rng(0)
    background = cv2.GaussianBlur(rng.integers(0, 256, (90, 160), np.uint8), (0, 0), 3.0)
    target = cv2.GaussianBlur(rng.integers(0, 256, (30, 30), np.uint8), (0, 0), 1.5)
    sequence = tmp_path / "made"
    (sequence / "img").mkdir(parents=True)
    lines = []
    for index in range(FRAMES):
        image, x = background.copy(), 30 + index
        if index in ABSENT:
            lines.append("NaN,NaN,NaN,NaN")
        else:
            image[20:50, x : x + 30] = target
            lines.append(f"{x + 1},21,30,30")
        cv2.imwrite(str(sequence / "img" / f"{index + 1:05d}.png"), image)
    (sequence / "groundtruth.txt").write_text("\n".join(lines) + "\n")
    return sequence


def test_annotations_count_from_one(folder):
    sequence = sequences.load(folder)
    assert sequence.name == "made"
    assert sequence.truth[0] == Box(30, 20, 30, 30)
    assert [i for i, box in enumerate(sequence.truth) if box is None] == list(ABSENT)
    assert sum(1 for _ in sequence.frames()) == FRAMES


def test_a_clip_has_its_own_frames(folder):
    sequence = sequences.load(folder)
    clip = sequence.clip("part", 6, 20)
    assert len(clip.truth) == 15
    assert clip.truth[0] == sequence.truth[5]
    images = list(clip.frames())
    assert len(images) == 15
    np.testing.assert_array_equal(images[0], list(sequence.frames())[5])


def test_scores_json_and_report(folder, tmp_path, capsys):
    note = tmp_path / "README.md"
    note.write_text("not a sequence")
    scores, report = tmp_path / "scores.json", tmp_path / "report"
    arguments = [str(folder), str(note), "--tracker", "tld", "tld_sift"]
    assert main([*arguments, "--json", str(scores), "--report", str(report), "--fastboard", "0"]) == 0
    output = capsys.readouterr()
    assert "made" in output.out
    assert "README.md" in output.err
    results = json.loads(scores.read_text())
    assert [r["tracker"] for r in results] == ["tld", "tld_sift"]
    for result in results:
        assert set(result) == KEYS
        assert (result["frames"], result["absent"], result["reentries"]) == (FRAMES, 4, 1)
        assert result["overlap"]["0.5"]["f"] > 0.8
        assert result["cpu_ms_mean"] > 0
        assert result["templates"] > 1
    names = {path.name for path in report.iterdir()}
    tables = {f"{stem}.{kind}" for stem in ("scores", "table_4_1", "table_4_2") for kind in ("csv", "md")}
    assert names == tables | {"report.html", "success.png", "made_tld.png", "made_tld_sift.png"}
    with (report / "scores.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["sequence"] for row in rows] == ["made", "made", "mean", "mean"]
    sheet = cv2.imread(str(report / "made_tld.png"))
    assert sheet.shape == (4 * 135, 6 * 240, 3)


@pytest.fixture
def filmed(monkeypatch, folder):
    """Films of fastboard that are quickly made: copies of the sequence. Returns the calls."""
    calls = []

    def shoot(scenario, seeds, directory):
        calls.append((scenario.__name__, list(seeds)))
        copies = [directory / f"fastboard-{seed}" for seed in seeds]
        return [shutil.copytree(folder, copy) for copy in copies]

    monkeypatch.setattr(shooting, "shoot", shoot)
    return calls


def test_a_report_of_both_trackers_films_fastboard(folder, tmp_path, filmed, capsys):
    scores, report = tmp_path / "scores.json", tmp_path / "report"
    arguments = ["--json", str(scores), "--report", str(report), "--fastboard", "2"]
    assert main([str(folder), "--tracker", "tld", *arguments]) == 0
    assert filmed == []
    assert main([str(folder), "--tracker", "tld", "tld_sift", *arguments]) == 0
    assert filmed == [("fastboard", [0, 1])]
    assert (report / "failures.png").is_file()
    assert "fastboard-0_tld.png" in (report / "report.html").read_text()
    # The films are the report's; what was asked for is scored alone.
    assert {r["sequence"] for r in json.loads(scores.read_text())} == {"made"}
    assert "fastboard" not in capsys.readouterr().out
    with (report / "table_4_1.csv").open() as file:
        (row,) = (row for row in csv.DictReader(file) if row["Sequence"] == "Fastboard")
    assert (row["Frames"], row["Occlusions"]) == (str(FRAMES), "4")
    assert float(row["TLD"]) > 0


def test_given_films_of_fastboard_are_used(folder, tmp_path, filmed):
    given = shutil.copytree(folder, tmp_path / "fastboard-7")
    report = tmp_path / "report"
    assert main([str(given), "--tracker", "tld", "tld_sift", "--report", str(report)]) == 0
    assert filmed == []
    assert (report / "failures.png").is_file()


def test_without_a_simulator_the_report_says_so(folder, tmp_path, monkeypatch, capsys):
    def shoot(*_):
        raise SequenceError("fastboard cannot be filmed: no simulator")

    monkeypatch.setattr(shooting, "shoot", shoot)
    report = tmp_path / "report"
    assert main([str(folder), "--tracker", "tld", "tld_sift", "--report", str(report)]) == 0
    assert "no simulator" in capsys.readouterr().err
    assert "no simulator" in (report / "report.html").read_text()
    assert not (report / "failures.png").exists()


def test_clips_go_by_their_own_names(folder, tmp_path):
    clips = tmp_path / "clips.csv"
    clips.write_text("name,sequence,first,last\nearly,made,7,20\nlate,made,15,24\n")
    scores = tmp_path / "scores.json"
    assert main([str(folder), "--clips", str(clips), "--json", str(scores)]) == 0
    assert [(r["sequence"], r["frames"]) for r in json.loads(scores.read_text())] == [
        ("early", 14),
        ("late", 10),
    ]


def test_settings_change_parameters():
    values = parse_settings(["learning=false", "ferns=6", "shift=0.2"])
    assert values == {"learning": False, "ferns": 6, "shift": 0.2}
    assert Parameters.from_dict(values).ferns == 6


def fails(capsys, *arguments):
    code = main([str(a) for a in arguments])
    error = capsys.readouterr().err
    assert code == 1
    assert "Traceback" not in error
    return error


class TestBadInput:
    def test_settings(self, folder, capsys):
        assert "NAME=VALUE" in fails(capsys, folder, "--set", "ferns")
        assert "unknown tracker parameter: fern" in fails(capsys, folder, "--set", "fern=3")
        assert "ferns wants int" in fails(capsys, folder, "--set", "ferns=many")
        assert "learning wants bool" in fails(capsys, folder, "--set", "learning=1")

    def test_no_such_folder(self, tmp_path, capsys):
        assert "no such folder" in fails(capsys, tmp_path / "nowhere")

    def test_no_folder_at_all(self, tmp_path, capsys):
        (tmp_path / "file").write_text("")
        assert "no sequence folder" in fails(capsys, tmp_path / "file")

    def test_no_groundtruth(self, folder, capsys):
        (folder / "groundtruth.txt").unlink()
        assert "groundtruth.txt: cannot be read" in fails(capsys, folder)

    @pytest.mark.parametrize("line", ["1,2,3", "a,b,c,d"])
    def test_malformed_groundtruth(self, folder, capsys, line):
        path = folder / "groundtruth.txt"
        path.write_text(path.read_text() + line + "\n")
        assert f"line {FRAMES + 1}" in fails(capsys, folder)

    def test_counts_that_differ(self, folder, capsys):
        (folder / "img" / "00024.png").unlink()
        assert "23 frames, but 24 lines" in fails(capsys, folder)

    def test_an_unreadable_image(self, folder, capsys):
        (folder / "img" / "00005.png").write_bytes(b"no image")
        assert "00005.png: cannot be read" in fails(capsys, folder)

    def test_no_video(self, folder, capsys):
        for image in (folder / "img").iterdir():
            image.unlink()
        assert "neither video.mpg nor img" in fails(capsys, folder)
        (folder / "video.mpg").write_bytes(b"no video")
        assert "video.mpg" in fails(capsys, folder)

    def test_target_absent_at_first(self, folder, capsys):
        path = folder / "groundtruth.txt"
        path.write_text("NaN,NaN,NaN,NaN\n" + path.read_text().split("\n", 1)[1])
        assert "not in view in the first frame" in fails(capsys, folder)

    @pytest.mark.parametrize(
        ("row", "message"),
        [
            ("early,other,1,5", "not given: other"),
            ("early,made,1,99", "frames 1-99 are not in 1-24"),
            ("early,made,11,20", "not in view in its first frame"),
            ("early,made,x,20", "not a CSV"),
        ],
    )
    def test_clips(self, folder, tmp_path, capsys, row, message):
        clips = tmp_path / "clips.csv"
        clips.write_text(f"name,sequence,first,last\n{row}\n")
        assert message in fails(capsys, folder, "--clips", clips)

    def test_unwritable_json(self, folder, tmp_path, capsys):
        assert "scores.json" in fails(capsys, folder, "--json", tmp_path / "none" / "scores.json")


@pytest.fixture(scope="module")
def real_sequences():
    data = os.environ.get("TLD_FOLLOWER_DATA")
    if data is None:
        pytest.skip("TLD_FOLLOWER_DATA is not set: no annotated sequences")
    return Path(data) / "sequences"


@pytest.mark.parametrize(
    ("name", "low", "high", "while_absent"), [("jumping", 0.9, 0.8, 0), ("pedestrian3", 0.95, 0.95, 4)]
)
def test_real_sequences(real_sequences, tmp_path, name, low, high, while_absent):
    scores = tmp_path / "scores.json"
    assert main([str(real_sequences / name), "--json", str(scores)]) == 0
    result = json.loads(scores.read_text())[0]
    assert result["overlap"]["0.25"]["f"] > low
    assert result["overlap"]["0.5"]["f"] > high
    assert result["boxes_while_absent"] <= while_absent
    assert result["reentries_found"] == result["reentries"]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [(["--set", "tracker=tld_sift"], "use --tracker"), (["--seed", "-1"], "0 or more")],
)
def test_settings_that_would_be_overlooked_are_refused(arguments, reason, tmp_path, capsys):
    try:
        code = main([str(tmp_path), *arguments])
    except SystemExit as end:  # argparse
        code = end.code
    assert code != 0
    assert reason in capsys.readouterr().err
