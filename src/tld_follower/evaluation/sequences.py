# SPDX-License-Identifier: BSD-3-Clause
"""Annotated sequences: a folder with video.mpg or img/NNNNN.png, and groundtruth.txt."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from tld_follower.box import Box


class SequenceError(Exception):
    """A sequence that cannot be read; the message names the file and what is wrong."""


@dataclass(frozen=True)
class Sequence:
    """A video, or a part of it, with the target's box in each frame.

    Attributes
    ----------
    name : what results are reported under.
    folder : where the video is.
    truth : the target's box in each frame [pixel, 0-based], None where it is not in view.
    start : index in the video of the first frame, from 0.
    """

    name: str
    folder: Path
    truth: tuple[Box | None, ...]
    start: int = 0

    def frames(self) -> Iterator[np.ndarray]:
        """Read the frames, uint8 (H, W, 3) BGR, one a truth box."""
        for index, image in enumerate(_read(self.folder)):
            if index >= self.start + len(self.truth):
                return
            if index >= self.start:
                yield image

    def clip(self, name: str, first: int, last: int) -> Sequence:
        """Return frames `first` to `last`, both 1-based and included, as a sequence of its own."""
        if not 1 <= first <= last <= len(self.truth):
            raise SequenceError(f"clip {name}: frames {first}-{last} are not in 1-{len(self.truth)}")
        if self.truth[first - 1] is None:
            raise SequenceError(f"clip {name}: the target is not in view in its first frame, {first}")
        return replace(self, name=name, truth=self.truth[first - 1 : last], start=self.start + first - 1)


class Writer:
    """Writes a sequence folder frame by frame: img/NNNNN.png and groundtruth.txt.

    Raises
    ------
    OSError
        If the folder or a file in it cannot be written.
    """

    def __init__(self, folder: Path):
        """Make the folder; frames of an earlier sequence in it are removed."""
        self._folder = folder
        (folder / "img").mkdir(parents=True, exist_ok=True)
        for path in _images(folder):
            path.unlink()
        self._truth: list[str] = []

    def add(self, image: np.ndarray, box: Box | None) -> None:
        """Add a frame, uint8 (H, W, 3) BGR, and the target's box in it [pixel, 0-based]."""
        number = len(self._truth) + 1
        path = self._folder / "img" / f"{number:05d}.png"
        # PNG is lossless; noise compresses badly, so quickly.
        if not cv2.imwrite(str(path), image, [cv2.IMWRITE_PNG_COMPRESSION, 1]):
            raise OSError(f"{path}: cannot be written")
        values = ("NaN",) * 4 if box is None else (box.x + 1.0, box.y + 1.0, box.width, box.height)
        self._truth.append(",".join(v if isinstance(v, str) else f"{v:.10g}" for v in values))

    def close(self) -> None:
        """Write the annotation of the frames so far."""
        (self._folder / "groundtruth.txt").write_text("".join(f"{line}\n" for line in self._truth))


def load(folder: Path) -> Sequence:
    """Read a sequence's annotation and check that the video has as many frames.

    Raises
    ------
    SequenceError
        For a missing or malformed file, or an unequal number of frames.
    """
    if not folder.is_dir():
        raise SequenceError(f"{folder}: no such folder")
    truth = _read_truth(folder / "groundtruth.txt")
    if truth[0] is None:
        raise SequenceError(f"{folder}: the target is not in view in the first frame")
    frames = _count(folder)
    if frames != len(truth):
        raise SequenceError(f"{folder}: {frames} frames, but {len(truth)} lines in groundtruth.txt")
    return Sequence(folder.resolve().name, folder, truth)


def load_clips(path: Path, sequences: list[Sequence]) -> list[Sequence]:
    """Cut the clips of a CSV file (name, sequence, first, last; frames from 1) out of sequences.

    Raises
    ------
    SequenceError
        For an unreadable file, a sequence that is not among the given ones, or frames outside it.
    """
    named = {sequence.name: sequence for sequence in sequences}
    try:
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
        clips = [(r["name"], r["sequence"], int(r["first"]), int(r["last"])) for r in rows]
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise SequenceError(f"{path}: not a CSV of name,sequence,first,last: {error}") from error
    missing = sorted({sequence for _, sequence, _, _ in clips} - set(named))
    if missing:
        raise SequenceError(f"{path}: sequences not given: {', '.join(missing)}")
    return [named[sequence].clip(name, first, last) for name, sequence, first, last in clips]


def _read_truth(path: Path) -> tuple[Box | None, ...]:
    try:
        lines = path.read_text().split("\n")
    except (OSError, UnicodeDecodeError) as error:
        raise SequenceError(f"{path}: cannot be read: {error}") from error
    truth: list[Box | None] = []
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            x, y, width, height = (float(v) for v in line.split(","))
        except ValueError as error:
            raise SequenceError(f"{path}: line {number} is not x,y,width,height: {line.strip()!r}") from error
        # Annotations count pixels from 1.
        box = Box(x - 1.0, y - 1.0, width, height)
        truth.append(box if box.finite else None)
    if not truth:
        raise SequenceError(f"{path}: empty")
    return tuple(truth)


def _images(folder: Path) -> list[Path]:
    return sorted((folder / "img").glob("*.png"))


def _video(folder: Path) -> cv2.VideoCapture:
    path = folder / "video.mpg"
    if not path.is_file():
        raise SequenceError(f"{folder}: neither video.mpg nor img/*.png")
    capture = cv2.VideoCapture(str(path))
    if not capture.isOpened():
        raise SequenceError(f"{path}: cannot be read as a video")
    return capture


def _read(folder: Path) -> Iterator[np.ndarray]:
    images = _images(folder)
    for path in images:
        image = cv2.imread(str(path), cv2.IMREAD_COLOR)
        if image is None:
            raise SequenceError(f"{path}: cannot be read as an image")
        yield image
    if not images:
        capture = _video(folder)
        while True:
            read, image = capture.read()
            if not read:
                return
            yield image


def _count(folder: Path) -> int:
    images = _images(folder)
    if images:
        return len(images)
    capture = _video(folder)
    count = 0
    while capture.grab():
        count += 1
    return count
