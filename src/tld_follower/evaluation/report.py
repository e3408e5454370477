# SPDX-License-Identifier: BSD-3-Clause
"""Tables and pictures of an evaluation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from tld_follower.box import Box
from tld_follower.evaluation import thesis
from tld_follower.evaluation.page import Page, write_table
from tld_follower.evaluation.scoring import frame_overlap

if TYPE_CHECKING:
    from tld_follower.evaluation.evaluate import Run

HEADER = (
    *("sequence", "tracker", "P25", "R25", "F25", "F50", "absent", "boxes", "re-entries"),
    *("ms", "p95", "model"),
)
SHEET_COLUMNS, SHEET_ROWS = 6, 4
TILE_WIDTH = 240
TRUE_COLOR, FOUND_COLOR = (0, 255, 0), (0, 0, 255)
LINE_STYLES = {"tld": "--", "tld_sift": "-"}
SUCCESS_OVERLAPS = np.linspace(0.0, 1.0, 51)


def rows(results: list[dict]) -> list[list[str]]:
    """Return the cells of the score table, a row a result, and one of means for each tracker."""
    table = []
    for r in results:
        low, high = r["overlap"]["0.25"], r["overlap"]["0.5"]
        table.append(
            [
                r["sequence"],
                r["tracker"],
                *(f"{v:.3f}" for v in (low["precision"], low["recall"], low["f"], high["f"])),
                str(r["absent"]),
                str(r["boxes_while_absent"]),
                f"{r['reentries_found']}/{r['reentries']}",
                f"{r['cpu_ms_mean']:.1f}",
                f"{r['cpu_ms_p95']:.1f}",
                str(r["templates"]),
            ]
        )
    for tracker in dict.fromkeys(r["tracker"] for r in results):
        own = [r for r in results if r["tracker"] == tracker]
        low = [r["overlap"]["0.25"] for r in own]
        means = [sum(v[key] for v in low) / len(own) for key in ("precision", "recall", "f")]
        means.append(sum(r["overlap"]["0.5"]["f"] for r in own) / len(own))
        table.append(
            [
                "mean",
                tracker,
                *(f"{v:.3f}" for v in means),
                str(sum(r["absent"] for r in own)),
                str(sum(r["boxes_while_absent"] for r in own)),
                f"{sum(r['reentries_found'] for r in own)}/{sum(r['reentries'] for r in own)}",
                f"{sum(r['cpu_ms_mean'] for r in own) / len(own):.1f}",
                f"{max(r['cpu_ms_p95'] for r in own):.1f}",
                str(max(r["templates"] for r in own)),
            ]
        )
    return table


def text_table(results: list[dict]) -> str:
    """Return the score table as aligned text."""
    table = [list(HEADER), *rows(results)]
    widths = [max(len(row[i]) for row in table) for i in range(len(HEADER))]
    lines = []
    for row in table:
        aligned = [cell.ljust if i < 2 else cell.rjust for i, cell in enumerate(row)]
        lines.append("  ".join(pad(w) for pad, w in zip(aligned, widths, strict=True)).rstrip())
    return "\n".join(lines)


def write(
    directory: Path, runs: list[Run], results: list[dict], films: Sequence[Run] = (), missing: str = ""
) -> None:
    """Write the page report.html with all that it shows beside it.

    These are the tables scores, table_4_1 and table_4_2 (CSV and Markdown), success.png, failures.png if
    there is a film of fastboard, and a contact sheet a run (of the films: of the first one).

    Parameters
    ----------
    runs, results : what was asked for, and its scores.
    films : runs on films of fastboard that were made for this report.
    missing : why there are no such films, if they should be there.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    directory.mkdir(parents=True, exist_ok=True)
    page = Page("Evaluation of the tracker")
    scores = [list(HEADER), *rows(results)]
    write_table(directory / "scores", scores)
    page.heading("Scores")
    page.table(scores)
    page.text(
        "P25, R25, F25, F50: precision, recall, F at an overlap above 0.25, 0.5; boxes: in absent frames."
    )
    _write_thesis(directory, page, [*results, *(film.scores() for film in films)], missing)
    page.heading("Overlap")
    _write_success_plot(directory / "success.png", runs)
    page.picture(
        "success.png", "Share of the frames with the target in view whose overlap exceeds the threshold"
    )
    page.heading("What was seen")
    first_film = [film for film in films if film.sequence.name == films[0].sequence.name]
    for run in [*runs, *first_film]:
        name = f"{run.sequence.name}_{run.tracker}.png"
        if not cv2.imwrite(str(directory / name), contact_sheet(run)):
            raise OSError(f"{directory / name}: cannot be written")
        page.picture(name, f"{run.sequence.name}, {run.tracker}: true boxes green, found ones red")
    page.write(directory / "report.html")


def _write_thesis(directory: Path, page: Page, results: list[dict], missing: str) -> None:
    """Write the thesis' tables and figure of results that belong to its sequences."""
    for name, title, table in (
        ("table_4_1", "Thesis table 4.1: true positives", thesis.table_counts(results)),
        ("table_4_2", "Thesis table 4.2: precision, recall and F [%]", thesis.table_scores(results)),
    ):
        write_table(directory / name, table)
        page.heading(title)
        page.table(table)
    page.notes(thesis.NOTES)
    page.heading("Thesis figure 4.8: failures on fastboard")
    if any(thesis.is_fastboard(result["sequence"]) for result in results):
        thesis.plot_failures(results, directory / "failures.png")
        page.picture("failures.png", "Mean of the films; each dot is one film")
        page.text(
            "The thesis prints no numbers with its figure 4.8; its tables have what it found on fastboard."
        )
    else:
        page.text(missing or "Not measured: it needs both trackers and films of fastboard.")


def success(run: Run) -> np.ndarray:
    """Share of the frames with the target in view where the overlap exceeds each of `SUCCESS_OVERLAPS`."""
    pairs = [(t, b) for t, b in zip(run.sequence.truth, run.boxes, strict=True) if t is not None]
    overlaps = np.array([frame_overlap(true_box, box) for true_box, box in pairs])
    return (overlaps[:, None] > SUCCESS_OVERLAPS).mean(axis=0)


def _write_success_plot(path: Path, runs: list[Run]) -> None:
    """Plot a colour a sequence, a line style a tracker."""
    names = list(dict.fromkeys(run.sequence.name for run in runs))
    colours = dict(zip(names, plt.get_cmap("turbo")(np.linspace(0.05, 0.95, len(names))), strict=True))
    figure, axes = plt.subplots(figsize=(9.0, 5.0))
    for run in runs:
        axes.plot(
            SUCCESS_OVERLAPS,
            success(run),
            color=colours[run.sequence.name],
            linestyle=LINE_STYLES[run.tracker],
            label=f"{run.sequence.name}, {run.tracker}",
        )
    axes.set(
        xlabel="overlap threshold", ylabel="share of frames with the target", xlim=(0, 1), ylim=(0, 1.02)
    )
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False)
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)


def contact_sheet(run: Run) -> np.ndarray:
    """Draw 24 frames spread over a run, true boxes green, found boxes red, BGR."""
    count = SHEET_COLUMNS * SHEET_ROWS
    chosen = np.linspace(0, len(run.boxes) - 1, count).astype(int).tolist()
    wanted = set(chosen)
    tiles = {}
    for index, image in enumerate(run.sequence.frames()):
        if index in wanted:
            tiles[index] = _tile(image, run.sequence.truth[index], run.boxes[index], index + 1)
    rows_of_tiles = [
        np.hstack([tiles[i] for i in chosen[start : start + SHEET_COLUMNS]])
        for start in range(0, count, SHEET_COLUMNS)
    ]
    return np.vstack(rows_of_tiles)


def _tile(image: np.ndarray, truth: Box | None, found: Box | None, number: int) -> np.ndarray:
    scale = TILE_WIDTH / image.shape[1]
    tile = cv2.resize(image, (TILE_WIDTH, round(scale * image.shape[0])), interpolation=cv2.INTER_AREA)
    for box, color in ((truth, TRUE_COLOR), (found, FOUND_COLOR)):
        if box is not None:
            corners = [round(scale * v) for v in (box.x, box.y, box.right, box.bottom)]
            cv2.rectangle(tile, corners[:2], corners[2:], color, 1)
    cv2.putText(tile, str(number), (4, 14), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 255, 255), 1, cv2.LINE_AA)
    return tile
