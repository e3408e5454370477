# SPDX-License-Identifier: BSD-3-Clause
import contextlib
import json
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_video import Scene

from tld_follower.box import Box
from tld_follower.tld import storage
from tld_follower.tld.parameters import TRACKERS, Parameters
from tld_follower.tld.tracker import Tracker

FIRST = Box(60, 60, 48, 42)
SCENE = Scene(320, 240, (48, 42))


def trained(parameters, steps=25):
    """A tracker that has learnt, and then lost the target for so long that it searches everywhere."""
    tracker = Tracker(parameters)
    tracker.init(SCENE.frame(FIRST), FIRST)
    for step in range(1, steps):
        tracker.update(SCENE.frame(Box(60 + 2 * step, 60, 48 + step / 2, 42 + step / 2)))
    return tracker


@pytest.fixture(scope="module", params=TRACKERS)
def saved(request, tmp_path_factory):
    parameters = Parameters(tracker=request.param)
    path = tmp_path_factory.mktemp("model") / "target.npz"
    tracker = trained(parameters)
    storage.save(path, tracker.model(), parameters)
    return path, parameters, tracker


@pytest.mark.parametrize("name", TRACKERS)
def test_goes_on_exactly_as_the_tracker_that_was_saved(name, tmp_path):
    parameters = Parameters(tracker=name)
    original = trained(parameters)
    for _ in range(parameters.scales * parameters.widen_frames):
        original.update(SCENE.frame(None))
    path = tmp_path / "target.npz"
    storage.save(path, original.model(), parameters)
    restored = Tracker(parameters, seed=5)
    restored.restore(storage.load(path, parameters))
    assert restored.initialised
    assert restored.templates == original.templates
    frames = [SCENE.frame(Box(200 - 3 * step, 120, 50, 44)) for step in range(15)]
    results = [[tracker.update(frame) for frame in frames] for tracker in (original, restored)]
    assert results[0] == results[1]
    assert results[0][-1].visible
    for field, before, after in zip(
        storage.fields(storage.Model),
        vars(original.model()).values(),
        vars(restored.model()).values(),
        strict=True,
    ):
        np.testing.assert_equal(before, after, err_msg=field.name)


def test_is_lost_with_a_model_at_first(saved):
    path, parameters, _ = saved
    tracker = Tracker(parameters)
    tracker.restore(storage.load(path, parameters))
    assert not tracker.update(SCENE.frame(None)).visible
    found = [tracker.update(SCENE.frame(Box(220, 150, 30, 26.25))) for _ in range(4)][-1]
    assert found.box.overlap(Box(220, 150, 30, 26.25)) > 0.6


def test_what_was_read_is_what_was_written(saved):
    path, parameters, tracker = saved
    model, again = tracker.model(), storage.load(path, parameters)
    for name, value in vars(model).items():
        np.testing.assert_equal(getattr(again, name), value, err_msg=name)
        if isinstance(value, np.ndarray):
            assert getattr(again, name).dtype == value.dtype


def test_what_depth_has_told_is_kept(tmp_path):
    tracker, depth = Tracker(), np.full((240, 320), 2.0, np.float32)
    tracker.init(SCENE.frame(FIRST), FIRST, depth)
    for _ in range(15):
        tracker.update(SCENE.frame(FIRST), depth)
    storage.save(tmp_path / "m.npz", tracker.model(), Parameters())
    model = storage.load(tmp_path / "m.npz", Parameters())
    assert model.depth_size == pytest.approx(2.0 * np.sqrt(FIRST.area), rel=0.05)
    assert model.depth_relief == pytest.approx(1.0)
    restored = Tracker()
    restored.restore(model)
    assert restored.model().depth_size == model.depth_size
    assert restored.model().depth_relief == model.depth_relief
    found = [restored.update(SCENE.frame(FIRST), depth) for _ in range(3)][-1]
    assert found.box.overlap(FIRST) > 0.8
    # What looks like the target but is half as large, so near, is another thing.
    other = Tracker()
    other.restore(model)
    assert not any(other.update(SCENE.frame(FIRST), 0.5 * depth).visible for _ in range(3))


def test_a_model_needs_a_target():
    with pytest.raises(RuntimeError, match="no target"):
        Tracker().model()


def test_images_of_another_size_are_refused_after_loading(saved):
    path, parameters, _ = saved
    tracker = Tracker(parameters)
    tracker.restore(storage.load(path, parameters))
    with pytest.raises(ValueError, match="320x240"):
        tracker.update(np.zeros((480, 640), np.uint8))


@pytest.mark.parametrize(
    "change", [{"ferns": 9}, {"comparisons": 12}, {"blur": 2.0}, {"window_side": 20.0}], ids=str
)
def test_other_decisive_parameters_are_named(saved, change):
    path, parameters, _ = saved
    (name,) = change
    with pytest.raises(ValueError, match=f"learnt with {name}"):
        storage.load(path, Parameters(tracker=parameters.tracker, **change))


def test_other_parameters_may_change(saved):
    path, parameters, _ = saved
    storage.load(path, Parameters(tracker=parameters.tracker, lost_threshold=0.6, scales=5))


def test_a_model_larger_than_the_caps_is_refused(saved):
    path, parameters, _ = saved
    with pytest.raises(ValueError, match="negatives is an array"):
        storage.load(path, Parameters(tracker=parameters.tracker, max_positives=1, max_negatives=1))


def test_saving_is_all_or_nothing(saved, tmp_path, monkeypatch):
    _, parameters, tracker = saved
    path = tmp_path / "m.npz"
    storage.save(path, tracker.model(), parameters)
    before = path.read_bytes()

    def disk_full(_):
        raise OSError("no space left on device")

    monkeypatch.setattr(storage.os, "fsync", disk_full)
    with pytest.raises(OSError, match="no space"):
        storage.save(path, tracker.model(), parameters)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_directory_that_does_not_exist(saved, tmp_path):
    _, parameters, tracker = saved
    with pytest.raises(FileNotFoundError):
        storage.save(tmp_path / "none" / "m.npz", tracker.model(), parameters)
    with pytest.raises(FileNotFoundError):
        storage.load(tmp_path / "none.npz", parameters)


def rewrite(source, target, header=None, **arrays):
    """Copy a model file with a changed header, or changed arrays (None: left out)."""
    with np.load(source) as file:
        content = {**file, **arrays}
    values = json.loads(content["header"].tobytes())
    values.update(header or {})
    content["header"] = np.frombuffer(json.dumps(values).encode(), np.uint8)
    np.savez(target, **{name: value for name, value in content.items() if value is not None})


NAN = float("nan")


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ({"version": 2}, "version"),
        ({"format": "something else"}, "format"),
        ({"image": [10**9, 10**9]}, "image"),
        ({"image": [0, 240]}, "image"),
        ({"image": "large"}, "image"),
        ({"target": [NAN, 0, 10, 10]}, "target"),
        ({"target": [0, 0, 10, -10]}, "target"),
        ({"target": [300, 200, 1e300, 1e300]}, "target"),
        ({"target": [300, 200, 48, 42]}, "target"),
        ({"target": [10, 10, 2, 2]}, "min_side"),
        ({"last": [0, 0, 1e200, 10]}, "last"),
        ({"nn_threshold": NAN}, "nn_threshold"),
        ({"fern_threshold": 1.5}, "fern_threshold"),
        ({"min_variance": -1}, "min_variance"),
        ({"phase": 0.5}, "phase"),
        ({"sift_calls": -1}, "sift_calls"),
        ({"depth_size": float("inf")}, "depth_size"),
        ({"depth_relief": 0}, "depth_relief"),
        ({"random": {"bit_generator": "MT19937"}}, "damaged|PCG64"),
        ({"random": 5}, "damaged"),
        ({"parameters": []}, "damaged"),
    ],
    ids=str,
)
def test_wrong_headers(saved, tmp_path, header, words):
    path, parameters, _ = saved
    rewrite(path, tmp_path / "m.npz", header)
    with pytest.raises(ValueError, match=words):
        storage.load(tmp_path / "m.npz", parameters)


def spoil(array, value):
    array = array.copy()
    array.flat[0] = value
    return array


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("positives", lambda a: spoil(a, NAN)),
        ("positives", lambda a: 2 * a),
        ("positives", lambda a: a[:0]),
        ("positives", lambda a: a.astype(np.float64)),
        ("positives", lambda a: a[:, :200]),
        ("negatives", lambda a: np.zeros((100000, 225), np.float32)),
        ("negatives", lambda a: np.array([None, 1], object)),
        ("counts", lambda a: spoil(a, -1)),
        ("counts", lambda a: a[:, :, :100]),
        ("counts", lambda a: a[:1]),
        ("comparisons", lambda a: spoil(a, 1.5)),
        ("view_lengths", lambda a: np.array([7, -7], np.int32)),
        ("view_lengths", lambda a: np.array([7], np.int32)),
        ("view_points", lambda a: np.full((3, 2), 1e9, np.float32)),
        ("view_descriptors", lambda a: np.full((3, 128), -1, np.float32)),
        ("negatives", lambda a: None),
        ("header", lambda a: None),
    ],
)
def test_wrong_arrays(saved, tmp_path, name, change):
    path, parameters, _ = saved
    with np.load(path) as file:
        arrays = dict(file)
    arrays[name] = change(arrays[name])
    arrays = {name: value for name, value in arrays.items() if value is not None}
    np.savez(tmp_path / "m.npz", **arrays)
    with pytest.raises(ValueError, match=r"m\.npz is no model of this tracker"):
        storage.load(tmp_path / "m.npz", parameters)


def test_an_array_that_claims_to_be_endless_takes_no_memory(saved, tmp_path):
    path, parameters, _ = saved
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(tmp_path / "m.npz", "w") as target:
        for name in source.namelist():
            data = source.read(name)
            if name == "positives.npy":
                shape = f"({len(np.load(path)['positives'])}, 225)".encode()
                data = data.replace(shape, b"(9999999999, 225)")
            target.writestr(name, data)
    with pytest.raises(ValueError, match="9999999999"):
        storage.load(tmp_path / "m.npz", parameters)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_damaged_files_are_refused_or_whole(saved, tmp_path_factory, data):
    path, parameters, _ = saved
    whole = path.read_bytes()
    damaged = bytearray(whole[: data.draw(st.integers(0, len(whole)), label="cut off at")])
    for _ in range(data.draw(st.integers(0, 3), label="flips") if damaged else 0):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] ^= data.draw(st.integers(1, 255))
    other = tmp_path_factory.mktemp("damaged") / "m.npz"
    other.write_bytes(damaged)
    # Some bits nobody reads, as a file's date: then the model is whole.
    with contextlib.suppress(ValueError):
        Tracker(parameters).restore(storage.load(other, parameters))


@settings(max_examples=50, deadline=None)
@given(garbage=st.binary(max_size=300))
def test_garbage_is_refused(tmp_path_factory, garbage):
    path = tmp_path_factory.getbasetemp() / "garbage.npz"
    path.write_bytes(garbage)
    with pytest.raises(ValueError, match="is no model of this tracker"):
        storage.load(path, Parameters())
