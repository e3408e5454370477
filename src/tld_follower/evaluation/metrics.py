"""The figures of a flight, from its trace."""

import numpy as np

from tld_follower.evaluation.scoring import recoveries

SET_DISTANCE = 1.0  # m
TRACKED_OVERLAP = 0.25
SETTLED = 0.05  # m
LOST_S = 0.3  # s without the target from which on it counts as lost; the follower trusts nothing older
RECOVERED_S = 10.0
FOLLOWING = ("peak_gap_m", "steady_error_m", "rmse_m", "overshoot_m", "settle_s")
# Figures of which less is worse; of the others more is.
_MORE_IS_BETTER = frozenset(
    {
        *("min_clearance_m", "visible_fraction", "tracked_fraction", "mean_overlap", "real_time_factor"),
        *("reentries", "reentries_found", "recoveries"),
    }
)


def _between(t, first, last):
    return (t >= first) & (t < last)


def _losses(t, tracked):
    """Return how long the target was lost each time, in s, and whether it still is at the end."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], tracked, [True]])))
    begins, ends = edges[::2], edges[1::2]
    # A frame lasts until the next one; the last one as long as the one before it.
    until = np.append(t, 2 * t[-1] - t[-2])
    times = until[ends] - until[begins]
    long = times >= LOST_S - 1e-6
    return times[long], bool(long.size and long[-1] and ends[-1] == len(t))


def _following(t, distance, drive_s):
    error = distance - SET_DISTANCE
    after = t >= drive_s
    off = np.flatnonzero(after & (np.abs(error) > SETTLED))
    if not off.size:
        settle = 0.0
    elif off[-1] + 1 < len(t):
        settle = float(t[off[-1] + 1] - drive_s)
    else:
        settle = None
    values = (
        float(error[_between(t, 0, drive_s)].max()),
        float(np.abs(error[_between(t, drive_s - 7, drive_s)]).mean()),
        float(np.sqrt((error[_between(t, 1, drive_s + 3)] ** 2).mean())),
        float(max(0.0, -error[after].min())),
        settle,
    )
    return dict(zip(FOLLOWING, values, strict=True))


def first_difference(first, second):
    """Find where two traces of the same seed part.

    Parameters
    ----------
    first, second : dict of lists, one entry a frame

    Returns
    -------
    str or None
        The time of the first frame that differs, and in what; None if the traces are identical.
    """
    lengths = [len(trace["t"]) for trace in (first, second)]
    for index in range(min(lengths)):
        names = [name for name in first if first[name][index] != second[name][index]]
        if names:
            return f"t = {first['t'][index]:.3f} s, in {', '.join(names)}"
    return None if lengths[0] == lengths[1] else f"the end: {lengths[0]} and {lengths[1]} frames"


def flight_figures(trace, drive_s, wanted):
    """Compute the figures of one flight.

    Parameters
    ----------
    trace : dict of lists, one entry a frame from the boxing of the target on
        t (s, 0 when the target starts to drive), distance (m), clearance (m), collisions (count so far),
        in_view (target has visible pixels), box_visible, overlap (of found and true box, 0 without a box).
    drive_s : float
        How long the target drives, seconds.
    wanted : collection of str
        Which of the figures of following, and whether recovered_10s, make sense; the others are None.

    Returns
    -------
    dict
        peak_gap_m: largest distance over the set distance, from the start to the halt;
        steady_error_m: mean |distance - set| over the last 7 s of the drive;
        rmse_m: root mean square of distance - set from 1 s after the start to 3 s after the halt;
        overshoot_m: how far the distance falls below the set one after the halt;
        settle_s: from the halt until within 5 cm for good, None if never;
        visible_fraction: frames with the target in view; tracked_fraction: of those, frames with a box that
        overlaps the true one by more than 0.25; mean_overlap: over those, 0 without a box;
        wrong_boxes: frames with a box that does not overlap the true one so; boxes_while_hidden: those
        of them in which no pixel of the target is in view;
        reentries, reentries_found, failures: see `scoring.recoveries`;
        losses: how often the target was lost, that is not tracked for 0.3 s and more; recoveries: how often
        it was tracked again; recovery_s: the longest such time, from the loss on, None without one;
        recovered_10s: whether no loss lasted longer than 10 s or until the end of the flight.
    """
    t = np.asarray(trace["t"])
    in_view, box_visible = np.asarray(trace["in_view"]), np.asarray(trace["box_visible"])
    overlaps = np.asarray(trace["overlap"])
    overlap = overlaps[in_view]
    following = dict.fromkeys(FOLLOWING)
    if not following.keys().isdisjoint(wanted):
        measured = _following(t, np.asarray(trace["distance"]), drive_s)
        following |= {name: value for name, value in measured.items() if name in wanted}
    times, lost = _losses(t, in_view & (overlaps > TRACKED_OVERLAP))
    recovered = times[:-1] if lost else times
    return {
        **following,
        "min_clearance_m": float(min(trace["clearance"])),
        "collisions": int(trace["collisions"][-1]),
        "visible_fraction": float(in_view.mean()),
        "tracked_fraction": float((overlap > TRACKED_OVERLAP).mean()) if overlap.size else 0.0,
        "mean_overlap": float(overlap.mean()) if overlap.size else 0.0,
        "wrong_boxes": int((box_visible & (overlaps <= TRACKED_OVERLAP)).sum()),
        "boxes_while_hidden": int((box_visible & ~in_view).sum()),
        **recoveries(in_view, overlaps),
        "losses": len(times),
        "recoveries": len(recovered),
        "recovery_s": float(recovered.max()) if recovered.size else None,
        "recovered_10s": (
            bool(not lost and (times <= RECOVERED_S + 1e-6).all()) if "recovered_10s" in wanted else None
        ),
    }


def summary(runs):
    """Sum up the runs of several seeds.

    Parameters
    ----------
    runs : list of dict
        As `flight_figures` has them; those with an "error" have none.

    Returns
    -------
    dict
        runs, failed: how many there are, and of those how many have an error;
        collision_free, recovered_10s: share of the others, the latter None where it makes no sense;
        worst, mean: figure -> value. None where no run has the figure; settle_s also where one never settled.
    """
    flown = [run for run in runs if "error" not in run]
    worst, mean = {}, {}
    for name in flown[0] if flown else ():
        if name in ("seed", "trace", "recovered_10s"):
            continue
        values = [run[name] for run in flown if run[name] is not None]
        if not values or (name == "settle_s" and len(values) < len(flown)):
            worst[name] = mean[name] = None
        else:
            worst[name] = min(values) if name in _MORE_IS_BETTER else max(values)
            mean[name] = float(np.mean(values))
    recovered = [run["recovered_10s"] for run in flown if run["recovered_10s"] is not None]
    return {
        "runs": len(runs),
        "failed": len(runs) - len(flown),
        "collision_free": float(np.mean([run["collisions"] == 0 for run in flown])) if flown else None,
        "recovered_10s": float(np.mean(recovered)) if recovered else None,
        "worst": worst,
        "mean": mean,
    }
