# SPDX-License-Identifier: BSD-3-Clause
import cv2
import numpy as np
import pytest

from tld_follower.box import Box
from tld_follower.evaluation.sequences import SequenceError, load, load_clips

SHADES = (20, 90, 160, 230)


def shade(level):
    return np.full((48, 64, 3), level, np.uint8)


def annotate(folder, text):
    folder.mkdir(exist_ok=True)
    (folder / "groundtruth.txt").write_text(text)
    return folder


def add_images(folder, names):
    (folder / "img").mkdir()
    for name, level in zip(names, SHADES, strict=False):
        cv2.imwrite(str(folder / "img" / name), shade(level))
    return folder


@pytest.fixture
def video(tmp_path):
    """Four grey frames, each of its own shade, as an MPEG video."""
    folder = annotate(tmp_path / "film", "5,6,20,10\n" * 4)
    writer = cv2.VideoWriter(str(folder / "video.mpg"), cv2.VideoWriter_fourcc(*"MPG1"), 25.0, (64, 48))
    if not writer.isOpened():
        pytest.skip("this OpenCV cannot write MPEG-1")
    for level in SHADES:
        writer.write(shade(level))
    writer.release()
    return folder


def test_videos_are_read_in_order(video):
    sequence = load(video)
    frames = list(sequence.frames())
    assert len(frames) == len(sequence.truth) == 4
    assert all(frame.shape == (48, 64, 3) and frame.dtype == np.uint8 for frame in frames)
    assert [frame.mean() for frame in frames] == pytest.approx(SHADES, abs=10)


def test_a_clip_of_a_video_starts_at_its_own_frame(video):
    frames = list(load(video).clip("part", 2, 3).frames())
    assert [frame.mean() for frame in frames] == pytest.approx(SHADES[1:3], abs=10)


def test_frames_can_be_read_again(video):
    sequence = load(video)
    assert sum(1 for _ in sequence.frames()) == sum(1 for _ in sequence.frames()) == 4


def test_images_go_by_their_numbers(tmp_path):
    folder = annotate(tmp_path / "stills", "1,1,9,9\n" * 3)
    add_images(folder, ["00001.png", "00002.png", "00010.png"])
    assert [int(frame.mean()) for frame in load(folder).frames()] == list(SHADES[:3])


@pytest.mark.parametrize(
    ("line", "box"),
    [
        ("1,1,20,10", Box(0, 0, 20, 10)),
        ("11.5,3.25,20.5,10.75", Box(10.5, 2.25, 20.5, 10.75)),
        (" 5 , 6 , 7 , 8 \r", Box(4, 5, 7, 8)),
        ("-3,2,10,10", Box(-4, 1, 10, 10)),
        ("NaN,NaN,NaN,NaN", None),
        ("nan,nan,nan,nan", None),
    ],
)
def test_lines_of_the_annotation(tmp_path, line, box):
    folder = annotate(tmp_path / "s", f"1,1,9,9\n{line}\n\n")
    assert load(add_images(folder, ["1.png", "2.png"])).truth == (Box(0, 0, 9, 9), box)


@pytest.mark.parametrize("text", ["", "\n\n", "1,1,9\n", "1,1,9,9,9\n", "x\n"])
def test_malformed_annotations_are_named(tmp_path, text):
    folder = add_images(annotate(tmp_path / "s", text), ["1.png"])
    with pytest.raises(SequenceError, match=r"groundtruth\.txt: (empty|line 1 is not)"):
        load(folder)


def test_binary_annotations_are_refused(tmp_path):
    folder = add_images(annotate(tmp_path / "s", ""), ["1.png"])
    (folder / "groundtruth.txt").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(SequenceError, match=r"groundtruth\.txt"):
        load(folder)


@pytest.mark.parametrize("lines", [3, 5])
def test_a_video_of_another_length_is_refused(video, lines):
    annotate(video, "5,6,20,10\n" * lines)
    with pytest.raises(SequenceError, match=f"4 frames, but {lines} lines"):
        load(video)


def test_a_clip_keeps_its_absent_frames(tmp_path):
    folder = annotate(tmp_path / "s", "1,1,9,9\nNaN,NaN,NaN,NaN\n3,1,9,9\n4,1,9,9\n")
    sequence = load(add_images(folder, ["1.png", "2.png", "3.png", "4.png"]))
    clip = sequence.clip("c", 1, 3)
    assert (clip.name, clip.truth) == ("c", (Box(0, 0, 9, 9), None, Box(2, 0, 9, 9)))
    again = sequence.clip("d", 3, 4).clip("e", 2, 2)
    assert [int(frame.mean()) for frame in again.frames()] == [SHADES[3]]
    for first, last in ((0, 2), (3, 2), (1, 5), (2, 3)):
        with pytest.raises(SequenceError, match="clip bad"):
            sequence.clip("bad", first, last)


@pytest.mark.parametrize(
    "text",
    ["name,sequence,first\na,film,1\n", "name,sequence,first,last\na,film,1\n", "a,film,1,2\nb,film,1,2\n"],
)
def test_clips_of_another_form_are_refused(video, tmp_path, text):
    path = tmp_path / "clips.csv"
    path.write_text(text)
    with pytest.raises(SequenceError, match=r"clips\.csv: not a CSV"):
        load_clips(path, [load(video)])


def test_a_missing_list_of_clips_is_named(video, tmp_path):
    with pytest.raises(SequenceError, match=r"none\.csv"):
        load_clips(tmp_path / "none.csv", [load(video)])
