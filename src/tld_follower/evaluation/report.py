# SPDX-License-Identifier: BSD-3-Clause
"""Tables and pictures of an evaluation."""

from __future__ import annotations

HEADER = ("sequence", "tracker", "P25", "R25", "F25", "F50", "absent", "boxes", "re-entries", "ms", "p95", "model")


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
        cells = [c.ljust(w) if i < 2 else c.rjust(w) for i, (c, w) in enumerate(zip(row, widths, strict=True))]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)
