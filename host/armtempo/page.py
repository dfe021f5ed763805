"""One self-contained HTML page: headings, notes, tables and figures, for screen, phone and paper."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

_STYLE = """
:root { color-scheme: light dark; --text: #1d2127; --quiet: #5c6570; --line: #d4d9df; --back: #ffffff;
  --good: #1a7f37; --bad: #b3261e; }
@media (prefers-color-scheme: dark) {
  :root { --text: #e4e7eb; --quiet: #9aa4b0; --line: #3a424c; --back: #14181d; --good: #56d364; --bad: #ff8a80; }
}
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem 1rem 4rem; max-width: 72rem; background: var(--back); color: var(--text);
  font: 16px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .5rem; }
h2 { font-size: 1.25rem; margin: 2.2rem 0 .6rem; border-bottom: 1px solid var(--line); padding-bottom: .3rem; }
p.lead, figcaption, caption { color: var(--quiet); }
figure { margin: 1rem 0; }
figure svg { width: 100%; height: auto; max-height: 60rem; }
figure svg text { font-family: system-ui, Roboto, Arial, sans-serif; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: .6rem 0; font-variant-numeric: tabular-nums; }
caption { text-align: left; padding-bottom: .3rem; }
th, td { padding: .25rem .8rem .25rem 0; border-bottom: 1px solid var(--line); text-align: left; }
td.number, th.number { text-align: right; }
.good { color: var(--good); } .bad { color: var(--bad); font-weight: 600; }
pre { overflow-x: auto; padding: .7rem; border: 1px solid var(--line); border-radius: .4rem; font-size: .85rem; }
@media print {
  :root { --text: #000; --quiet: #444; --line: #bbb; --back: #fff; --good: #000; --bad: #000; }
  body { max-width: none; padding: 0; font-size: 10pt; }
  figure, table { break-inside: avoid; } h2 { break-after: avoid; }
}
"""

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
        """A table; cells that look like numbers are set flush right, a cell ``(text, kind)`` is coloured."""
        heads = "".join(f"<th{_align(column)}>{escape(name)}</th>" for name, column in _columns(header, rows))
        body = "".join("<tr>" + "".join(map(_cell, row)) + "</tr>" for row in rows)
        title = f"<caption>{escape(caption)}</caption>" if caption else ""
        self._parts.append(
            f'<div class="scroll"><table>{title}<thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table></div>'
        )

    def figure(self, svg: str, caption: str) -> None:
        """A figure given as an ``<svg>`` element."""
        self._parts.append(f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>")

    def render(self) -> str:
        """The whole document."""
        body = "\n".join(self._parts)
        return (
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{escape(self._title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
        )


def _columns(header: Sequence[str], rows: Sequence[Sequence[object]]) -> list[tuple[str, list[object]]]:
    return [(name, [row[index] for row in rows]) for index, name in enumerate(header)]


def _align(column: list[object]) -> str:
    return ' class="number"' if column and all(map(_is_number, column)) else ""


def _is_number(cell: object) -> bool:
    text = str(cell[0] if isinstance(cell, tuple) else cell).strip()
    return bool(text) and (text[0].isdigit() or (text[0] in "+-−." and text[1:2].isdigit())) or text == "–"


def _cell(cell: object) -> str:
    text, kind = cell if isinstance(cell, tuple) else (cell, "")
    classes = " ".join(part for part in (kind, "number" if _is_number(text) else "") if part)
    mark = f' class="{classes}"' if classes else ""
    return f"<td{mark}>{escape(str(text))}</td>"
