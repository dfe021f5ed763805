"""Figures as files, and as SVG in a page, where axes and text have the colour of the page's text."""

from __future__ import annotations

import io
import re
from functools import lru_cache
from html import escape
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

from armtempo.basics.text import visible

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE_COLOUR = "#010203"
"""Placeholder for the page's text colour; ``inline_svg`` replaces it."""
_HIDDEN = '<svg class="sheet" aria-hidden="true" '
_LARGEST = 1.4
"""Largest magnification of a figure on a page."""
_MARGIN_PT = 10.0
"""Space to the right of the axes, for the half of a label."""
_SETTINGS = Lock()
"""Matplotlib's settings are those of all threads."""
_QUICK = 3
"""zlib's level: a third of the time of the default 6, files 10 % larger."""


def save(figure: Figure, path: Path) -> None:
    """Write the figure in the format of the suffix: PNG on white, SVG without a background."""
    _lay_out(figure)
    if path.suffix == ".svg":
        path.write_text(_svg(figure).replace(PAGE_COLOUR, "#222222"), encoding="utf-8")
    else:
        figure.savefig(path, dpi=150, facecolor="white", pil_kwargs={"compress_level": _QUICK})


def inline_svg(figure: Figure, name: str, description: str) -> str:
    """The figure as ``<svg>`` elements in the page's colour, with a description for screen readers.

    A figure of several columns becomes several elements, so that a page can put them side by side or below each
    other: the first, hidden one has the drawing, each other one shows one column of it.
    """
    text = _svg(figure)
    text = text[text.index("<svg") :].replace(PAGE_COLOUR, "currentColor")
    text = re.sub(r'(width|height)="[\d.]+pt" ', "", text, count=2)
    text = re.sub(r'(\bid=")', rf"\g<1>{name}-", text)
    text = re.sub(r'(xlink:href="#|url\(#)', rf"\g<1>{name}-", text)
    columns = _columns(figure)
    height = 72 * float(figure.get_figheight())
    if len(columns) == 1:
        shown = _shown(description, 72 * float(figure.get_figwidth()))
        return text.replace("<svg ", f"<svg {shown} ", 1)
    parts = [
        f"<svg {_shown(f'{title}: {description}', right - left)} "
        f'viewBox="{left:.1f} 0 {right - left:.1f} {height:.1f}"><use href="#{name}-figure_1"/></svg>'
        for title, left, right in columns
    ]
    return f'<div class="slices">{text.replace("<svg ", _HIDDEN, 1)}{"".join(parts)}</div>'


def _shown(description: str, width_pt: float) -> str:
    """Attributes of a visible element, magnified at most _LARGEST times."""
    most = f"{_LARGEST * width_pt * 4 / 3:.0f}px"
    return f'role="img" aria-label="{escape(visible(description))}" style="max-width: {most}"'


def _columns(figure: Figure) -> list[tuple[str, float, float]]:
    """Title, left and right end in points of each column of axes, with the labels on its left."""
    _lay_out(figure)
    width = 72 * float(figure.get_figwidth())
    found: dict[int, tuple[str, float]] = {}
    for axis in figure.axes:
        if (place := axis.get_subplotspec()) is not None:
            title, right = found.get(place.colspan.start, ("", 0.0))
            right = max(right, width * axis.get_position().x1 + _MARGIN_PT)
            found[place.colspan.start] = (title or axis.get_title(), right)
    titles, rights = zip(*(found[column] for column in sorted(found)), strict=True)
    return [*zip(titles, (0.0, *rights[:-1]), (*rights[:-1], width), strict=True)]


def _lay_out(figure: Figure) -> None:
    """Compute the layout once; with its layout engine each file would be drawn twice.

    Names of joints and runs become plain text before: without formulas (``$``), control characters escaped.
    """
    from matplotlib.text import Text

    engine = figure.get_layout_engine()
    if engine is not None:
        for text in figure.findobj(Text):
            text.set_parse_math(False)
            text.set_text(visible(text.get_text()))
        engine.execute(figure)
        figure.set_layout_engine(None)


@lru_cache(maxsize=8)
def _svg(figure: Figure) -> str:
    from matplotlib import rc_context

    _lay_out(figure)
    buffer = io.StringIO()
    with _SETTINGS, rc_context({"svg.fonttype": "none", "svg.hashsalt": "armtempo"}):
        figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None})
    return re.sub(r' d="[^"]*"', _rounded, buffer.getvalue())


def _rounded(path: re.Match[str]) -> str:
    """Round coordinates to 0.01 points: half the size, no visible difference."""
    return re.sub(r"(\.\d\d)\d+", r"\1", path.group())
