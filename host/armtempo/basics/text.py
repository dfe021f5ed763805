"""Text output: escaped control characters, columns, suggestions for misspelt words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def is_plain(text: str) -> bool:
    """Whether a name has only printable characters: no control, format or line-breaking characters."""
    return text.isprintable()


def is_number(text: str) -> bool:
    """Whether the text is a number, finite or not."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def visible(text: str) -> str:
    r"""The text with control and format characters escaped, such as ``\x1b``; line ends are kept."""
    return "".join(
        char if char.isprintable() or char == "\n" else char.encode("unicode_escape").decode("ascii")
        for char in text
    )


def aligned(rows: Sequence[Sequence[str]], widths: Sequence[int]) -> list[str]:
    """The rows as lines: the first column flush left, the others flush right, with a space between at least.

    ``widths``: least width of each column; all rows have as many cells.
    """
    first, *others = (max(map(len, column)) for column in zip(*rows, strict=True))
    fitting = [max(widths[0], first)]
    fitting += [max(width, 1 + longest) for width, longest in zip(widths[1:], others, strict=True)]
    return [row[0].ljust(fitting[0]) + "".join(map(str.rjust, row[1:], fitting[1:])) for row in rows]


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
