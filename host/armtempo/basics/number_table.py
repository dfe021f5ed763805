"""Text tables of numbers: columns separated by commas, semicolons, tabs or blanks, with or without a header line."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable
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


def of_text(text: str, path: Path | str) -> NumberTable:
    """The table in a text from ``path``; skips empty lines, and those that begin with ``#``.

    A first line without a number is a header; so is the last line with ``#`` above the numbers, if it has as many words
    as they have columns, whatever is between the words. Raises InputError if the text is not a table, for a
    first line of words and numbers, and for a line with more or fewer cells than the first one.
    """
    separator = _separator(text)
    try:
        lines = list(enumerate(_cells(text.removeprefix("\ufeff").splitlines(), separator), 1))
    except csv.Error as error:
        raise InputError(f"{path}: is not a table: {error}", "give a CSV file") from None
    rows = [(number, [cell.strip() for cell in row]) for number, row in lines if any(map(str.strip, row))]
    remarks = [row for row in rows if row[1][0].startswith("#")]
    rows = [row for row in rows if row not in remarks]
    header = None
    if rows and not any(map(is_number, _pointed(rows[0][1], separator))):
        header = rows.pop(0)[1]
    above = [number for number, _ in remarks if rows and number < rows[0][0]]
    if header is None and above:
        header = _names(text.splitlines()[above[-1] - 1], separator, len(rows[0][1]))
    while header and not header[-1]:
        header.pop()
    width = len(header) if header is not None else len(rows[0][1]) if rows else 0
    rows = [
        (number, _fitted(_pointed(row, separator), width, f"{path}: line {number}")) for number, row in rows
    ]
    if rows and header is None and (words := [cell for cell in rows[0][1] if not is_number(cell)]):
        raise InputError(
            f"{path}: line {rows[0][0]}: {words[0]!r} is no number, but others in the line are",
            "correct it; a header has names only",
        )
    return NumberTable(path, header, rows)


def _separator(text: str) -> str:
    """The separator of the first line that is no remark; "" for blanks."""
    lines = (line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#"))
    first = next(lines, "")
    return next((separator for separator in _SEPARATORS if separator in first), "")


def _names(remark: str, separator: str, width: int) -> list[str] | None:
    """The names of so many columns in a line that begins with ``#``; None if it has more or fewer."""
    bare = remark.removeprefix("\ufeff").strip().lstrip("# \t")
    for each in dict.fromkeys((separator, *_SEPARATORS, "")):
        words = next(iter(csv.reader([bare], delimiter=each)), []) if each else _BLANKS.split(bare)
        if len(words) == width > 1:
            return [word.strip() for word in words]
    return _of_width(width, bare, _BLANKS.split(bare)) if width > 1 else None


def _cells(lines: list[str], separator: str) -> Iterable[list[str]]:
    if separator:
        return csv.reader(lines, delimiter=separator)
    rows = [_BLANKS.split(line.strip()) for line in lines]
    width = max((len(row) for row in rows if row and all(map(is_number, row))), default=0)
    # a header's names may have single blanks in them
    return [
        row if len(row) == width else _of_width(width, line.strip(), row) or row
        for line, row in zip(lines, rows, strict=True)
    ]


def _of_width(width: int, line: str, words: list[str]) -> list[str] | None:
    """So many names that have single blanks in them; None if there are more or fewer."""
    return next((names for names in (_WIDE_BLANKS.split(line), _joined(words)) if len(names) == width), None)


def _joined(words: list[str]) -> list[str]:
    """Each word with the numbers, and units in brackets, after it."""
    names = words[:1]
    for word in words[1:]:
        if is_number(word) or word[:1] in ("(", "["):
            names[-1] += f" {word}"
        else:
            names.append(word)
    return names


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
