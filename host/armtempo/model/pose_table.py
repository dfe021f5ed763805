"""A tool pose from a TOML table, or as much of one as is asked for, with its tolerances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armtempo.basics.errors import InputError
from armtempo.basics.toml_table import Table
from armtempo.model import pose
from armtempo.model.tool_pose import LARGEST_DEG, LARGEST_MM, SMALLEST, WHOLE, Pose

ORIENTATIONS = ("rpy_deg", "quaternion", "approach")
"""Keys that give an orientation in one piece; position_mm goes with one of them, with single angles, or alone."""


def read(table: Table, where: str) -> Pose:
    """The pose that ``table`` gives as ``matrix`` or ``position_mm``; InputError, naming ``where``, else."""
    found = _matrix(table, where) if table.has("matrix") else _positioned(table, where)
    return replace(
        found,
        tolerance_mm=table.number("tolerance_mm", found.tolerance_mm, least=SMALLEST, most=LARGEST_MM),
        tolerance_deg=table.number("tolerance_deg", found.tolerance_deg, least=SMALLEST, most=LARGEST_DEG),
    )


def _matrix(table: Table, where: str) -> Pose:
    given = table.array("matrix", "the 4 rows of a pose, lengths in mm")
    if len(given) != 4:
        raise table.fail("matrix", "4 rows of 4 numbers")
    rows = Table({f"row {n}": row for n, row in enumerate(given, 1)}, table.file, "matrix ")
    matrix = np.array([rows.numbers(f"row {n}", 4) for n in range(1, 5)])
    return Pose.of_matrix(pose.checked(matrix, f"{where}.matrix"))


def _positioned(table: Table, where: str) -> Pose:
    position = table.numbers("position_mm", 3)
    angles = {name: table.number(f"{name}_deg") for name in WHOLE if table.has(f"{name}_deg")}
    given = [key for key in ORIENTATIONS if table.has(key)]
    if len(given) + bool(angles) > 1:
        raise InputError(
            f"{where}: {', '.join((*given, *(f'{name}_deg' for name in angles)))} cannot be given together",
            "give position_mm alone, with one of rpy_deg, quaternion and approach, or with any of roll_deg, "
            "pitch_deg and yaw_deg",
        )
    if given == ["quaternion"]:
        matrix = pose.from_quaternion(position, table.numbers("quaternion", 4), f"{where}.quaternion")
        return Pose.of_matrix(matrix)
    if given == ["approach"]:
        return Pose.of_approach(position, table.numbers("approach", 3), f"{where}.approach")
    if given == ["rpy_deg"]:
        angles = dict(zip(WHOLE, table.numbers("rpy_deg", 3), strict=True))
    return Pose.of_angles(position, angles, where)
