# SPDX-License-Identifier: BSD-3-Clause
import pytest

from tld_follower.tld.parameters import Parameters
from tld_follower.tld.redetection import Witness
from tld_follower.tld.trust import Trust

PARAMETERS = Parameters()
STEADY, UNSTEADY = 0.5 * PARAMETERS.max_residual, 2.0 * PARAMETERS.max_residual
SURE = PARAMETERS.nn_threshold
STRANGE = 0.5 * (PARAMETERS.steady_threshold + PARAMETERS.lost_threshold)


@pytest.fixture
def trust():
    return Trust(PARAMETERS)


def observe(trust, residual, relative, conservative=0.0, witness=Witness.SILENT):
    return trust.observe(residual, relative, conservative, SURE, witness)


def test_a_steady_trajectory_may_look_strange(trust):
    assert all(observe(trust, STEADY, STRANGE) for _ in range(50))
    assert trust.valid


def test_after_an_unsteady_frame_it_may_not(trust):
    assert observe(trust, UNSTEADY, SURE + 0.01)
    assert not observe(trust, STEADY, STRANGE)


def test_steady_frames_end_the_doubt(trust):
    observe(trust, UNSTEADY, SURE + 0.01)
    for _ in range(PARAMETERS.confirm_frames + 1):
        assert observe(trust, STEADY, SURE + 0.01)
    assert observe(trust, STEADY, STRANGE)


def test_patience_with_a_weak_look_in_doubt_ends(trust):
    weak = PARAMETERS.lost_threshold + 0.01
    shown = [observe(trust, UNSTEADY, weak) for _ in range(20)]
    assert shown[0]
    assert not any(shown[PARAMETERS.patience_frames :])


def test_only_steady_frames_of_a_valid_trajectory_teach(trust):
    observe(trust, STEADY, SURE + 0.01)
    assert trust.learnable
    observe(trust, UNSTEADY, SURE + 0.01)
    assert not trust.learnable
    trust.restart(provisional=False)
    observe(trust, STEADY, SURE + 0.01)
    assert not trust.learnable


def test_the_model_validates_a_new_trajectory_after_some_frames_alike(trust):
    alike, other = PARAMETERS.valid_threshold + 0.01, PARAMETERS.valid_threshold - 0.01
    trust.restart(provisional=False)
    for conservative in [*[alike] * (PARAMETERS.confirm_frames - 1), other]:
        observe(trust, STEADY, SURE + 0.01, conservative)
        assert not trust.valid
    for _ in range(PARAMETERS.confirm_frames):
        observe(trust, STEADY, SURE + 0.01, alike)
    assert trust.valid


def test_a_long_steady_trajectory_is_believed_whatever_its_look(trust):
    weak = PARAMETERS.provisional_threshold - 0.01
    trust.restart(provisional=False)
    for _ in range(PARAMETERS.persist_frames + 1):
        assert observe(trust, STEADY, SURE + 0.01)
    assert all(observe(trust, STEADY, weak) for _ in range(3 * PARAMETERS.patience_frames))


def test_a_box_that_leaves_the_image_needs_more_than_steady_points(trust):
    assert observe(trust, STEADY, STRANGE)
    trust.doubt()
    assert not observe(trust, STEADY, STRANGE)


def test_keypoints_make_up_for_a_weak_look(trust):
    observe(trust, UNSTEADY, SURE + 0.01)
    assert all(observe(trust, UNSTEADY, STRANGE, witness=Witness.FOR) for _ in range(20))


def test_missing_keypoints_end_the_showing_of_a_weak_box_in_doubt(trust):
    weak = PARAMETERS.lost_threshold + 0.01
    assert observe(trust, STEADY, weak, witness=Witness.AGAINST)
    observe(trust, UNSTEADY, SURE + 0.01)
    assert not observe(trust, STEADY, weak, witness=Witness.AGAINST)
    assert observe(trust, STEADY, SURE + 0.01, witness=Witness.AGAINST)


def test_a_weak_detection_needs_the_next_frame(trust):
    trust.restart(provisional=True)
    assert not observe(trust, STEADY, PARAMETERS.provisional_threshold - 0.01)
    trust.restart(provisional=True)
    assert observe(trust, STEADY, PARAMETERS.provisional_threshold + 0.01)
    assert not trust.provisional
