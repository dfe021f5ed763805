"""Pallets: places in rows, columns and layers, such as those of a tray in a frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from armtempo.basics import toml_section
from armtempo.basics.arguments import checked_fields
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.basics.toml_section import key
from armtempo.basics.toml_table import Table
from armtempo.model import frame, outputs_file, tool_pose
from armtempo.model.frame import ArmFrame
from armtempo.model.tool_pose import BASE, Pose, rows_of

KIND = "pallet"
"""The tables [pallet.NAME] of an arm file."""
MOST_PLACES = 1000
_MOST_MM = 1e4


@checked_fields
@dataclass(frozen=True)
class ArmPallet:
    """A pallet: columns are counted along x of its frame, rows along y, layers along z."""

    name: str
    first: Pose
    """Of the tool at its first place, as given in ``frame``."""
    frame: str = BASE
    """The frame of the arm along whose axes it lies."""
    rows: int = field(default=1, metadata=key("rows of places, along y of its frame", 1, MOST_PLACES))
    columns: int = field(default=1, metadata=key("columns, along x", 1, MOST_PLACES))
    layers: int = field(default=1, metadata=key("layers, along z", 1, MOST_PLACES))
    row_mm: float = field(
        default=0.0, metadata=key("from one row to the next, may be negative", -_MOST_MM, _MOST_MM)
    )
    column_mm: float = field(
        default=0.0, metadata=key("from one column to the next, may be negative", -_MOST_MM, _MOST_MM)
    )
    layer_mm: float = field(default=0.0, metadata=key("from one layer to the next", -_MOST_MM, _MOST_MM))
    above_mm: float = field(
        default=50.0,
        metadata=key(
            "the tool comes to a place, and leaves it, from this height above it, along z of the frame",
            0.1,
            _MOST_MM,
        ),
    )

    def __post_init__(self) -> None:
        """Raise InputError for a name that is not allowed, a pose that is none, or places at the same point."""
        outputs_file.check_name(f"{KIND}.{self.name}", self.name)
        toml_section.check(self)
        object.__setattr__(self, "first", self.first.exact(f"{KIND}.{self.name}"))
        for count, of, apart in (
            (self.rows, "row", self.row_mm),
            (self.columns, "column", self.column_mm),
            (self.layers, "layer", self.layer_mm),
        ):
            if count > 1 and not apart:
                raise InputError(
                    f"{KIND}.{self.name}: {count} {of}s at the same point",
                    f"give {of}_mm, the distance from one {of} to the next",
                )
        if self.places > MOST_PLACES:
            raise InputError(f"{KIND}.{self.name}: {self.places} places", f"give at most {MOST_PLACES}")

    @property
    def places(self) -> int:
        """Number of places."""
        return self.rows * self.columns * self.layers

    def describe(self, number: int) -> str:
        """The place of this number, from 1: columns are counted first, then rows, then layers."""
        layer, row, column = self._at(number)
        return f"row {row + 1}, column {column + 1}, layer {layer + 1} of pallet {self.name!r}"

    def _at(self, number: int) -> tuple[int, int, int]:
        rest, column = divmod(number - 1, self.columns)
        layer, row = divmod(rest, self.rows)
        return layer, row, column

    def pose(self, number: int, frames: Sequence[ArmFrame], above: bool = False) -> Pose:
        """The tool's pose at the place of this number, or above it, in the base.

        Raises InputError if its frame is not among ``frames``, or tilted while single angles are given.
        """
        layer, row, column = self._at(number)
        matrix: Array = np.array(self.first.matrix)
        up_mm = layer * self.layer_mm + (self.above_mm if above else 0.0)
        matrix[:3, 3] += (column * self.column_mm, row * self.row_mm, up_mm)
        given = replace(self.first, matrix=rows_of(matrix))
        return frame.pose_in_base(given, frames, self.frame, f"{KIND}.{self.name}")


def read(top: Table, frames: Sequence[ArmFrame]) -> tuple[ArmPallet, ...]:
    """The tables [pallet.NAME] of an arm file; raises InputError, with file, key and value, for invalid ones."""
    return tuple(_pallet(name, table, frames) for name, table in outputs_file.named(top, KIND))


def _pallet(name: str, table: Table, frames: Sequence[ArmFrame]) -> ArmPallet:
    where = f"{table.file}: {KIND}.{name}"
    first = tool_pose.from_table(table, where)
    in_frame = frame.named(table, frames)
    try:
        return toml_section.read(ArmPallet, table, name=name, first=first, frame=in_frame)
    except InputError as error:
        problem = error.problem
        raise InputError(
            problem if problem.startswith(table.file) else f"{table.file}: {problem}", error.hint
        ) from None


def check(pallets: Sequence[ArmPallet], frames: Sequence[ArmFrame], where: str) -> None:
    """Raise InputError, which begins with ``where``, for two of a name, or a frame in which one cannot be."""
    names = [each.name for each in pallets]
    for each in pallets:
        if names.count(each.name) > 1:
            raise InputError(f"{where}: two pallets are called {each.name!r}", "give each a name of its own")
        try:
            each.pose(1, frames)
        except InputError as error:
            raise InputError(f"{where}: {error.problem}", error.hint) from None
