# SPDX-License-Identifier: BSD-3-Clause
import pytest

from tld_follower.tld.parameters import Parameters
from tld_follower.tld.trust import Trust

PARAMETERS = Parameters()
STEADY, UNSTEADY = 0.5 * PARAMETERS.max_residual, 2.0 * PARAMETERS.max_residual
SURE = PARAMETERS.nn_threshold
STRANGE = 0.5 * (PARAMETERS.steady_threshold + PARAMETERS.lost_threshold)


@pytest.fixture
def trust():
    return Trust(PARAMETERS)


def observe(trust, residual, relative, conservative=0.0):
    return trust.observe(residual, relative, conservative, SURE)


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


def test_the_model_validates_a_new_trajectory(trust):
    trust.restart(provisional=False)
    assert not trust.valid
    observe(trust, STEADY, SURE + 0.01, conservative=PARAMETERS.valid_threshold - 0.01)
    assert not trust.valid
    observe(trust, STEADY, SURE + 0.01, conservative=PARAMETERS.valid_threshold + 0.01)
    assert trust.valid


def test_a_weak_detection_needs_the_next_frame(trust):
    trust.restart(provisional=True)
    assert not observe(trust, STEADY, PARAMETERS.provisional_threshold - 0.01)
    trust.restart(provisional=True)
    assert observe(trust, STEADY, PARAMETERS.provisional_threshold + 0.01)
    assert not trust.provisional
