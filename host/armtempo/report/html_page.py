"""One self-contained HTML page: headings, notes, tables and figures, for screen, phone and paper."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from pathlib import Path

_STYLE = Path(__file__).with_name("page.css")

GOOD = "good"
BAD = "bad"


class Page:
    """Collects the parts of a page in order; ``render`` gives the whole document."""

    def __init__(self, title: str, lead: str = "") -> None:
        self._title = title
        self._parts = [f"<h1>{escape(title)}</h1>"]
        if lead:
            self._parts.append(f'<p class="lead">{escape(lead)}</p>')

    def heading(self, text: str) -> None:
        """A section begins."""
        self._parts.append(f"<h2>{escape(text)}</h2>")

    def note(self, text: str, kind: str = "") -> None:
        """A paragraph; ``kind`` GOOD or BAD colours it."""
        mark = f' class="{kind}"' if kind else ""
        self._parts.append(f"<p{mark}>{escape(text)}</p>")

    def code(self, text: str) -> None:
        """Commands or data to copy."""
        self._parts.append(f"<pre>{escape(text)}</pre>")

    def table(self, header: Sequence[str], rows: Sequence[Sequence[object]], caption: str = "") -> None:
        """A table; columns of numbers are set flush right, a cell ``(text, kind)`` is coloured."""
        numeric = [bool(rows) and all(_is_number(row[index]) for row in rows) for index in range(len(header))]
        heads = "".join(
            f"<th{_class(number)}>{escape(name)}</th>" for name, number in zip(header, numeric, strict=True)
        )
        body = "".join("<tr>" + "".join(map(_cell, row, numeric)) + "</tr>" for row in rows)
        title = f"<caption>{escape(caption)}</caption>" if caption else ""
        self._parts.append(
            f'<div class="scroll"><table>{title}<thead><tr>{heads}</tr></thead>'
            f"<tbody>{body}</tbody></table></div>"
        )

    def figure(self, svg: str, caption: str) -> None:
        """A figure given as an ``<svg>`` element."""
        self._parts.append(f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>")

    def render(self) -> str:
        """The whole document."""
        body = "\n".join(self._parts)
        style = _STYLE.read_text(encoding="utf-8")
        return (
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{escape(self._title)}</title>\n<style>\n{style}</style>\n</head>\n"
            f"<body>\n{body}\n</body>\n</html>\n"
        )


def number(value: float, form: str) -> str:
    """A value as ``form`` has it; a dash where there is none (NaN)."""
    return "–" if math.isnan(value) else f"{value:{form}}"


def _is_number(cell: object) -> bool:
    text = str(cell[0] if isinstance(cell, tuple) else cell).strip()
    return text == "–" or text[:1].isdigit() or (text[:1] in ("+", "-", "−", ".") and text[1:2].isdigit())


def _cell(cell: object, number: bool) -> str:
    text, kind = cell if isinstance(cell, tuple) else (cell, "")
    return f"<td{_class(number, kind)}>{escape(str(text))}</td>"


def _class(number: bool, kind: str = "") -> str:
    names = " ".join(name for name in (kind, "number" if number else "") if name)
    return f' class="{names}"' if names else ""
