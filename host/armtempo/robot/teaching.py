"""What is taught from postures of the arm: a frame from three points, a tool from four postures around a tip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.diagnosis import figures
from armtempo.kinematics.of_arm import forward
from armtempo.model import frame, taught, taught_frame, taught_tool, tool
from armtempo.model.arm import Arm
from armtempo.model.parts import NOTHING
from armtempo.model.pose import to_rpy_deg
from armtempo.model.taught_frame import ThreePoints
from armtempo.model.taught_tool import Tip


class NewTable:
    """A table of an arm file that is taught by points."""

    kind: str
    points: tuple[str, ...]
    """What each of them is."""

    def __init__(self, file: Path, arm: Arm, name: str, replace_old: bool) -> None:
        """Raise InputError for a name that is taken, before anything moves."""
        taught.check_free(file, (self.kind, name), replace_old)
        self._file = file
        self._arm = arm
        self.name = name
        self._replace = replace_old
        self._step_error_mm = 0.5 * sum(resolution.step_mm for resolution in figures.resolutions(arm))
        """By how much half a step of each joint moves the tool at most."""

    def check(self, points_deg: Sequence[Sequence[float]]) -> None:
        """Raise InputError if the first points, postures (N, J), cannot be used."""
        raise NotImplementedError

    def save(self, points_deg: Sequence[Sequence[float]]) -> list[str]:
        """Write the table that all points, postures (N, J), give; lines that say what it is and how accurate.

        Raises InputError if they give none.
        """
        raise NotImplementedError

    def _write(self, values: Mapping[str, Any], accuracy: str) -> list[str]:
        taught.save_table(self._file, (self.kind, self.name), values, self._replace)
        written = ", ".join(f"{key} {value}" for key, value in values.items())
        return [f"{self._file}: {self.kind} {self.name!r}: {written}", accuracy]

    def _poses(self, points_deg: Sequence[Sequence[float]]) -> Array:
        """Of the tool, (N, 4, 4)."""
        return np.array([forward(self._arm, angles) for angles in points_deg])


class NewFrame(NewTable):
    """The frame through three points of the tool."""

    kind = frame.KIND
    points = taught_frame.POINTS

    def __init__(self, file: Path, arm: Arm, name: str, level: bool, replace_old: bool) -> None:
        """Raise InputError for a name that is not allowed or taken, before anything moves."""
        frame.check_name(name)
        super().__init__(file, arm, name, replace_old)
        self._level = level

    def check(self, points_deg: Sequence[Sequence[float]]) -> None:
        """As of ``NewTable``."""
        if len(points_deg) == len(self.points):
            self._found(points_deg)
        else:
            taught_frame.check_apart(self._poses(points_deg)[:, :3, 3], self._step_error_mm)

    def _found(self, points_deg: Sequence[Sequence[float]]) -> ThreePoints:
        return taught_frame.of_points(self._poses(points_deg)[:, :3, 3], self._step_error_mm, self._level)

    def save(self, points_deg: Sequence[Sequence[float]]) -> list[str]:
        """As of ``NewTable``."""
        found = self._found(points_deg)
        tilt = "made level, it was tilted" if self._level else "it is tilted"
        return self._write(
            taught_frame.values(self._arm, self.name, found.matrix),
            f"the points are {found.apart_mm[0]:.4g} and {found.apart_mm[1]:.4g} mm from the origin, "
            f"{found.angle_deg:.3g} degrees apart; {tilt} by {found.tilt_deg:.3g} degrees; half a step of each joint "
            f"is up to {self._step_error_mm:.2g} mm at the tool, which turns the axes by up to "
            f"{found.axes_error_deg:.2g} degrees",
        )


class NewTool(NewTable):
    """The tool whose point touches one tip in four postures."""

    kind = tool.KIND
    points = taught_tool.POINTS

    def __init__(self, file: Path, arm: Arm, name: str, replace_old: bool) -> None:
        """Raise InputError for a name that is not allowed or taken, before anything moves."""
        tool.check_name(name)
        super().__init__(file, arm.with_tool(NOTHING), name, replace_old)

    def check(self, points_deg: Sequence[Sequence[float]]) -> None:
        """As of ``NewTable``."""
        if len(points_deg) == len(self.points):
            self._found(points_deg)

    def _found(self, points_deg: Sequence[Sequence[float]]) -> Tip:
        return taught_tool.of_postures(self._poses(points_deg), self._step_error_mm)

    def save(self, points_deg: Sequence[Sequence[float]]) -> list[str]:
        """As of ``NewTable``."""
        found = self._found(points_deg)
        old = next((each for each in self._arm.tools if each.name == self.name), None)
        turns = to_rpy_deg(old.matrix) if old else (0.0, 0.0, 0.0)
        before = taught.table_of(self._file, (self.kind, self.name))
        return self._write(
            taught_tool.values(before, turns, found.position_mm),
            f"the postures meet within {found.apart_mm:.2g} mm; half a step of each joint may move the point by up to "
            f"{found.error_mm:.2g} mm",
        )
