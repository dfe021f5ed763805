"""Text tables of numbers: columns separated by commas, semicolons, tabs or blanks, with or without a header line."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path

from armtempo.basics.atomic_file import os_reason
from armtempo.basics.errors import InputError
from armtempo.basics.text import is_number

_SEPARATORS = (";", "\t", ",")
"""Tried in this order, blanks if there is none; with the first two, a comma may be the decimal separator."""
_BLANKS, _WIDE_BLANKS = re.compile(r"\s+"), re.compile(r"\s{2,}")


@dataclass(frozen=True)
class NumberTable:
    """The cells of a table; ``header`` is None if the first line is all numbers."""

    path: Path | str
    """Its file, or a description."""
    header: list[str] | None
    rows: list[tuple[int, list[str]]]
    """Line number from 1, and its cells."""
    units: list[str] | None = None
    """Of each column, without brackets, in the line below the header; None without such a line."""

    def numbers(self, columns: list[int]) -> list[list[float]]:
        """These columns of every row; raises InputError, with line and value, for a cell that is no finite number."""
        return [self._row(number, row, columns) for number, row in self.rows]

    def _row(self, number: int, row: list[str], columns: list[int]) -> list[float]:
        for column in columns:
            if not _is_finite(row[column]):
                raise InputError(
                    f"{self.path}: line {number}: {row[column]!r} is not a finite number",
                    "write numbers such as 12.5; columns are separated by commas, semicolons, tabs or blanks",
                )
        return [float(row[column]) for column in columns]


def text_of(path: Path) -> str:
    """The text of a file; raises InputError if it cannot be read."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path}: cannot be read: {os_reason(error)}",
            "check the path, and that it is a text file in UTF-8",
        ) from None


def of_text(text: str, path: Path | str, units: Collection[str] = ()) -> NumberTable:
    """The table in a text from ``path``; skips empty lines, and those that begin with ``#``.

    A first line without a number is a header; so is the last line with ``#`` above the numbers, if it has as many names
    as they have columns. A header may have other separators than the numbers; between blanks, a number, a word in
    brackets or one of ``units`` belongs to the name before it. A line below it may name the units of the columns.
    Raises InputError if the text is not a table, for a first line of words and numbers, and for a line with more or
    fewer cells than the first one, or the header.
    """
    lines = text.removeprefix("\ufeff").splitlines()
    try:
        separator = _separator(lines)
        cells = list(enumerate(_cells(lines, separator, units), 1))
    except csv.Error as error:
        raise InputError(f"{path}: is not a table: {error}", "give a CSV file") from None
    rows = [(number, [cell.strip() for cell in row]) for number, row in cells if any(map(str.strip, row))]
    remarks = [row for row in rows if row[1][0].startswith("#")]
    rows = [row for row in rows if row not in remarks]
    header = None
    if rows and not any(map(is_number, _pointed(rows[0][1], separator))):
        number, header = rows.pop(0)
        if rows and len(_trimmed(header)) != len(_trimmed(rows[0][1])):
            header = _names(lines[number - 1], separator, len(_trimmed(rows[0][1])), units) or header
    below = None
    if header and rows and _are_units(rows[0][1], units):
        number, cells_below = rows.pop(0)
        below = _bare(_fitted(cells_below, len(_trimmed(header)), f"{path}: line {number}"))
    above = [number for number, _ in remarks if rows and number < rows[0][0]]
    if header is None and above:
        remarked = [
            _names(lines[n - 1].lstrip("# \t"), separator, len(rows[0][1]), units) for n in above[-2:]
        ]
        header = remarked.pop()
        if header and remarked and remarked[0] and _are_units(header, units):
            header, below = remarked[0], _bare(header)
    header = header and _trimmed(header)
    width = len(header) if header is not None else len(rows[0][1]) if rows else 0
    if header and rows and not len(_trimmed(rows[0][1])) <= width <= len(rows[0][1]):
        raise InputError(
            f"{path}: line {rows[0][0]}: {len(rows[0][1])} values, but not as many names in the header",
            "give each column a name, with commas between the names",
        )
    rows = [
        (number, _fitted(_pointed(row, separator), width, f"{path}: line {number}")) for number, row in rows
    ]
    if rows and header is None and (words := [cell for cell in rows[0][1] if not is_number(cell)]):
        raise InputError(
            f"{path}: line {rows[0][0]}: {words[0]!r} is no number, but others in the line are",
            "correct it; a header has names only",
        )
    return NumberTable(path, header, rows, below)


def _separator(lines: list[str]) -> str:
    """The separator of the first line of several numbers, else of the first one that is no remark; "" for blanks."""
    own = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    for line in own:
        for separator in (*_SEPARATORS, ""):
            row = _pointed(_split(line, separator), separator)
            if (
                len(row) > 1
                and is_number(row[0])
                and all(is_number(cell) or not cell.strip() for cell in row)
            ):
                return separator
    return next((separator for separator in _SEPARATORS if separator in "".join(own[:1])), "")


def _split(line: str, separator: str) -> list[str]:
    return (
        next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
        if separator
        else _BLANKS.split(line.strip())
    )


def _names(line: str, separator: str, width: int, units: Collection[str]) -> list[str] | None:
    """The names of so many columns in a line; None if it has more or fewer."""
    bare = line.removeprefix("\ufeff").strip()
    for each in (separator, *_SEPARATORS):
        words = _split(bare, each) if each else []
        if len(words) == width > 1:
            return [word.strip() for word in words]
    return _of_width(width, bare, _BLANKS.split(bare), units) if width > 1 else None


def _cells(lines: list[str], separator: str, units: Collection[str]) -> Iterable[list[str]]:
    if separator:
        return csv.reader(lines, delimiter=separator, skipinitialspace=True)
    rows = [_BLANKS.split(line.strip()) for line in lines]
    width = max((len(row) for row in rows if row and all(map(is_number, row))), default=0)
    # a header's names may have single blanks in them
    return [
        row if all(map(is_number, row)) else _names(line, "", width, units) or row
        for line, row in zip(lines, rows, strict=True)
    ]


def _of_width(width: int, line: str, words: list[str], units: Collection[str]) -> list[str] | None:
    """So many names between blanks, some of which may have blanks in them; None if there are more or fewer."""
    quoted = _split(" ".join(words), " ")
    found = (words, quoted, _WIDE_BLANKS.split(line), _joined(words, units))
    return next((names for names in found if len(names) == width), None)


def _joined(words: list[str], units: Collection[str]) -> list[str]:
    """Each word with the numbers and units after it."""
    names = words[:1]
    for word in words[1:]:
        if is_number(word) or word[:1] in ("(", "[") or word.lower() in units:
            names[-1] += f" {word}"
        else:
            names.append(word)
    return names


def _are_units(row: list[str], units: Collection[str]) -> bool:
    """Whether a line names units: no numbers, and at least one of ``units``."""
    return not any(map(is_number, row)) and any(word.lower() in units for word in _bare(row))


def _bare(row: list[str]) -> list[str]:
    return [cell.strip("[]() ") for cell in row]


def _trimmed(row: list[str]) -> list[str]:
    """The row without the empty cells at its end."""
    return row[: max((number for number, cell in enumerate(row, 1) if cell), default=0)]


def _fitted(row: list[str], width: int, where: str) -> list[str]:
    """The row without empty cells beyond the width; InputError if its cells are more or fewer."""
    while len(row) > width and not row[-1]:
        row = row[:-1]
    if len(row) != width:
        raise InputError(
            f"{where}: {len(row)} values, but {width} columns", "give each line a value for each column"
        )
    return row


def _pointed(row: list[str], separator: str) -> list[str]:
    """The cells with decimal points, if the comma is not the separator."""
    return row if separator in (",", "") else [cell.replace(",", ".") for cell in row]


def _is_finite(text: str) -> bool:
    return is_number(text) and math.isfinite(float(text))
