"""Tables in plain text: columns as wide as their content needs."""

from __future__ import annotations

from collections.abc import Sequence


def aligned(rows: Sequence[Sequence[str]], widths: Sequence[int]) -> list[str]:
    """The rows as lines: the first column flush left, the others flush right, with a space between at least.

    ``widths``: least width of each column; all rows have as many cells.
    """
    first, *others = (max(map(len, column)) for column in zip(*rows, strict=True))
    fitting = [max(widths[0], first)]
    fitting += [max(width, 1 + longest) for width, longest in zip(widths[1:], others, strict=True)]
    return [row[0].ljust(fitting[0]) + "".join(map(str.rjust, row[1:], fitting[1:])) for row in rows]
