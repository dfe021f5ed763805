"""What is taught from postures of the arm: a frame from three points, a tool from four postures around a tip."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.diagnosis import figures
from armtempo.kinematics.of_arm import forward
from armtempo.model import frame, taught, taught_frame, taught_tool, tool
from armtempo.model.arm import Arm
from armtempo.model.parts import NOTHING
from armtempo.model.pose import to_rpy_deg


class NewFrame:
    """The frame that is taught, and the arm file that gets it."""

    kind = frame.KIND
    points = taught_frame.POINTS

    def __init__(self, file: Path, arm: Arm, name: str, level: bool, replace_old: bool) -> None:
        """Raise InputError for a name that is not allowed or taken, before anything moves."""
        frame.check_name(name)
        taught.check_free(file, (frame.KIND, name), replace_old)
        self._file = file
        self._arm = arm
        self.name = name
        self._level = level
        self._replace = replace_old
        self._step_error_mm = 0.5 * sum(resolution.step_mm for resolution in figures.resolutions(arm))
        """By how much half a step of each joint moves the tool at most."""

    def check(self, points_deg: Sequence[Sequence[float]]) -> None:
        """Raise InputError if the first points of a frame, (1 to 3, J), cannot be its points."""
        points_mm = self._points_mm(points_deg)
        taught_frame.check_apart(points_mm, self._step_error_mm)
        if len(points_mm) == len(taught_frame.POINTS):
            taught_frame.of_points(points_mm, self._step_error_mm, self._level)

    def _points_mm(self, points_deg: Sequence[Sequence[float]]) -> Array:
        return np.array([forward(self._arm, angles)[:3, 3] for angles in points_deg])

    def save(self, points_deg: Sequence[Sequence[float]]) -> list[str]:
        """Write the frame through the tool's points at postures, (3, J); lines that say what it is and how accurate.

        Raises InputError if they give none.
        """
        arm, name, step_error_mm = self._arm, self.name, self._step_error_mm
        found = taught_frame.of_points(self._points_mm(points_deg), step_error_mm, self._level)
        values = taught_frame.values(arm, name, found.matrix)
        taught.save_table(self._file, (frame.KIND, name), values, self._replace)
        tilt = "made level, it was tilted" if self._level else "it is tilted"
        return [
            f"{self._file}: frame {name!r}: {', '.join(f'{key} {value}' for key, value in values.items())}",
            f"the points are {found.apart_mm[0]:.4g} and {found.apart_mm[1]:.4g} mm from the origin, "
            f"{found.angle_deg:.3g} degrees apart; {tilt} by {found.tilt_deg:.3g} degrees; half a step of each joint "
            f"is up to {step_error_mm:.2g} mm at the tool, which turns the axes by up to {found.axes_error_deg:.2g} "
            "degrees",
        ]


class NewTool:
    """The tool whose point is taught, and the arm file that gets it."""

    kind = tool.KIND
    points = taught_tool.POINTS

    def __init__(self, file: Path, arm: Arm, name: str, replace_old: bool) -> None:
        """Raise InputError for a name that is not allowed or taken, before anything moves."""
        tool.check_name(name)
        taught.check_free(file, (tool.KIND, name), replace_old)
        self._file = file
        self._arm = arm.with_tool(NOTHING)
        self.name = name
        self._replace = replace_old
        self._step_error_mm = 0.5 * sum(resolution.step_mm for resolution in figures.resolutions(self._arm))

    def check(self, points_deg: Sequence[Sequence[float]]) -> None:
        """Raise InputError if postures (1 to 4, J) do not give the tool's point; fewer than 4 may still do so."""
        if len(points_deg) == len(self.points):
            taught_tool.of_postures(self._flanges(points_deg), self._step_error_mm)

    def _flanges(self, points_deg: Sequence[Sequence[float]]) -> Array:
        return np.array([forward(self._arm, angles) for angles in points_deg])

    def save(self, points_deg: Sequence[Sequence[float]]) -> list[str]:
        """Write the tool whose point is at one tip in postures (4, J); lines that say what it is and how accurate.

        Raises InputError if they give none.
        """
        found = taught_tool.of_postures(self._flanges(points_deg), self._step_error_mm)
        place = (tool.KIND, self.name)
        old = next((each for each in self._arm.tools if each.name == self.name), None)
        turns = to_rpy_deg(old.matrix) if old else (0.0, 0.0, 0.0)
        values = taught_tool.values(taught.table_of(self._file, place), turns, found.position_mm)
        taught.save_table(self._file, place, values, self._replace)
        return [
            f"{self._file}: tool {self.name!r}: {', '.join(f'{key} {value}' for key, value in values.items())}",
            f"the postures meet within {found.apart_mm:.2g} mm; half a step of each joint may move the point by up to "
            f"{found.error_mm:.2g} mm",
        ]
