"""A self-contained HTML page of headings, notes, tables and figures, for screen, phone and print."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from armtempo.basics.text import visible

_STYLE = Path(__file__).with_name("page.css")

GOOD, BAD, OPEN = "good", "bad", "open"
"""Kinds of text: as it should be, not so, undecided."""
_MARKS = {GOOD: "✓", BAD: "✗", OPEN: "?"}
_FEW_COLUMNS = 2
"""Columns of a table that fit on a phone; each row of a wider one becomes a block there."""


class Page:
    """Collects the parts of a page in order; ``render`` returns the document."""

    def __init__(self, title: str, lead: str = "") -> None:
        self._title = title
        self._parts = [f"<h1>{escape(title)}</h1>"]
        if lead:
            self._parts.append(f'<p class="lead">{escape(lead)}</p>')

    def heading(self, text: str) -> None:
        """Begin a section."""
        self._parts.append(f"<h2>{escape(text)}</h2>")

    def verdict(self, kind: str, summary: str, findings: Sequence[tuple[str, str]]) -> None:
        """The verdict of the page, with its findings: (kind, sentence) each."""
        lines = "".join(
            f'<li class="{of}"><span class="mark">{_MARKS[of]}</span> {escape(text)}</li>'
            for of, text in findings
        )
        self._parts.append(
            f'<section class="verdict {kind}"><p><strong>{escape(summary)}</strong></p><ul>{lines}</ul></section>'
        )

    def note(self, text: str, kind: str = "") -> None:
        """A paragraph; ``kind`` GOOD, BAD or OPEN colours it."""
        mark = f' class="{kind}"' if kind else ""
        self._parts.append(f"<p{mark}>{escape(text)}</p>")

    def code(self, text: str) -> None:
        """Commands or data to copy."""
        self._parts.append(f"<pre>{escape(text)}</pre>")

    def table(
        self,
        header: Sequence[str],
        rows: Sequence[Sequence[object]],
        caption: str = "",
        explained: Mapping[str, str] | None = None,
    ) -> None:
        """A table; columns of numbers are aligned right, a cell ``(text, kind)`` is coloured.

        ``explained``: the meaning of each column by its header, printed below the table; "" for none.
        """
        numeric = [bool(rows) and all(_is_number(row[index]) for row in rows) for index in range(len(header))]
        heads = "".join(
            f"<th{_class(number)}>{escape(name)}</th>" for name, number in zip(header, numeric, strict=True)
        )
        body = "".join("<tr>" + "".join(map(_cell, row, numeric, header)) + "</tr>" for row in rows)
        title = f"<caption>{escape(caption)}</caption>" if caption else ""
        wide = "" if len(header) <= _FEW_COLUMNS else ' class="wide"'
        self._parts.append(
            f"<table{wide}>{title}<thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"
        )
        if explained:
            words = "".join(
                f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in explained.items() if text
            )
            self._parts.append(f'<dl class="columns">{words}</dl>')

    def figure(self, svg: str, caption: str) -> None:
        """A figure given as ``<svg>`` elements."""
        self._parts.append(f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>")

    def render(self) -> str:
        body = "\n".join(self._parts)
        style = _STYLE.read_text(encoding="utf-8")
        return (
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{escape(self._title)}</title>\n<style>\n{style}</style>\n</head>\n"
            f"<body>\n{body}\n</body>\n</html>\n"
        )


def escape(text: str) -> str:
    """Text for a page, with markup and invisible characters escaped."""
    return html.escape(visible(text))


def number(value: float, form: str) -> str:
    """A value in the format ``form``; a dash for NaN, no sign if it rounds to 0."""
    if math.isnan(value):
        return "–"
    text = f"{value:{form}}"
    return text.lstrip("+-") if float(text) == 0.0 else text


def _is_number(cell: object) -> bool:
    text = str(cell[0] if isinstance(cell, tuple) else cell).strip()
    return text == "–" or text[:1].isdigit() or (text[:1] in ("+", "-", "−", ".") and text[1:2].isdigit())


def _cell(cell: object, number: bool, header: str) -> str:
    text, kind = cell if isinstance(cell, tuple) else (cell, "")
    return f'<td{_class(number, kind)} data-column="{escape(header)}">{escape(str(text))}</td>'


def _class(number: bool, kind: str = "") -> str:
    names = " ".join(name for name in (kind, "number" if number else "") if name)
    return f' class="{names}"' if names else ""
