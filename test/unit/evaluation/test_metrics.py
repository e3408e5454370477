import numpy as np
import pytest

from tld_follower.evaluation.metrics import FOLLOWING, first_difference, flight_figures, summary

DRIVE = 12.0


def figures_of(trace, wanted=(*FOLLOWING, "recovered_10s")):
    return flight_figures(trace, DRIVE, wanted)


def flight(distance, box_visible=None, overlap=None, in_view=None):
    """A trace at 30 Hz from 2 s before the drive to 6 s after it; `distance` is a function of time."""
    t = np.arange(-60, 540) / 30
    n = len(t)
    visible = np.ones(n, bool) if box_visible is None else box_visible(t)
    return {
        "t": list(t),
        "distance": [distance(x) for x in t],
        "clearance": [0.6] * (n - 1) + [0.4],
        "collisions": [0] * (n - 1) + [2],
        "in_view": list(np.ones(n, bool) if in_view is None else in_view(t)),
        "box_visible": list(visible),
        "overlap": list(np.where(visible, 0.8 if overlap is None else overlap(t), 0.0)),
    }


def test_a_perfect_flight():
    figures = figures_of(flight(lambda t: 1.0))
    for name in ("peak_gap_m", "steady_error_m", "rmse_m", "overshoot_m", "settle_s"):
        assert figures[name] == 0
    assert figures["tracked_fraction"] == figures["visible_fraction"] == 1
    assert figures["mean_overlap"] == pytest.approx(0.8)
    assert (figures["min_clearance_m"], figures["collisions"]) == (0.4, 2)
    assert (figures["losses"], figures["recoveries"], figures["recovery_s"]) == (0, 0, None)


def test_each_figure_looks_at_its_own_part_of_the_flight():
    def distance(t):
        if 2 <= t < 3:
            return 1.9
        if 5 <= t < 12:
            return 1.3
        if 12.5 <= t < 14:
            return 0.8
        return 1.0

    figures = figures_of(flight(distance))
    assert figures["peak_gap_m"] == pytest.approx(0.9)
    assert figures["steady_error_m"] == pytest.approx(0.3)
    assert figures["overshoot_m"] == pytest.approx(0.2)
    assert figures["settle_s"] == pytest.approx(2.0, abs=0.04)
    squares = 1.0 * 0.9**2 + 7 * 0.3**2 + 1.5 * 0.2**2
    assert figures["rmse_m"] == pytest.approx((squares / 14) ** 0.5, rel=0.02)


def test_never_settled():
    assert figures_of(flight(lambda t: 1.1))["settle_s"] is None


def test_losses_count_and_boxes_off_the_target_are_not_tracked():
    figures = figures_of(
        flight(
            lambda t: 1.0,
            box_visible=lambda t: ~(((t >= 2) & (t < 3)) | (t >= 15)),
            overlap=lambda t: np.where(t < 0, 0.2, 0.9),
        )
    )
    assert (figures["losses"], figures["recoveries"]) == (3, 2)  # the first while off the target
    assert figures["recovery_s"] == pytest.approx(2.0)
    assert figures["tracked_fraction"] == pytest.approx((20 - 2 - 1 - 3) / 20)


def test_frames_without_the_target_do_not_count_as_missed():
    figures = figures_of(flight(lambda t: 1.0, box_visible=lambda t: t < 8, in_view=lambda t: t < 8))
    assert figures["visible_fraction"] == pytest.approx(0.5)
    assert figures["tracked_fraction"] == 1
    assert (figures["wrong_boxes"], figures["boxes_while_hidden"]) == (0, 0)


def test_boxes_where_the_target_is_not_are_wrong():
    figures = figures_of(
        flight(
            lambda t: 1.0,
            box_visible=lambda t: t < 10,
            overlap=lambda t: np.where((t >= 2) & (t < 5), 0.0, 0.8),
            in_view=lambda t: (t < 4) | (t >= 5),
        )
    )
    assert (figures["wrong_boxes"], figures["boxes_while_hidden"]) == (90, 30)


def test_a_loss_counts_from_the_target_lost_to_the_target_tracked_again():
    def tracked(t):
        # Lost for 0.2 s, too short; for 4 s, of which a wrong box is shown for the first half.
        return ~((t >= 1) & (t < 1.2)) & ~((t >= 5) & (t < 9))

    figures = figures_of(
        flight(
            lambda t: 1.0,
            box_visible=lambda t: tracked(t) | ((t >= 5) & (t < 7)),
            overlap=lambda t: np.where(tracked(t), 0.8, 0.0),
        )
    )
    assert (figures["losses"], figures["recoveries"]) == (1, 1)
    assert figures["recovery_s"] == pytest.approx(4.0)
    assert figures["recovered_10s"] is True


@pytest.mark.parametrize(
    ("lost", "recovered"), [(lambda t: t >= 17, False), (lambda t: (t >= 1) & (t < 11.5), False)]
)
def test_not_recovered_within_ten_seconds_or_until_the_end(lost, recovered):
    figures = figures_of(flight(lambda t: 1.0, box_visible=lambda t: ~lost(t)))
    assert figures["recovered_10s"] is recovered


def test_what_makes_no_sense_is_none():
    figures = figures_of(flight(lambda t: 1.0), wanted=("rmse_m",))
    assert figures["rmse_m"] == 0.0
    assert {figures[name] for name in FOLLOWING if name != "rmse_m"} == {None}
    assert figures["recovered_10s"] is None


def test_the_summary_has_the_worst_the_mean_and_the_shares():
    good = figures_of(flight(lambda t: 1.0))
    bad = figures_of(flight(lambda t: 1.2, box_visible=lambda t: t < 5))
    runs = [
        {"seed": 0, **good, "trace": {}},
        {"seed": 1, "error": "it died"},
        {"seed": 2, **bad, "trace": {}},
    ]
    total = summary(runs)
    assert (total["runs"], total["failed"]) == (3, 1)
    assert (total["collision_free"], total["recovered_10s"]) == (0.0, 0.5)
    assert total["worst"]["rmse_m"] == pytest.approx(0.2)
    assert total["mean"]["rmse_m"] == pytest.approx(0.1)
    assert total["worst"]["tracked_fraction"] == bad["tracked_fraction"]
    assert total["worst"]["settle_s"] is None  # one never settled
    assert summary(runs[1:2])["worst"] == {}


def test_identical_traces_do_not_differ():
    assert first_difference(flight(lambda t: t), flight(lambda t: t)) is None


def test_the_first_difference_of_two_traces_is_named():
    first, second = flight(lambda t: 1.0), flight(lambda t: 1.0 if t < 3 else 1.0 + 1e-15)
    second["overlap"][-1] = 0.0
    assert first_difference(first, second) == "t = 3.000 s, in distance"


def test_a_trace_that_ends_earlier_differs():
    first = flight(lambda t: 1.0)
    second = {name: values[:-1] for name, values in first.items()}
    assert first_difference(first, second) == "the end: 600 and 599 frames"
