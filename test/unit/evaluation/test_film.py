# SPDX-License-Identifier: BSD-3-Clause
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from sensor_msgs.msg import Image

from tld_follower.box import Box
from tld_follower.evaluation import film, sequences
from tld_follower.nodes.conversions import box_message


def frame(box, seed):
    """A frame of random rgb8 pixels with its true box."""
    pixels = np.random.default_rng(seed).integers(0, 256, (12, 20, 3), np.uint8)
    image = Image(height=12, width=20, step=60, encoding="rgb8", data=pixels.tobytes())
    truth = SimpleNamespace(target_box=box_message(box, 1.0, None, 1))
    return {"image": image, "truth": truth}, pixels


def make(folder, boxes, first_seed=0):
    made = film.Film(folder)
    frames = [frame(box, first_seed + index) for index, box in enumerate(boxes)]
    for messages, _ in frames:
        made.add(messages, 0.0)
    made.close()
    return [pixels for _, pixels in frames]


def test_a_film_is_read_back_as_it_was(tmp_path):
    boxes = [Box(0, 0, 20, 12), None, Box(3, 4, 5, 6)]
    pictures = make(tmp_path / "film", boxes)
    sequence = sequences.load(tmp_path / "film")
    assert sequence.truth == tuple(boxes)
    for image, pixels in zip(sequence.frames(), pictures, strict=True):
        np.testing.assert_array_equal(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), pixels)
    lines = (tmp_path / "film" / "groundtruth.txt").read_text().splitlines()
    assert lines == ["1,1,20,12", "NaN,NaN,NaN,NaN", "4,5,5,6"]


def test_a_shorter_film_replaces_a_longer_one(tmp_path):
    make(tmp_path, [Box(1, 1, 4, 4)] * 5)
    (pixels,) = make(tmp_path, [Box(2, 2, 4, 4)], first_seed=9)
    sequence = sequences.load(tmp_path)
    assert sequence.truth == (Box(2, 2, 4, 4),)
    np.testing.assert_array_equal(next(sequence.frames())[..., ::-1], pixels)


def test_a_film_that_cannot_be_written_is_an_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        film.Film(tmp_path / "file")
