# SPDX-License-Identifier: BSD-3-Clause
"""Tables, plots and the page of an experiment."""

import numpy as np

from tld_follower.evaluation import plots
from tld_follower.evaluation.page import Page
from tld_follower.evaluation.scenarios import SCENARIOS

_COLUMNS = (
    ("peak_gap_m", "peak gap", "{:.3f} m"),
    ("steady_error_m", "steady error", "{:.3f} m"),
    ("rmse_m", "rmse", "{:.3f} m"),
    ("overshoot_m", "overshoot", "{:.3f} m"),
    ("settle_s", "settled", "{:.2f} s"),
    ("min_clearance_m", "clearance", "{:.2f} m"),
    ("collisions", "collisions", "{:.4g}"),
    ("visible_fraction", "in view", "{:.3f}"),
    ("tracked_fraction", "tracked", "{:.3f}"),
    ("mean_overlap", "overlap", "{:.2f}"),
    ("wrong_boxes", "wrong boxes", "{:.4g}"),
    ("boxes_while_hidden", "while hidden", "{:.4g}"),
    ("reentries", "re-entries", "{:.4g}"),
    ("reentries_found", "found", "{:.4g}"),
    ("failures", "failures", "{:.4g}"),
    ("losses", "losses", "{:.4g}"),
    ("recoveries", "recovered", "{:.4g}"),
    ("recovery_s", "longest", "{:.1f} s"),
    ("real_time_factor", "real time", "{:.2f}x"),
)
_SETTINGS = (
    *("scenario", "control", "distance", "max_speed", "tracker", "use_depth", "use_right_camera"),
    *("resolution", "world", "image_noise"),
)

# What the plots of distance, velocity and path are called: by the thesis' figures where it has them.
_NUMBERS = {"box": ("4.3", "velocity", "path"), "stereo": ("4.5", "4.6", "path")}


def rows(result):
    """Return the cells of a result's table: a header, a row a run, and the worst and mean of several."""
    runs, total = result["runs"], result["summary"]
    columns = [column for column in _COLUMNS if any(run.get(column[0]) is not None for run in runs)]
    table = [["seed", *(title for _, title, _ in columns)]]
    lines = [(str(run["seed"]), run) for run in runs if "error" not in run]
    if len(lines) > 1:
        lines += [("worst", total["worst"]), ("mean", total["mean"])]
    for name, values in lines:
        cells = ("-" if values[key] is None else form.format(values[key]) for key, _, form in columns)
        table.append([name, *cells])
    return table


def remarks(result):
    """Return what the table does not say, a list of sentences: what failed, and the shares of the runs."""
    total = result["summary"]
    said = [f"seed {run['seed']} failed: {run['error']}" for run in result["runs"] if "error" in run]
    for key, text in (("collision_free", "without a collision"), ("recovered_10s", "recovered within 10 s")):
        if total[key] is not None and total["runs"] > 1:
            said.append(f"{text}: {100 * total[key]:.0f} % of the runs")
    return said


def text_table(result):
    """Lay out a result's figures as text."""
    table = rows(result)
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = ("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in table)
    return "\n".join([*lines, *remarks(result)])


def _steady(run, drive_s):
    trace = run["trace"]
    t = np.array(trace["t"])
    return trace, (t >= drive_s - 7) & (t < drive_s)


def _sharpest(run, drive_s):
    """Return by how much the distance changes within 1 s at most, over the last 7 s of the drive, in m."""
    trace, steady = _steady(run, drive_s)
    distance = np.array(trace["distance"])[steady]
    windows = np.lib.stride_tricks.sliding_window_view(distance, 30)
    return float(np.ptp(windows, axis=1).max())


def _speed(run, drive_s):
    """Return the mean forward speed of drone and target over the last 7 s of the drive, in m/s."""
    trace, steady = _steady(run, drive_s)
    return [float(speed[steady].mean()) for speed in plots.forward_velocities(trace)]


def claims(result):
    """Compare a result of `straight` with what the thesis says of it; rows of figure, claim, measured."""
    flown = [run for run in result["runs"] if "error" not in run]
    drive_s = SCENARIOS["straight"](0).drive_s
    mean = result["summary"]["mean"]

    def measured(text, values):
        return f"{text.format(np.mean(values))} (mean of {len(values)})"

    if result["distance"] == "box":
        return [
            [
                "4.3",
                "settles about 0.5 m off the set distance",
                f"steady error {mean['steady_error_m']:.2f} m",
            ],
            [
                "4.3",
                "sharp variations in the steady part, as the box changes its size",
                measured("up to {:.2f} m within 1 s", [_sharpest(run, drive_s) for run in flown]),
            ],
        ]
    speeds = np.array([_speed(run, drive_s) for run in flown])
    return [
        [
            "4.5",
            "the gap at the start is quickly offset",
            f"peak gap {mean['peak_gap_m']:.2f} m, "
            f"{mean['steady_error_m']:.2f} m over the last 7 s of the drive",
        ],
        ["4.5", "overshoot below 5 cm after the halt", f"{100 * mean['overshoot_m']:.1f} cm"],
        [
            "4.5",
            "no sharp variations any more",
            measured("up to {:.2f} m within 1 s", [_sharpest(run, drive_s) for run in flown]),
        ],
        [
            "4.6",
            "takes on the same speed as Husky, 1 m/s",
            f"{speeds[:, 0].mean():.2f} m/s, Husky {speeds[:, 1].mean():.2f} m/s",
        ],
    ]


def _draw(result, directory):
    """Draw a result; returns a dict of files and captions, by the figure of the thesis or by name."""
    scenario, distance = result["scenario"], result["distance"]
    flown = [run for run in result["runs"] if "error" not in run]
    plan = SCENARIOS[scenario](flown[0]["seed"])
    title = (
        f"{scenario}: {result['control']} control, distance from {distance}, "
        f"at most {result['max_speed']} m/s"
    )
    names = ("distance", "velocity", "path")
    files = [directory / f"{name}_{distance}.png" for name in names]
    plots.plot_distance(flown, plan.drive_s, title, files[0])
    plots.plot_velocity(flown[0], plan.drive_s, title, files[1])
    plots.plot_path(flown[0], plan, title, files[2])
    captions = ("Distance to the target", "Velocities along the drone's heading", "From above")
    numbers = _NUMBERS[distance] if scenario == "straight" else names
    return dict(zip(numbers, zip(files, captions, strict=True), strict=True))


def write(results, directory, videos):
    """Write the page report.html and its plots.

    Parameters
    ----------
    results : list of dict
        One for each way to measure the distance, as in the JSON file; with at least one flight each.
    directory : Path
    videos : dict
        Way to measure the distance -> name of a video in `directory`.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    scenario = results[0]["scenario"]
    page = Page(f"Experiment {scenario}")
    page.text(SCENARIOS[scenario].__doc__.splitlines()[0])
    drawn = [_draw(result, directory) for result in results]
    if scenario == "straight":
        page.heading("What the thesis says, and what was measured")
        said = [
            [f"{figure}, {result['distance']}", *rest]
            for result in results
            for figure, *rest in claims(result)
        ]
        page.table([["figure, distance", "thesis, sections 4.2 and 4.3", "measured"], *said])
        numbered = [
            (path, f"{caption} (thesis figure {number})")
            for figures in drawn
            for number, (path, caption) in figures.items()
            if number[0] == "4"
        ]
        page.figures(numbered)
        drawn = [{name: shown for name, shown in figures.items() if name[0] != "4"} for figures in drawn]
    for result, figures in zip(results, drawn, strict=True):
        distance = result["distance"]
        page.heading(f"Distance from {distance}")
        page.figures(figures.values())
        page.table(rows(result))
        page.notes(remarks(result))
        if distance in videos:
            page.video(videos[distance], "Left camera, the first flight: found box green, true box white")
    page.heading("Settings")
    page.table(
        [
            ["setting", *("" for _ in results)],
            *([name, *(str(result[name]) for result in results)] for name in _SETTINGS),
        ]
    )
    page.write(directory / "report.html")
