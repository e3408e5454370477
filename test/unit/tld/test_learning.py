# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
from synthetic_video import Scene, moving_box, texture

from tld_follower.box import Box
from tld_follower.tld.detector import Detector
from tld_follower.tld.frame import Frame
from tld_follower.tld.learning import Learner
from tld_follower.tld.parameters import Parameters

PARAMETERS = Parameters()
BOX = moving_box(0)
SCENE = Scene()


def view(box):
    return Frame(SCENE.frame(box), PARAMETERS.blur)


def learner_for(frame, box, parameters=PARAMETERS):
    rng = np.random.default_rng(0)
    detector = Detector(frame, box, parameters, rng)
    return detector, Learner(detector, parameters, rng)


@pytest.fixture
def learnt():
    detector, learner = learner_for(view(BOX), BOX)
    learner.initialise(view(BOX), BOX)
    return detector, learner


def reference_windows(detector, frame, box, parameters):
    """Every window with its overlap, of the sizes that may be positive."""
    found = {}
    for index, size in enumerate(detector.sizes):
        width, height, step_x, step_y = size.grid
        level = frame.level(size.octave).gray
        for ix in range(level.shape[1]):
            for iy in range(level.shape[0]):
                x, y = round(ix * step_x), round(iy * step_y)
                if x + round(width) <= level.shape[1] and y + round(height) <= level.shape[0]:
                    place = Box(x * size.factor, y * size.factor, size.width, size.height)
                    found[index, x, y] = place.overlap(box)
    return {key: value for key, value in found.items() if value >= parameters.positive_overlap}


@pytest.mark.parametrize(
    "box", [BOX, Box(0, 0, 30, 20), Box(128.5, 92.5, 31.5, 27.5), Box(20, 10, 120, 100), Box(60, 50, 10, 9)]
)
def test_positive_windows_are_those_that_overlap_most(box):
    frame = view(BOX)
    detector, learner = learner_for(frame, box)
    everything = reference_windows(detector, frame, box, PARAMETERS)
    indices = {id(size): index for index, size in enumerate(detector.sizes)}
    got = {
        (indices[id(size)], int(x), int(y))
        for size, corners in learner._nearest_windows(frame, box)
        for x, y in corners
    }
    assert got <= set(everything)
    wanted = min(PARAMETERS.positive_windows, len(everything))
    best = sorted(everything.values(), reverse=True)[:wanted]
    assert sorted((everything[key] for key in got), reverse=True)[:wanted] == pytest.approx(best)
    # Ties with the last one may come along.
    assert all(everything[key] >= best[-1] - 1e-9 for key in got)


def test_thresholds_never_fall_below_the_parameters(learnt):
    detector, _ = learnt
    assert PARAMETERS.fern_threshold <= detector.fern_threshold <= 1.0
    assert PARAMETERS.nn_threshold <= detector.nn_threshold <= 1.0


def test_the_first_view_is_the_first_template(learnt):
    detector, _ = learnt
    first = view(BOX).patches(np.array([BOX.as_tuple()]))[0]
    assert np.array_equal(detector.model.positives.patches[0], first)


def test_what_is_known_is_not_learnt_twice(learnt):
    detector, learner = learnt
    frame = view(BOX)
    for _ in range(3):
        learner.update(frame, BOX, detector.detect(frame, BOX, 4))
    settled = len(detector.model)
    for _ in range(10):
        learner.update(frame, BOX, detector.detect(frame, BOX, 4))
    assert len(detector.model) == settled
    assert len(detector.model.positives) == 1


def test_a_look_alike_away_from_the_target_becomes_background(learnt):
    detector, learner = learnt
    alike = Box(110.0, 80.0, 32.0, 28.0)
    scene = Scene()
    scene.background = scene.frame(alike)
    both = Frame(scene.frame(BOX), PARAMETERS.blur)

    def elsewhere():
        clusters = detector.clusters(detector.detect(both, BOX, 4))
        return [cluster for cluster in clusters if cluster.box.overlap(BOX) < 0.2]

    assert any(cluster.box.overlap(alike) > 0.5 for cluster in elsewhere())
    negatives = len(detector.model.negatives)
    for _ in range(5):
        learner.update(both, BOX, detector.detect(both, BOX, 4))
    assert len(detector.model.negatives) > negatives
    assert elsewhere() == []


def test_a_new_look_becomes_a_template(learnt):
    detector, learner = learnt
    other = Frame(Scene(seed=20).frame(BOX), PARAMETERS.blur)
    patch = other.patches(np.array([BOX.as_tuple()]))
    assert detector.model.similarity(patch).relative[0] < detector.nn_threshold
    learner.update(other, BOX, detector.detect(other, BOX, 4))
    assert len(detector.model.positives) == 2
    assert detector.model.similarity(patch).relative[0] > 0.9


@pytest.mark.parametrize("limit", [1, 3])
def test_the_model_is_bounded(limit):
    parameters = Parameters(max_positives=limit, max_negatives=limit, warps=1, initial_warps=1)
    detector, learner = learner_for(view(BOX), BOX, parameters)
    learner.initialise(view(BOX), BOX)
    first = detector.model.positives.patches[0].copy()
    for seed in range(12):
        frame = Frame(Scene(seed=seed).frame(BOX), parameters.blur)
        learner.update(frame, BOX, detector.detect(frame, BOX, 4))
        assert len(detector.model.positives) <= limit
        assert len(detector.model.negatives) <= limit
    assert np.array_equal(detector.model.positives.patches[0], first)


@pytest.mark.parametrize("box", [Box(0, 0, 160, 120), Box(0, 0, 8, 8), Box(151.5, 111.5, 8.5, 8.5)])
def test_targets_at_the_limits_are_learnt(box):
    frame = view(BOX)
    detector, learner = learner_for(frame, box)
    learner.initialise(frame, box)
    assert len(detector.model.positives) == 1


def test_negatives_are_added_until_the_model_knows_the_rest():
    detector, learner = learner_for(view(BOX), BOX)
    model, rng = detector.model, np.random.default_rng(3)
    boxes = np.stack([*rng.uniform(0, 90, (2, 60)), np.full(60, 32.0), np.full(60, 28.0)], axis=1)
    wrong = view(BOX).patches(boxes)
    model.positives.add(wrong[0])
    learner._add_negatives(wrong[1:])
    assert 0 < len(model.negatives) < 59
    assert model.similarity(wrong[1:]).relative.max() <= PARAMETERS.negative_threshold + 1e-6


@pytest.mark.parametrize("scale", [0.3, 0.7, 1.5, 4.0])
@pytest.mark.parametrize("box", [Box(200, 150, 47, 47), Box(250, 60, 20, 110)], ids=str)
def test_windows_that_hardly_overlap_the_target_are_learnt_from_too(box, scale):
    parameters = Parameters(positive_overlap=0.011, positive_windows=100000, warps=1)
    frame = Frame(texture(480, 640, 0), parameters.blur)
    _, learner = learner_for(frame, box, parameters)
    assert len(learner._warped_codes(frame, box.scale(scale), 1, 5.0)) > 100
