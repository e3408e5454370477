# SPDX-License-Identifier: BSD-3-Clause
"""The detector's scan over all sizes and its clusters, against plain Python."""

import numpy as np
import pytest
from synthetic_video import Scene, texture

from tld_follower.box import Box
from tld_follower.tld.detector import Detections, Detector, label_clusters
from tld_follower.tld.frame import Frame
from tld_follower.tld.learning import Learner
from tld_follower.tld.object_model import Similarity
from tld_follower.tld.parameters import Parameters

SMALL = Parameters(scales=2, ferns=4, comparisons=5, window_side=16.0)


def with_random_ferns(frame, box, parameters):
    detector = Detector(frame, box, parameters, np.random.default_rng(0))
    detector.ferns.posteriors[:] = np.random.default_rng(1).random(detector.ferns.posteriors.shape)
    return detector


def reference_scan(detector, frame, threshold):
    """Windows that pass, as {box: (codes, confidence)}, and those on the very edge of a gate."""
    found, close = {}, set()
    for size in detector.sizes:
        level = frame.level(size.octave)
        blurred, gray = level.blurred, level.gray.astype(float)
        width, height = round(size.grid[0]), round(size.grid[1])
        places = [
            (round(ix * size.grid[2]), round(iy * size.grid[3]))
            for ix in range(gray.shape[1])
            for iy in range(gray.shape[0])
        ]
        for x, y in places:
            if x + width > gray.shape[1] or y + height > gray.shape[0]:
                continue
            codes = []
            for fern in size.offsets:
                bits = [blurred[y + b, x + a] > blurred[y + d, x + c] for a, b, c, d in fern]
                codes.append(int("".join(str(int(bit)) for bit in bits), 2))
            confidence = float(np.mean(detector.ferns.posteriors[np.arange(len(codes)), codes]))
            variance = gray[y : y + height, x : x + width].var()
            box = (x * size.factor, y * size.factor, size.width, size.height)
            if abs(variance - detector.min_variance) < 1e-6 or abs(confidence - threshold) < 1e-6:
                close.add(box)
            elif variance >= detector.min_variance and confidence > threshold:
                found[box] = (codes, confidence)
    return found, close


@pytest.mark.parametrize("target", [Box(20, 15, 14, 12), Box(10.5, 8.5, 41.0, 35.0)])
@pytest.mark.parametrize("threshold", [-1.0, 0.5])
def test_scan_finds_the_windows_of_every_size(target, threshold):
    frame = Frame(texture(61, 83, 0, 3.0), SMALL.blur)
    detector = with_random_ferns(frame, target, SMALL)
    expected, close = reference_scan(detector, frame, threshold)
    assert expected
    found = detector.scan(frame, target, SMALL.scales, threshold)
    got = {tuple(b): (c, f) for b, c, f in zip(found.boxes, found.codes, found.confidences, strict=True)}
    assert len(got) == len(found.boxes)
    assert set(got) - close == set(expected)
    for box, (codes, confidence) in expected.items():
        assert got[box][0].tolist() == codes
        assert got[box][1] == pytest.approx(confidence, abs=1e-6)
    assert np.all(np.diff(found.confidences) <= 0)


def test_only_sizes_near_the_last_box_are_scanned():
    target = Box(20, 15, 20, 20)
    frame = Frame(texture(80, 90, 1, 3.0), SMALL.blur)
    detector = with_random_ferns(frame, target, SMALL)
    widths = detector.scan(frame, target, 1, -1.0).boxes[:, 2]
    assert np.unique(widths) == pytest.approx([20 / 1.2, 20, 20 * 1.2])
    assert len(detector.scan(frame, target.scale(30.0), 1, -1.0).boxes) == 0


def test_with_too_many_windows_frames_take_turns_but_not_about_the_target():
    parameters = Parameters(scales=1, ferns=4, comparisons=5, max_windows=700)
    target = Box(40.0, 30.0, 16.0, 14.0)
    frame = Frame(texture(70, 90, 2, 3.0), parameters.blur)
    detector = with_random_ferns(frame, target, parameters)
    everything, close = reference_scan(detector, frame, 0.7)
    turns = [{tuple(b) for b in detector.scan(frame, target, 1, 0.7).boxes} for _ in range(40)]
    assert set.union(*turns) - close == set(everything)
    assert min(map(len, turns)) < len(everything)
    near = {b for b in everything if max(abs(b[0] - target.x), abs(b[1] - target.y)) < 10}
    assert near
    for turn in turns:
        assert near <= turn


@pytest.mark.parametrize("size", [(3, 3), (10, 200), (200, 9)])
def test_images_smaller_than_every_window_have_no_detections(size):
    detector = with_random_ferns(Frame(texture(80, 90, 1), 3.0), Box(20, 15, 40, 40), SMALL)
    image = np.random.default_rng(0).integers(0, 256, size, dtype=np.uint8)
    found = detector.detect(Frame(image, 3.0), Box(20, 15, 40, 40), 2)
    assert found.boxes.shape == (0, 4)
    assert detector.clusters(found) == []


def test_two_targets_are_two_clusters():
    parameters, rng = Parameters(), np.random.default_rng(0)
    scene, first, second = Scene(240, 160), Box(30, 30, 32, 28), Box(150, 90, 32, 28)
    frame = Frame(scene.frame(first), parameters.blur)
    detector = Detector(frame, first, parameters, rng)
    Learner(detector, parameters, rng).initialise(frame, first)
    scene.background = scene.frame(first)
    clusters = detector.clusters(
        detector.detect(Frame(scene.frame(second), parameters.blur), first, parameters.scales)
    )
    assert len(clusters) == 2
    for box in (first, second):
        assert max(cluster.box.overlap(box) for cluster in clusters) > 0.6


def reference_labels(boxes, min_overlap):
    """Groups by repeated merging, numbered in order of appearance."""
    labels = list(range(len(boxes)))
    for _ in boxes:
        for i, a in enumerate(boxes):
            for j, b in enumerate(boxes):
                if Box(*a).overlap(Box(*b)) > min_overlap:
                    labels[i] = labels[j] = min(labels[i], labels[j])
    order = list(dict.fromkeys(labels))
    return [order.index(label) for label in labels]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("min_overlap", [0.2, 0.5])
def test_labels_equal_the_reference(seed, min_overlap):
    rng = np.random.default_rng(seed)
    boxes = np.concatenate([rng.uniform(0, 60, (25, 2)), rng.uniform(10, 40, (25, 2))], axis=1)
    assert label_clusters(boxes, min_overlap).tolist() == reference_labels(boxes.tolist(), min_overlap)


def test_clusters_are_weighted_means_of_what_is_sure_enough():
    frame, target = Frame(texture(80, 90, 1), 3.0), Box(20, 15, 30, 30)
    parameters = Parameters(nn_threshold=0.6, redetection_margin=0.1, min_conservative=0.45)
    detector = Detector(frame, target, parameters, np.random.default_rng(0))
    corners = [(0, 0), (4, 0), (60, 0), (90, 0), (0, 50)]
    relative = np.array([0.6, 0.9, 0.8, 0.45, 0.95], np.float32)
    conservative = np.array([0.4, 0.5, 0.6, 0.6, 0.3], np.float32)
    boxes = np.array([[x, y, 20.0, 20.0] for x, y in corners])
    codes, patches = np.zeros((5, 10), np.int32), np.zeros((5, 225), np.float32)
    similarity = Similarity(relative, conservative, relative, relative)
    first, second = detector.clusters(Detections(boxes, codes, relative, patches, similarity))
    assert first.box.as_tuple() == pytest.approx((4 * 0.9 / 1.5, 0, 20, 20))
    assert (first.confidence, first.conservative) == pytest.approx((0.9, 0.5))
    assert second.box.as_tuple() == pytest.approx((60, 0, 20, 20))
    assert second.confidence == pytest.approx(0.8)
