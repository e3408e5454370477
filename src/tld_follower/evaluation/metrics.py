"""The figures of a flight, from its trace."""

import numpy as np

SET_DISTANCE = 1.0  # m
TRACKED_OVERLAP = 0.25
SETTLED = 0.05  # m


def _between(t, first, last):
    return (t >= first) & (t < last)


def _episodes(visible):
    """Find where runs of False begin after a True, and where each ends again (None: never)."""
    lost = [i for i in range(1, len(visible)) if visible[i - 1] and not visible[i]]
    return [(i, next((j for j in range(i, len(visible)) if visible[j]), None)) for i in lost]


def flight_figures(trace, drive_s):
    """Compute the figures of one flight.

    Parameters
    ----------
    trace : dict of lists, one entry a frame from the boxing of the target on
        t (s, 0 when the target starts to drive), distance (m), clearance (m), collisions (count so far),
        in_view (target has visible pixels), box_visible, overlap (of found and true box, 0 without a box).
    drive_s : float
        How long the target drives, seconds.

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
        losses, recoveries: of the box; recovery_s: longest time without a box that ended, None without one.
    """
    t = np.asarray(trace["t"])
    error = np.asarray(trace["distance"]) - SET_DISTANCE
    in_view, box_visible = np.asarray(trace["in_view"]), np.asarray(trace["box_visible"])
    overlaps = np.asarray(trace["overlap"])
    overlap = overlaps[in_view]
    after = t >= drive_s
    off = np.flatnonzero(after & (np.abs(error) > SETTLED))
    if not off.size:
        settle = 0.0
    elif off[-1] + 1 < len(t):
        settle = float(t[off[-1] + 1] - drive_s)
    else:
        settle = None
    losses = _episodes(box_visible)
    times = [float(t[end] - t[begin]) for begin, end in losses if end is not None]
    return {
        "peak_gap_m": float(error[_between(t, 0, drive_s)].max()),
        "steady_error_m": float(np.abs(error[_between(t, drive_s - 7, drive_s)]).mean()),
        "rmse_m": float(np.sqrt((error[_between(t, 1, drive_s + 3)] ** 2).mean())),
        "overshoot_m": float(max(0.0, -error[after].min())),
        "settle_s": settle,
        "min_clearance_m": float(min(trace["clearance"])),
        "collisions": int(trace["collisions"][-1]),
        "visible_fraction": float(in_view.mean()),
        "tracked_fraction": float((overlap > TRACKED_OVERLAP).mean()) if overlap.size else 0.0,
        "mean_overlap": float(overlap.mean()) if overlap.size else 0.0,
        "wrong_boxes": int((box_visible & (overlaps <= TRACKED_OVERLAP)).sum()),
        "boxes_while_hidden": int((box_visible & ~in_view).sum()),
        "losses": len(losses),
        "recoveries": len(times),
        "recovery_s": max(times, default=None),
    }
