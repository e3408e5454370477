"""The experiment command: two flights of a seed are identical, and what it writes is whole."""

import json
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

from tld_follower.evaluation import sequences
from tld_follower.evaluation.fastboard import FRAMES, fastboard
from tld_follower.evaluation.shooting import shoot
from tld_follower.following.parameters import Parameters

SIZE = "320x240"
EXPERIMENT = Path(__file__).resolve().parents[2] / "scripts" / "experiment"


def run(*arguments):
    return subprocess.run([EXPERIMENT, *map(str, arguments)], capture_output=True, text=True, timeout=900)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A flight with a report."""
    folder = tmp_path_factory.mktemp("experiment")
    path = folder / "straight.json"
    done = run(
        "straight", "--first-seed", 3, "--resolution", SIZE, "--json", path, "--report", folder / "report"
    )
    assert done.returncode == 0, done.stderr
    assert "steady error" in done.stdout
    return folder, json.loads(path.read_text())


# One of each kind: the target drives, flies, follows another vehicle's camera, is hidden by things that move.
@pytest.mark.parametrize("scenario", ["straight", "target_drone", "ugv", "occlusion"])
def test_two_lockstep_flights_give_identical_traces(scenario):
    done = run(scenario, "--twice", "--first-seed", 3, "--resolution", SIZE)
    assert done.returncode == 0, done.stderr


def test_settings_and_figures_are_in_the_json(results):
    _, result = results
    expected = {
        "scenario": "straight",
        "distance": "stereo",
        "control": Parameters.control,
        "resolution": "320x240",
    }
    assert {name: result[name] for name in expected} == expected
    (run,) = result["runs"]
    assert run["seed"] == 3
    assert run["collisions"] == 0
    trace = run["trace"]
    assert {len(column) for column in trace.values()} == {len(trace["t"])}
    assert 18 * 30 < len(trace["t"]) < 21 * 30


def test_plots_and_video_are_written(results):
    report = results[0] / "report"
    for name in ("distance_stereo.png", "velocity_stereo.png", "path_stereo.png"):
        assert cv2.imread(str(report / name)).shape[1] > 600
    page = (report / "report.html").read_text()
    assert "overshoot below 5 cm" in page
    assert "left_camera_stereo.webm" in page
    assert page.count("data:image/png;base64,") == 3
    assert "http" not in page
    video = cv2.VideoCapture(str(report / "left_camera_stereo.webm"))
    assert video.get(cv2.CAP_PROP_FRAME_WIDTH) == 320
    assert video.read()[0]


def test_with_depth_the_target_is_followed_past_what_passes_before_it(tmp_path):
    path = tmp_path / "occlusion.json"
    done = run("occlusion", "--first-seed", 2, "--resolution", "320x240", "--json", path)
    assert done.returncode == 0, done.stderr
    result = json.loads(path.read_text())
    assert (result["use_depth"], result["world"]) == (True, "empty.world")
    (flight,) = result["runs"]
    assert flight["visible_fraction"] < 0.95  # the target was hidden
    assert flight["tracked_fraction"] > 0.85
    assert flight["wrong_boxes"] < 10
    assert flight["boxes_while_hidden"] == 0
    assert flight["recoveries"] == flight["losses"]
    assert flight["trace"]["distance"][-1] < 1.2


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    """One seed of fastboard: filmed on the whole graph, and by the simulator alone."""
    folder = tmp_path_factory.mktemp("films")
    size, scores = "320x240", folder / "flight.json"
    done = run("fastboard", "--resolution", size, "--film", folder / "graph", "--json", scores)
    assert done.returncode == 0, done.stderr
    shoot(fastboard, [0], folder / "alone", size)
    return folder / "graph" / "fastboard-0", folder / "alone" / "fastboard-0", json.loads(scores.read_text())


def test_a_film_is_the_same_whoever_watches(films):
    graph, alone, _ = films
    assert (graph / "groundtruth.txt").read_text() == (alone / "groundtruth.txt").read_text()
    pictures = sorted(path.name for path in (graph / "img").iterdir())
    assert pictures == [f"{number:05d}.png" for number in range(1, FRAMES + 1)]
    for name in pictures:
        assert (graph / "img" / name).read_bytes() == (alone / "img" / name).read_bytes(), name


def test_fastboard_comes_and_goes_as_in_the_thesis(films):
    shown = np.array([box is not None for box in sequences.load(films[0]).truth])
    assert np.flatnonzero(~shown)[0] in (4, 5, 6)
    assert 120 < shown.sum() < 155
    assert (shown[1:] & ~shown[:-1]).sum() == 3


def test_boxes_and_pictures_of_a_film_belong_together(films):
    film = sequences.load(films[0])
    checked = 0
    for box, image in zip(film.truth, film.frames(), strict=True):
        if box is None or box.x < 1 or box.right > image.shape[1] - 1:
            continue
        hue, saturation, value = cv2.split(cv2.cvtColor(image, cv2.COLOR_BGR2HSV))
        # Husky's shell is the only thing near it that is so yellow. The camera pans by 8 pixels and more in
        # most frames: the box of another frame would cut the shell.
        shell = (abs(hue.astype(int) - 24) < 5) & (saturation > 180) & (value > 110)
        top, bottom = max(0, int(box.y) - 10), int(box.bottom) + 10
        columns = np.flatnonzero(shell[top:bottom].sum(axis=0) >= 3)
        columns = columns[(columns > box.x - 30) & (columns < box.right + 30)]
        assert box.x <= columns.min() <= box.x + 15
        assert columns.max() < box.right
        checked += 1
    assert checked > 40


def test_a_scripted_flight_has_no_figures_of_following(films):
    (flown,) = films[2]["runs"]
    assert flown["peak_gap_m"] is None
    assert flown["reentries"] == 3
    assert 0 <= flown["failures"] <= 2
    assert flown["collisions"] == 0


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["loop-the-loop"], "invalid choice"),
        (["straight", "--resolution", "huge"], "WIDTHxHEIGHT"),
        (["straight", "--max-speed", "-1"], "not a positive number"),
        (["straight", "--max-speed", "inf"], "not a positive number"),
        (["straight", "--first-seed", "-1"], "0 or more"),
        (["straight", "--json", "/"], "directory"),
        (["straight", "--world", "nowhere.world"], "no world file"),
    ],
)
def test_wrong_arguments_are_refused(arguments, reason):
    done = run(*arguments)
    assert done.returncode == 2
    assert reason in done.stderr
