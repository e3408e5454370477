# SPDX-License-Identifier: BSD-3-Clause
"""Tables as CSV and Markdown files, and a page of tables, notes and pictures as one HTML file."""

from __future__ import annotations

import csv
import html
from base64 import b64encode
from collections.abc import Iterable, Sequence
from pathlib import Path

_STYLE = """
body { font: 15px/1.45 sans-serif; color: #222; max-width: 1440px; margin: 2em auto; padding: 0 1em }
table { border-collapse: collapse; margin: 1em 0 }
th, td { padding: .25em .7em; text-align: right; border-bottom: 1px solid #ddd }
th:first-child, td:first-child { text-align: left }
th { border-bottom: 2px solid #999; vertical-align: bottom }
img, video { max-width: 100% }
.row { display: flex; flex-wrap: wrap }
.row figure { flex: 1 1 420px; margin: .5em }
figcaption { color: #555 }
"""


def write_table(stem: Path, table: Sequence[Sequence[str]]) -> None:
    """Write a table, header first, as stem.csv and stem.md."""
    with stem.with_suffix(".csv").open("w", newline="") as file:
        csv.writer(file).writerows(table)
    lines = [" | ".join(row) for row in [table[0], ["---"] * len(table[0]), *table[1:]]]
    stem.with_suffix(".md").write_text("".join(f"| {line} |\n" for line in lines))


class Page:
    """An HTML page that needs nothing but the pictures and videos beside it."""

    def __init__(self, title: str):
        self._title = html.escape(title)
        self._parts: list[str] = [f"<h1>{self._title}</h1>"]

    def heading(self, text: str) -> None:
        """Add a heading."""
        self._parts.append(f"<h2>{html.escape(text)}</h2>")

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self._parts.append(f"<p>{html.escape(text)}</p>")

    def notes(self, notes: Iterable[str]) -> None:
        """Add a list."""
        self._parts.append("<ul>" + "".join(f"<li>{html.escape(note)}</li>" for note in notes) + "</ul>")

    def table(self, table: Sequence[Sequence[str]]) -> None:
        """Add a table, header first."""
        rows = [
            "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in row) + "</tr>"
            for tag, row in zip(["th"] + ["td"] * (len(table) - 1), table, strict=True)
        ]
        self._parts.append("<table>" + "\n".join(rows) + "</table>")

    def picture(self, name: str, caption: str) -> None:
        """Add a picture that lies beside the page."""
        name, caption = html.escape(name), html.escape(caption)
        image = f'<img src="{name}" alt="{caption}">'
        self._parts.append(f"<figure>{image}<figcaption>{caption}</figcaption></figure>")

    def figures(self, figures: Iterable[tuple[Path, str]]) -> None:
        """Add PNG files with their captions side by side; they become part of the page."""
        shown = "".join(
            f'<figure><img src="data:image/png;base64,{b64encode(path.read_bytes()).decode()}" '
            f'alt="{html.escape(caption)}"><figcaption>{html.escape(caption)}</figcaption></figure>'
            for path, caption in figures
        )
        self._parts.append(f'<div class="row">{shown}</div>')

    def video(self, name: str, caption: str) -> None:
        """Add a video that lies beside the page."""
        name, caption = html.escape(name), html.escape(caption)
        self._parts.append(
            f'<figure><video controls src="{name}"></video><figcaption>{caption}</figcaption></figure>'
        )

    def write(self, path: Path) -> None:
        """Write the page."""
        head = f'<meta charset="utf-8"><title>{self._title}</title><style>{_STYLE}</style>'
        body = "\n".join(self._parts)
        path.write_text(
            f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'
        )
