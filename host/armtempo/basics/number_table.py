"""Text tables of numbers: columns separated by commas, semicolons or tabs, with or without a header line."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

from armtempo.basics.atomic_file import why
from armtempo.basics.errors import InputError
from armtempo.basics.text import is_number

_SEPARATORS = (";", "\t", ",")
"""Tried in this order; with the first two, a comma may be the decimal separator."""


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
        if len(row) <= max(columns):
            raise InputError(
                f"{self.path}: line {number}: {len(row)} values; at least {max(columns) + 1} are needed",
                "complete the line",
            )
        for column in columns:
            if not _is_finite(row[column]):
                raise InputError(
                    f"{self.path}: line {number}: {row[column]!r} is not a finite number",
                    "write numbers such as 12.5; columns are separated by commas, semicolons or tabs",
                )
        return [float(row[column]) for column in columns]


def read(path: Path) -> NumberTable:
    """The table in a text file, as ``of_text``; raises InputError if it cannot be read."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path}: cannot be read: {why(error)}", "check the path, and that it is a text file in UTF-8"
        ) from None
    return of_text(text, path)


def of_text(text: str, path: Path | str) -> NumberTable:
    """The table in a text from ``path``; skips empty lines. Raises InputError if it is not a table."""
    separator = _separator(text)
    try:
        lines = list(enumerate(csv.reader(text.splitlines(), delimiter=separator), 1))
    except csv.Error as error:
        raise InputError(f"{path}: is not a table: {error}", "give a CSV file") from None
    rows = [(number, [cell.strip() for cell in row]) for number, row in lines if any(map(str.strip, row))]
    header = rows.pop(0)[1] if rows and not all(map(is_number, _pointed(rows[0][1], separator))) else None
    return NumberTable(path, header, [(number, _pointed(row, separator)) for number, row in rows])


def _separator(text: str) -> str:
    first = next((line for line in text.splitlines() if line.strip()), "")
    return next((separator for separator in _SEPARATORS if separator in first), ",")


def _pointed(row: list[str], separator: str) -> list[str]:
    """The cells with decimal points, if the comma is not the separator."""
    return row if separator == "," else [cell.replace(",", ".") for cell in row]


def _is_finite(text: str) -> bool:
    return is_number(text) and math.isfinite(float(text))
