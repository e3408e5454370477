# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_video import Scene, texture

from tld_follower.box import Box
from tld_follower.tld.alignment import align, blend
from tld_follower.tld.detector import Detector, label_clusters, overlaps
from tld_follower.tld.frame import Frame
from tld_follower.tld.keypoints import SiftKeypoints
from tld_follower.tld.learning import Learner
from tld_follower.tld.parameters import Parameters
from tld_follower.tld.redetection import SiftMemory
from tld_follower.tld.windows import window_sizes

TARGET = Box(60.0, 45.0, 36.0, 30.0)
PARAMETERS = Parameters()


def trained(scene, parameters=PARAMETERS, seed=0):
    frame = Frame(scene.frame(TARGET), parameters.blur)
    rng = np.random.default_rng(seed)
    detector = Detector(frame, TARGET, parameters, rng)
    Learner(detector, parameters, rng).initialise(frame, TARGET)
    return detector


@pytest.fixture(scope="module")
def scene():
    return Scene()


@pytest.fixture(scope="module")
def detector(scene):
    return trained(scene)


@pytest.mark.parametrize(
    ("place", "least"), [(Box(100.3, 20.6, 36.0, 30.0), 0.7), (Box(60, 40, 36, 30).scale(1.2**2), 0.55)]
)
def test_finds_the_target_elsewhere_and_larger(scene, place, least):
    frame = Frame(scene.frame(place), 3.0)
    overlap = []
    for seed in range(8):
        detector = trained(scene, seed=seed)
        clusters = detector.clusters(detector.detect(frame, TARGET, 4))
        assert len(clusters) == 1
        assert clusters[0].confidence > detector.nn_threshold
        overlap.append(clusters[0].box.overlap(place))
    assert min(overlap) > least
    assert np.mean(overlap) > 0.75


def test_finds_nothing_where_there_is_none(scene, detector):
    assert detector.clusters(detector.detect(Frame(scene.frame(None), 3.0), TARGET, 10)) == []


@pytest.mark.parametrize("value", [0, 255])
def test_blank_frames_have_no_detections(detector, value):
    detections = detector.detect(Frame(np.full((120, 160), value, np.uint8), 3.0), TARGET, 10)
    assert len(detections.boxes) == 0
    assert detector.clusters(detections) == []


def test_held_out_background_raises_the_thresholds(scene):
    parameters = Parameters(fern_threshold=0.01, nn_threshold=0.01)
    raised = trained(scene, parameters)
    assert raised.fern_threshold >= parameters.fern_threshold
    assert raised.nn_threshold > parameters.nn_threshold


def test_training_makes_the_target_likelier_than_its_background(scene, detector):
    frame = Frame(scene.frame(TARGET), 3.0)
    found = detector.scan(frame, TARGET, 4, -1.0)
    shared = overlaps(found.boxes, np.array(TARGET.as_tuple()))
    assert found.confidences[shared > 0.75].mean() > 0.6
    assert found.confidences[shared < 0.2].mean() < 0.2


def test_no_more_windows_than_allowed(scene):
    parameters = Parameters(max_windows=500)
    small = trained(scene, parameters)
    assert len(small.scan(Frame(scene.frame(TARGET), 3.0), TARGET, 10, -1.0).boxes) <= 500


@settings(max_examples=50, deadline=None)
@given(st.floats(8, 400), st.floats(8, 400), st.integers(80, 800), st.integers(80, 600))
def test_window_sizes_keep_aspect_and_octave(width, height, image_width, image_height):
    comparisons = np.array([[[0.0, 0.0, 1.0, 1.0]]])
    sizes = window_sizes(Box(0, 0, width, height), comparisons, PARAMETERS)
    assert any(size.width == width for size in sizes)
    for size in sizes:
        assert size.width / size.height == pytest.approx(width / height)
        side = np.sqrt(size.width * size.height) / size.factor
        assert side < 2 * PARAMETERS.window_side
        assert size.octave == 0 or side >= PARAMETERS.window_side
        assert size.offsets.max() <= max(round(size.grid[0]), round(size.grid[1])) - 1
        assert size.count(image_width, image_height) >= 0


def test_overlaps_match_the_box():
    rng = np.random.default_rng(0)
    boxes = rng.uniform(1, 40, (50, 4))
    expected = [Box(*b).overlap(TARGET.scale(0.8)) for b in boxes]
    np.testing.assert_allclose(overlaps(boxes, np.array(TARGET.scale(0.8).as_tuple())), expected)


def test_clusters_are_connected_groups():
    boxes = np.array([[0, 0, 10, 10], [50, 0, 10, 10], [2, 0, 10, 10], [4, 0, 10, 10.0]])
    # The first and the last overlap by less than half, but the third joins them.
    assert label_clusters(boxes, 0.5).tolist() == [0, 1, 0, 0]
    assert label_clusters(boxes[:0], 0.5).tolist() == []


def test_alignment_corrects_a_shifted_box(scene, detector):
    frame = Frame(scene.frame(TARGET), 3.0)
    shifted = Box(62.0, 43.8, 37.5, 31.25)
    aligned, similarity = align(frame, detector.model, shifted, 0.06)
    assert aligned.overlap(TARGET) > shifted.overlap(TARGET) + 0.03
    assert similarity > 0.95
    unmoved, _ = align(frame, detector.model, TARGET, 0.06)
    assert unmoved.overlap(TARGET) > 0.97


def test_blend_lies_between():
    assert blend(Box(0, 0, 10, 10), Box(10, 4, 20, 12), 0.5) == Box(5, 2, 15, 11)
    assert blend(TARGET, Box(0, 0, 1, 1), 0.0) == TARGET


def test_learning_adds_positives_and_false_alarms(scene):
    detector = trained(scene)
    learner = Learner(detector, PARAMETERS, np.random.default_rng(1))
    other = Scene(seed=7)
    frame = Frame(other.frame(TARGET), 3.0)
    count = len(detector.model.positives)
    learner.update(frame, TARGET, detector.detect(frame, TARGET, 4))
    assert len(detector.model.positives) == count + 1
    # Once learnt, the view is the target.
    patch = frame.patches(np.array([TARGET.as_tuple()]))
    assert detector.model.similarity(patch).relative[0] > 0.99
    learner.update(frame, TARGET, detector.detect(frame, TARGET, 4))
    assert len(detector.model.positives) == count + 1


def test_learning_at_the_image_border():
    image = texture(60, 60, 0)
    box = Box(0.0, 40.0, 20.0, 20.0)
    frame = Frame(image, 3.0)
    detector = Detector(frame, box, PARAMETERS, np.random.default_rng(0))
    Learner(detector, PARAMETERS, np.random.default_rng(0)).initialise(frame, box)
    assert len(detector.model.positives) == 1


class TestSiftMemory:
    def scene(self):
        return Scene(320, 240, (80, 70))

    def memory(self, views=3):
        return SiftMemory(
            SiftKeypoints(300, 96.0), Parameters(sift_views=views, sift_interval=1, sift_pixels=10**6)
        )

    def test_proposes_the_target_where_it_came_back(self):
        scene, memory = self.scene(), self.memory()
        first, place = Box(40, 40, 80, 70), Box(180, 110, 96, 84)
        memory.learn(Frame(scene.frame(first), 3.0), first)
        assert memory.propose(Frame(scene.frame(place), 3.0), first, 0).overlap(place) > 0.8

    def test_proposes_nothing_without_the_target(self):
        scene, memory = self.scene(), self.memory()
        first = Box(40, 40, 80, 70)
        assert memory.propose(Frame(scene.frame(first), 3.0), first, 0) is None
        memory.learn(Frame(scene.frame(first), 3.0), first)
        assert memory.propose(Frame(scene.frame(None), 3.0), first, 0) is None
        assert memory.propose(Frame(np.zeros((240, 320), np.uint8), 3.0), first, 0) is None

    def test_the_first_view_outlives_the_others(self):
        scene, memory = self.scene(), self.memory(views=2)
        first, place = Box(40, 40, 80, 70), Box(180, 110, 80, 70)
        memory.learn(Frame(scene.frame(first), 3.0), first)
        for seed in range(20, 24):
            memory.learn(Frame(texture(240, 320, seed), 3.0), first)
        assert memory.propose(Frame(scene.frame(place), 3.0), first, 0).overlap(place) > 0.8
