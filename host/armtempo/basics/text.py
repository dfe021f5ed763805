"""Text output: escaped control characters, columns, wrapped lines, suggestions for misspelt words."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence


def hidden(text: str) -> str:
    """The first character that is not printable, as "U+202E"; "" if all are."""
    return next((f"U+{ord(char):04X}" for char in text if not char.isprintable()), "")


def is_number(text: str) -> bool:
    """Whether the text is a number, finite or not; "1_0", which Python reads as 10, is none."""
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text


def visible(text: str) -> str:
    r"""The text with control and format characters escaped, such as ``\x1b``; line ends are kept."""
    return "".join(
        char if char.isprintable() or char == "\n" else char.encode("unicode_escape").decode("ascii")
        for char in text
    )


def on_one_line(text: str) -> str:
    r"""The same, with line ends escaped too: for names within a sentence."""
    return visible(text).replace("\n", "\\n")


def aligned(rows: Sequence[Sequence[str]], widths: Sequence[int], most: int = 80) -> list[str]:
    """The rows as lines: the first column flush left, the others flush right, with a space between at least.

    ``widths``: width of each column, if its cells fit; all rows have as many cells. No column is wider than its cells
    need if the lines would be longer than ``most``.
    """
    first, *others = (max(map(len, column)) for column in zip(*rows, strict=True))
    needed = [first, *(1 + longest for longest in others)]
    fitting = [*map(max, widths, needed)]
    if sum(fitting) > most:
        fitting = needed
    return [row[0].ljust(fitting[0]) + "".join(map(str.rjust, row[1:], fitting[1:])) for row in rows]


def wrapped(line: str, width: int) -> list[str]:
    """The line, at most ``width`` characters long: broken at spaces, and the rest indented as its text is.

    The text begins behind spaces, a label with two spaces or a colon behind it, or an arrow. A longer word stays whole.
    """
    if len(line) <= width:
        return [line]
    found = _BEFORE_TEXT.match(line)
    before = found[0] if found else ""
    return textwrap.wrap(
        line[len(before) :],
        width,
        initial_indent=before,
        subsequent_indent=" " * (len(before) or _INDENT),
        break_long_words=False,
        break_on_hyphens=False,
    )


_BEFORE_TEXT = re.compile(r" *(?:[\w-]{1,16}:? {2,}|[\w-]{1,10}: |-> )?")
_INDENT = 2


_LIKELY, _SURE = 0.6, 0.8
"""Least similarity (of ``difflib``) for a suggestion, and for a statement."""


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """A question with the most similar known word, to append to an error; "" if none is similar."""
    near = _nearest(word, known, _LIKELY)
    return f"; did you mean {near!r}?" if near else ""


def misspelt(word: str, found: Iterable[str]) -> str:
    """The word in ``found`` that is most probably a misspelt ``word``; "" if none is."""
    words = list(found)
    exchanged = [other for other in words if sorted(other) == sorted(word)]
    return exchanged[0] if exchanged else _nearest(word, words, _SURE)


def _nearest(word: str, known: Iterable[str], least: float) -> str:
    import difflib  # imported here: it takes a while, and most words are known

    found = difflib.get_close_matches(word, list(known), 1, least)
    return found[0] if found else ""
