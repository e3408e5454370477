# SPDX-License-Identifier: BSD-3-Clause
"""What was learnt of a target, and the file that carries it to another process.

The file is an .npz archive of plain arrays and one JSON header. It is read without trust: every shape is
checked before memory is taken for it, every number before it is used.
"""

from __future__ import annotations

import json
import math
import os
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np

from tld_follower.box import Box
from tld_follower.tld.frame import PATCH_SIZE
from tld_follower.tld.keypoints import DESCRIPTOR
from tld_follower.tld.parameters import Parameters

FORMAT, VERSION = "tld_follower model", 1
# What the learnt numbers mean depends on these; the others may change from one process to the next.
DECISIVE = ("tracker", "ferns", "comparisons", "blur", "window_side")
MAX_PIXELS = 1 << 26
MAX_HEADER = 1 << 16
MAX_COUNT = 1 << 30
# SIFT returns a few keypoints beyond its limit where the weakest are equally strong.
KEYPOINT_SLACK = 4
# Keypoints lie in their box, its side being 1.
MAX_KEYPOINT = 10.0


@dataclass(frozen=True)
class Model:
    """Everything that finds the target again.

    Attributes
    ----------
    image : width and height of the images it was learnt in [pixel].
    target, last : the first and the last box of the target [pixel].
    min_variance, fern_threshold, nn_threshold : of the detector.
    phase : share of the windows that the detector scanned last.
    random : state of the generator of the learner, as numpy's PCG64 gives it.
    sift_calls : frames that the SIFT memory was shown.
    sift_expected : keypoints that it expects to recognise on the target.
    depth_size, depth_relief : side of the target times its depth [pixel m], and its front's depth over that
        depth; None where unknown.
    comparisons : (ferns, comparisons, 4) float64, fractions 0..1 of the window.
    counts : (2, ferns, 2^comparisons) int32, positive and negative examples.
    positives, negatives : (N, 225) float32 templates in the order of time.
    view_lengths : (V,) int32, keypoints in each view of the SIFT memory.
    view_points, view_descriptors : (sum, 2) and (sum, 128) float32, of one view after the other.
    """

    image: tuple[int, int]
    target: Box
    last: Box
    min_variance: float
    fern_threshold: float
    nn_threshold: float
    phase: int
    random: dict[str, Any]
    sift_calls: int
    sift_expected: float
    depth_size: float | None
    depth_relief: float | None
    comparisons: np.ndarray
    counts: np.ndarray
    positives: np.ndarray
    negatives: np.ndarray
    view_lengths: np.ndarray
    view_points: np.ndarray
    view_descriptors: np.ndarray


def save(path: str | Path, model: Model, parameters: Parameters) -> None:
    """Write a model; the file appears whole or not at all.

    Raises
    ------
    OSError
        If the directory does not exist or cannot be written; a file that was there stays as it was.
    """
    path = Path(path)
    arrays, header = {}, {"format": FORMAT, "version": VERSION}
    for field in fields(Model):
        value = getattr(model, field.name)
        if isinstance(value, np.ndarray):
            arrays[field.name] = value
        else:
            header[field.name] = value.as_tuple() if isinstance(value, Box) else value
    header["parameters"] = {name: getattr(parameters, name) for name in DECISIVE}
    text = np.frombuffer(json.dumps(header).encode(), np.uint8)
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with open(partial, "wb") as file:
            np.savez_compressed(file, header=text, **arrays)
            file.flush()
            os.fsync(file.fileno())
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def load(path: str | Path, parameters: Parameters) -> Model:
    """Read a model that `save` wrote.

    Raises
    ------
    ValueError
        If it is no whole model, of another version, or learnt with other parameters.
    OSError
        If the file cannot be opened.
    """
    with open(path, "rb") as file, _named(path), zipfile.ZipFile(file) as archive:
        header = _header(archive, parameters)
        return _checked(header, _arrays(archive, parameters), parameters)


@contextmanager
def _named(path: str | Path) -> Iterator[None]:
    """Turn whatever a damaged archive raises into one ValueError with the file's name."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{path} is no model of this tracker: {error}") from error
    except (
        *(zipfile.BadZipFile, zlib.error, struct.error, EOFError, KeyError, TypeError, SyntaxError),
        *(TokenError, RuntimeError, NotImplementedError, OverflowError, MemoryError, OSError),
    ) as error:
        raise ValueError(f"{path} is no model of this tracker, or damaged: {error}") from error


def _require(condition: Any, fault: str) -> None:
    if not condition:
        raise ValueError(fault)


def _read(archive: zipfile.ZipFile, name: str, kind: type, most: tuple[int, ...]) -> np.ndarray:
    """Read one array of a type, with sides of exactly `most` but the first, which may be shorter."""
    with archive.open(f"{name}.npy") as member:
        _require(np.lib.format.read_magic(member) == (1, 0), f"{name} is no array")
        shape, _, dtype = np.lib.format.read_array_header_1_0(member)
        fits = len(shape) == len(most) and shape[0] <= most[0] and shape[1:] == most[1:]
        _require(dtype == np.dtype(kind) and fits, f"{name} is an array {shape} of {dtype}")
        size = math.prod(shape) * dtype.itemsize
        data = member.read(size + 1)  # one more: the checksum is compared at the end
        _require(len(data) == size, f"{name} is cut off")
    array = np.frombuffer(data, kind).reshape(shape).copy()
    _require(np.isfinite(array).all(), f"{name} holds values that are no numbers")
    return array


def _arrays(archive: zipfile.ZipFile, parameters: Parameters) -> dict[str, np.ndarray]:
    codes = 1 << parameters.comparisons
    keypoints = parameters.sift_views * parameters.sift_keypoints * KEYPOINT_SLACK
    sizes = {
        "comparisons": (np.float64, (parameters.ferns, parameters.comparisons, 4)),
        "counts": (np.int32, (2, parameters.ferns, codes)),
        "positives": (np.float32, (parameters.max_positives, PATCH_SIZE)),
        "negatives": (np.float32, (parameters.max_negatives, PATCH_SIZE)),
        "view_lengths": (np.int32, (parameters.sift_views,)),
        "view_points": (np.float32, (keypoints, 2)),
        "view_descriptors": (np.float32, (keypoints, DESCRIPTOR)),
    }
    arrays = {name: _read(archive, name, kind, most) for name, (kind, most) in sizes.items()}
    for name in ("comparisons", "counts"):
        _require(arrays[name].shape == sizes[name][1], f"{name} has the shape {arrays[name].shape}")
    comparisons, counts, points = arrays["comparisons"], arrays["counts"], arrays["view_points"]
    _require(((comparisons >= 0.0) & (comparisons <= 1.0)).all(), "comparisons leave the window")
    _require(((counts >= 0) & (counts <= MAX_COUNT)).all(), "counts are out of range")
    for name in ("positives", "negatives"):
        squares = np.einsum("ij,ij->i", arrays[name], arrays[name])
        _require(((squares == 0.0) | (abs(squares - 1.0) < 1e-3)).all(), f"{name} are not normalised")
    _require(len(arrays["positives"]), "there is no template of the target")
    lengths = arrays["view_lengths"].astype(np.int64)
    _require((lengths > 0).all() and lengths.sum() == len(points), "keypoints and views differ")
    _require(len(points) == len(arrays["view_descriptors"]), "keypoints and descriptors differ")
    _require((abs(points) < MAX_KEYPOINT).all(), "keypoints lie outside their box")
    _require(
        ((arrays["view_descriptors"] >= 0.0) & (arrays["view_descriptors"] <= 255.0)).all(),
        "descriptors are out of range",
    )
    return arrays


def _header(archive: zipfile.ZipFile, parameters: Parameters) -> dict[str, Any]:
    """Read the header of a file that was learnt with these parameters."""
    header = json.loads(_read(archive, "header", np.uint8, (MAX_HEADER,)).tobytes())
    _require(type(header) is dict and header.get("format") == FORMAT, "it has another format")
    _require(header.get("version") == VERSION, f"its version is {header.get('version')!r}, not {VERSION}")
    learnt = header["parameters"]
    for name in DECISIVE:
        value = getattr(parameters, name)
        _require(learnt[name] == value, f"it was learnt with {name} {learnt[name]!r}, not {value!r}")
    return header


def _checked(header: dict[str, Any], arrays: dict[str, np.ndarray], parameters: Parameters) -> Model:
    """Build a model from the header's values, each of its kind and in its range."""

    def number(name: str, least: float, most: float, kind: type = float) -> Any:
        value = header[name]
        _require(type(value) in (int, kind) and least <= value <= most, f"{name} is {value!r}")
        return kind(value)

    def box(name: str) -> Box:
        values = header[name]
        _require(
            type(values) is list and len(values) == 4 and all(type(v) in (int, float) for v in values),
            f"{name} is {values!r}",
        )
        result = Box(*map(float, values))
        _require(
            result.finite and min(values[2:]) > 0.0 and result.inside_fraction(width, height) > 0.0,
            f"{name} is {values!r}",
        )
        return result

    size = header["image"]
    _require(
        type(size) is list and len(size) == 2 and all(type(v) is int for v in size), f"image is {size!r}"
    )
    width, height = size
    _require(min(size) > 0 and width * height <= MAX_PIXELS, f"image is {size!r}")
    target, last = box("target"), box("last")
    _require(target.inside_fraction(width, height) > 0.999, "the target lies outside its image")
    _require(1e-2 < last.width / target.width < 1e2, "the last box has nothing of the target")
    _require(
        min(target.width, target.height) >= parameters.min_side,
        f"its target of {target.width:g}x{target.height:g} pixels is smaller than min_side",
    )
    np.random.PCG64().state = header["random"]
    return Model(
        image=(width, height),
        target=target,
        last=last,
        min_variance=number("min_variance", 0.0, 255.0**2),
        fern_threshold=number("fern_threshold", 0.0, 1.0),
        nn_threshold=number("nn_threshold", 0.0, 1.0),
        phase=number("phase", 0, MAX_COUNT, int),
        random=header["random"],
        sift_calls=number("sift_calls", 0, MAX_COUNT, int),
        sift_expected=number("sift_expected", 0.0, MAX_COUNT),
        depth_size=None if header["depth_size"] is None else number("depth_size", 1e-3, 1e9),
        depth_relief=None if header["depth_relief"] is None else number("depth_relief", 1e-3, 1e3),
        **arrays,
    )
