"""A tool pose: position and all, part or none of the orientation, with tolerances."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from armtempo.basics import json_codec
from armtempo.basics.arguments import checked, checked_fields
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.basics.toml_table import Table
from armtempo.model import pose

Rows = tuple[tuple[float, ...], ...]
BASE = "base"
"""The frame in which everything is planned."""

ROLL, PITCH, YAW, APPROACH = "roll", "pitch", "yaw", "approach"
WHOLE = (ROLL, PITCH, YAW)
CONSTRAINTS = {
    (): 3,
    (ROLL,): 4,
    (PITCH,): 4,
    (YAW,): 4,
    (ROLL, PITCH): 5,
    (PITCH, YAW): 5,
    (APPROACH,): 5,
    WHOLE: 6,
}
"""The supported constraints on the orientation, and their number, including the three of the position."""

TOLERANCE_MM, TOLERANCE_DEG = 0.1, 0.1
"""Default tolerances."""

SMALLEST, LARGEST_MM, LARGEST_DEG = 1e-6, 1000.0, 180.0
"""Bounds of tolerances."""
ORIENTATIONS = ("rpy_deg", "quaternion", "approach")
"""Keys that give an orientation in one piece; position_mm goes with one of them, with single angles, or alone."""
_KEYS = ("matrix", "position_mm", *ORIENTATIONS, *(f"{name}_deg" for name in WHOLE))


@checked
@checked_fields
@dataclass(frozen=True)
class Pose:
    """A tool pose; ``fixed`` says which part of the orientation is constrained.

    The position is always constrained. Roll, pitch and yaw turn about x, then y, then z of the base.
    """

    matrix: Rows
    """In the base: 4 rows of 4, lengths in mm; its rotation is one of the allowed ones."""
    posture_deg: tuple[float, ...] | None = None
    """In a job: angles of all joints; the solution nearest to them is used. None: nearest to the via point before."""
    fixed: tuple[str, ...] = field(default=WHOLE, metadata=json_codec.ADDED)
    """The constrained part of the orientation, a key of CONSTRAINTS; "approach": the direction of the tool's
    z axis."""
    tolerance_mm: float = field(default=TOLERANCE_MM, metadata=json_codec.ADDED)
    tolerance_deg: float = field(default=TOLERANCE_DEG, metadata=json_codec.ADDED)
    frame: str = field(default=BASE, metadata=json_codec.ADDED)
    """The frame of the arm in which it was given; ``matrix`` is in the base (frame.py)."""

    def __post_init__(self) -> None:
        """Raise InputError for an invalid pose."""
        if [len(row) for row in self.matrix] != [4] * 4:
            raise InputError(
                "the matrix of a pose has 4 rows of 4", "give them, or use Pose.of_angles or Pose.of_approach"
            )
        object.__setattr__(self, "fixed", tuple(self.fixed))
        if self.fixed not in CONSTRAINTS:
            allowed = ", ".join("+".join(fixed) or "nothing" for fixed in CONSTRAINTS)
            raise InputError(
                f"a pose cannot fix {'+'.join(self.fixed)} of its orientation", f"it may fix {allowed}"
            )
        if not (
            SMALLEST <= self.tolerance_mm <= LARGEST_MM and SMALLEST <= self.tolerance_deg <= LARGEST_DEG
        ):
            raise InputError(
                f"tolerances of {self.tolerance_mm:g} mm and {self.tolerance_deg:g} deg are not allowed",
                f"give {SMALLEST:g} to {LARGEST_MM:g} mm and {SMALLEST:g} to {LARGEST_DEG:g} deg",
            )

    @property
    def constraints(self) -> int:
        """Number of constraints, 3 to 6."""
        return CONSTRAINTS[self.fixed]

    @property
    def description(self) -> str:
        """Describe the constraints."""
        if self.fixed == WHOLE:
            return "whole pose"
        return " and ".join(("position", *self.fixed)) if self.fixed else "position only"

    def exact(self, what: str = "the pose") -> Pose:
        """The pose with its rotation made exact; raises InputError, naming ``what``, if it is not a pose."""
        return replace(self, matrix=rows_of(pose.checked(self.matrix, what)))

    @classmethod
    def of_matrix(cls, matrix: Array, fixed: tuple[str, ...] = WHOLE) -> Pose:
        """A pose from a checked matrix, (4, 4)."""
        rows = np.asarray(matrix, dtype=float)
        return cls(rows_of(rows) if rows.shape == (4, 4) else (), fixed=fixed)

    @classmethod
    def of_angles(
        cls, position: Sequence[float], angles_deg: Mapping[str, float], what: str = "the pose"
    ) -> Pose:
        """A position with any of "roll", "pitch" and "yaw"; the others are free. Raises InputError, naming
        ``what``."""
        fixed = tuple(name for name in WHOLE if name in angles_deg)
        if fixed not in CONSTRAINTS:
            raise InputError(
                f"{what}: roll and yaw without pitch do not define an orientation",
                "give pitch too, or leave one out",
            )
        rpy = [angles_deg.get(name, 0.0) for name in WHOLE]
        return cls.of_matrix(pose.from_rpy(position, rpy, what), fixed)

    @classmethod
    def of_approach(
        cls, position: Sequence[float], direction: Sequence[float], what: str = "the pose"
    ) -> Pose:
        """A position with the direction (of any length) of the tool's z axis."""
        if (len(position), len(direction)) != (3, 3):
            raise InputError(f"{what}: position and direction have 3 numbers each", "give x, y and z")
        length = math.hypot(*direction)
        if not 1e-9 <= length <= pose.LARGEST:
            raise InputError(
                f"{what}: the approach has length {length:g}",
                "give a direction such as 0 0 -1 (straight down)",
            )
        z = np.array(direction) / length
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= np.linalg.norm(x)
        matrix = np.column_stack((x, np.cross(z, x), z, position))
        return cls.of_matrix(pose.checked(matrix, what), (APPROACH,))


def rows_of(matrix: Array) -> Rows:
    """A matrix as the rows of a pose."""
    return tuple(map(tuple, matrix.tolist()))


def from_table(table: Table, where: str) -> Pose:
    """The pose that ``table`` gives as ``matrix`` or ``position_mm``; InputError, naming ``where``, else."""
    found = given(table, where)
    return replace(
        found,
        tolerance_mm=table.number("tolerance_mm", found.tolerance_mm, least=SMALLEST, most=LARGEST_MM),
        tolerance_deg=table.number("tolerance_deg", found.tolerance_deg, least=SMALLEST, most=LARGEST_DEG),
    )


def given(table: Table, where: str) -> Pose:
    """As ``from_table``, without tolerances."""
    table.known(*(key for key in _KEYS if not table.has(key)))  # a misspelt one may be meant for them
    return _matrix(table, where) if table.has("matrix") else _positioned(table, where)


def _matrix(table: Table, where: str) -> Pose:
    entries = table.array("matrix", "the 4 rows of a pose, lengths in mm")
    if len(entries) != 4:
        raise table.fail("matrix", "4 rows of 4 numbers")
    rows = Table({f"row {n}": row for n, row in enumerate(entries, 1)}, table.file, f"{table.place}matrix ")
    matrix = np.array([rows.numbers(f"row {n}", 4) for n in range(1, 5)])
    return Pose.of_matrix(pose.checked(matrix, f"{where}.matrix"))


def _positioned(table: Table, where: str) -> Pose:
    position = table.numbers("position_mm", 3)
    angles = {name: table.number(f"{name}_deg") for name in WHOLE if table.has(f"{name}_deg")}
    turned = [key for key in ORIENTATIONS if table.has(key)]
    if len(turned) + bool(angles) > 1:
        raise InputError(
            f"{where}: {', '.join((*turned, *(f'{name}_deg' for name in angles)))} cannot be given together",
            "give position_mm alone, with one of rpy_deg, quaternion and approach, or with any of roll_deg, "
            "pitch_deg and yaw_deg",
        )
    if turned == ["quaternion"]:
        matrix = pose.from_quaternion(position, table.numbers("quaternion", 4), f"{where}.quaternion")
        return Pose.of_matrix(matrix)
    if turned == ["approach"]:
        return Pose.of_approach(position, table.numbers("approach", 3), f"{where}.approach")
    if turned == ["rpy_deg"]:
        angles = dict(zip(WHOLE, table.numbers("rpy_deg", 3), strict=True))
    return Pose.of_angles(position, angles, where)
