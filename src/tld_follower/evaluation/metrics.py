"""The figures of a flight, from its trace."""

import numpy as np

from tld_follower.evaluation.scoring import recoveries

SET_DISTANCE = 1.0  # m
TRACKED_OVERLAP = 0.25
SETTLED = 0.05  # m
FOLLOWING = ("peak_gap_m", "steady_error_m", "rmse_m", "overshoot_m", "settle_s")


def _between(t, first, last):
    return (t >= first) & (t < last)


def _episodes(visible):
    """Find where runs of False begin after a True, and where each ends again (None: never)."""
    lost = [i for i in range(1, len(visible)) if visible[i - 1] and not visible[i]]
    return [(i, next((j for j in range(i, len(visible)) if visible[j]), None)) for i in lost]


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


def flight_figures(trace, drive_s):
    """Compute the figures of one flight.

    Parameters
    ----------
    trace : dict of lists, one entry a frame from the boxing of the target on
        t (s, 0 when the target starts to drive), distance (m), clearance (m), collisions (count so far),
        in_view (target has visible pixels), box_visible, overlap (of found and true box, 0 without a box).
    drive_s : float or None
        How long the target drives while the drone follows it, seconds; None if a script flies the drone.

    Returns
    -------
    dict
        None of each of the first five if a script flies the drone.
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
        losses, recoveries: of the box; recovery_s: longest time without a box that ended, None without one.
    """
    t = np.asarray(trace["t"])
    in_view, box_visible = np.asarray(trace["in_view"]), np.asarray(trace["box_visible"])
    overlaps = np.asarray(trace["overlap"])
    overlap = overlaps[in_view]
    losses = _episodes(box_visible)
    times = [float(t[end] - t[begin]) for begin, end in losses if end is not None]
    return {
        **(
            dict.fromkeys(FOLLOWING)
            if drive_s is None
            else _following(t, np.asarray(trace["distance"]), drive_s)
        ),
        "min_clearance_m": float(min(trace["clearance"])),
        "collisions": int(trace["collisions"][-1]),
        "visible_fraction": float(in_view.mean()),
        "tracked_fraction": float((overlap > TRACKED_OVERLAP).mean()) if overlap.size else 0.0,
        "mean_overlap": float(overlap.mean()) if overlap.size else 0.0,
        "wrong_boxes": int((box_visible & (overlaps <= TRACKED_OVERLAP)).sum()),
        "boxes_while_hidden": int((box_visible & ~in_view).sum()),
        **recoveries(in_view, overlaps),
        "losses": len(losses),
        "recoveries": len(times),
        "recovery_s": max(times, default=None),
    }
