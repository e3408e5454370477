# SPDX-License-Identifier: BSD-3-Clause
"""Tables and pictures of an evaluation."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from tld_follower.box import Box
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


def write(directory: Path, runs: list[Run], results: list[dict]) -> None:
    """Write scores.csv, scores.md, success.png and one contact sheet a run into a directory.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    directory.mkdir(parents=True, exist_ok=True)
    table = rows(results)
    with (directory / "scores.csv").open("w", newline="") as file:
        csv.writer(file).writerows([HEADER, *table])
    lines = [" | ".join(row) for row in [HEADER, ["---"] * len(HEADER), *table]]
    (directory / "scores.md").write_text("".join(f"| {line} |\n" for line in lines))
    _write_success_plot(directory / "success.png", runs)
    for run in runs:
        path = directory / f"{run.sequence.name}_{run.tracker}.png"
        if not cv2.imwrite(str(path), contact_sheet(run)):
            raise OSError(f"{path}: cannot be written")


def success(run: Run) -> np.ndarray:
    """Share of the frames with the target in view where the overlap exceeds each of `SUCCESS_OVERLAPS`."""
    pairs = [(t, b) for t, b in zip(run.sequence.truth, run.boxes, strict=True) if t is not None]
    overlaps = np.array([frame_overlap(true_box, box) for true_box, box in pairs])
    return (overlaps[:, None] > SUCCESS_OVERLAPS).mean(axis=0)


def _write_success_plot(path: Path, runs: list[Run]) -> None:
    figure, axes = plt.subplots(figsize=(7.0, 5.0))
    for run in runs:
        axes.plot(SUCCESS_OVERLAPS, success(run), label=f"{run.sequence.name}, {run.tracker}")
    axes.set(
        xlabel="overlap threshold", ylabel="share of frames with the target", xlim=(0, 1), ylim=(0, 1.02)
    )
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7)
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
