"""Points that are taught one by one, and what becomes of them: the via points of a job, or a frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import click
import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError
from armtempo.cli import results
from armtempo.diagnosis import figures
from armtempo.kinematics.of_arm import forward
from armtempo.model import frame, taught, taught_frame, taught_tool, tool
from armtempo.model.arm import Arm
from armtempo.model.parts import NOTHING
from armtempo.model.pose import to_rpy_deg
from armtempo.planning import via_points

TAKE, UNDO = "p", "u"


class TaughtPoints:
    """The points taught up to now; ``where`` returns the posture of the arm, degrees (J,)."""

    def __init__(self, arm: Arm, where: Callable[[], Array]) -> None:
        self.points_deg: list[list[float]] = []
        self._arm = arm
        self.where = where

    @property
    def keys(self) -> dict[str, Callable[[], str]]:
        """The keys for the jog screen, with their functions."""
        return {TAKE: self.take, UNDO: self.undo}

    def take(self) -> str:
        """Store the arm's position; returns a message."""
        point = taught.digits(self._arm, self.where().tolist())
        if problem := self._arm.angles_problem(point):
            return f"not taken: {problem}"
        if self.points_deg and point == self.points_deg[-1]:
            return "not taken: the arm is at the last point"
        self.points_deg.append(point)
        return f"point {len(self.points_deg)} taken: {row(point)}"

    def undo(self) -> str:
        """Remove the last point; returns a message."""
        if not self.points_deg:
            return "there is no point to remove"
        self.points_deg.pop()
        return f"point {len(self.points_deg) + 1} removed"

    def save(self) -> None:
        """Write what they are; raises InputError for too few points."""
        raise NotImplementedError

    @property
    def signs(self) -> str:
        """The units of its positions, for a line of numbers."""
        return ", ".join(dict.fromkeys(joint.unit.sign.strip() for joint in self._arm.driven))

    def tell(self) -> None:
        """Print the points if the file cannot be written, so that they are not lost."""
        for point in self.points_deg:
            click.echo(f"[[via]]\n{self._arm.list_key('angles_deg')} = [{row(point)}]", err=True)


class JobPoints(TaughtPoints):
    """The via points of a new job."""

    def __init__(self, arm: Arm, where: Callable[[], Array], file: Path) -> None:
        super().__init__(arm, where)
        self._file = file

    def save(self) -> None:
        """Write the job; raises InputError for fewer than two points."""
        text = taught.of_points(taught.name_of(self._file), self.points_deg, self._arm)
        replace_text(self._file, text)
        results.echo(
            f"written: {self._file}, {len(self.points_deg)} via points; 'armtempo plan --job {self._file}' plans it"
        )


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
        self._name = name
        self._level = level
        self._replace = replace_old
        self._step_error_mm = 0.5 * sum(resolution.step_mm for resolution in figures.resolutions(arm))
        """By how much half a step of each joint moves the tool at most."""

    def problem(self, points_deg: Sequence[Sequence[float]]) -> str:
        """Why the first points of a frame, (1 to 3, J), cannot be its points; "" if they can."""
        points_mm = self._points_mm(points_deg)
        try:
            taught_frame.check_apart(points_mm, self._step_error_mm)
            if len(points_mm) == len(taught_frame.POINTS):
                taught_frame.of_points(points_mm, self._step_error_mm, self._level)
        except InputError as error:
            return f"{error.problem}; {error.hint}"
        return ""

    def _points_mm(self, points_deg: Sequence[Sequence[float]]) -> Array:
        return np.array([forward(self._arm, angles)[:3, 3] for angles in points_deg])

    def save(self, points_deg: Sequence[Sequence[float]]) -> None:
        """Write the frame through the tool's points at postures, (3, J); InputError if they give none."""
        arm, name, step_error_mm = self._arm, self._name, self._step_error_mm
        found = taught_frame.of_points(self._points_mm(points_deg), step_error_mm, self._level)
        values = taught_frame.values(arm, name, found.matrix)
        taught.save_table(self._file, (frame.KIND, name), values, self._replace)
        tilt = "made level, it was tilted" if self._level else "it is tilted"
        results.echo(
            f"{self._file}: frame {name!r}: {', '.join(f'{key} {value}' for key, value in values.items())}"
        )
        results.echo(
            f"the points are {found.apart_mm[0]:.4g} and {found.apart_mm[1]:.4g} mm from the origin, "
            f"{found.angle_deg:.3g} degrees apart; {tilt} by {found.tilt_deg:.3g} degrees; half a step of each joint "
            f"is up to {step_error_mm:.2g} mm at the tool, which turns the axes by up to {found.axes_error_deg:.2g} "
            "degrees"
        )


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
        self._name = name
        self._replace = replace_old
        self._step_error_mm = 0.5 * sum(resolution.step_mm for resolution in figures.resolutions(self._arm))

    def problem(self, points_deg: Sequence[Sequence[float]]) -> str:
        """Why postures (1 to 4, J) do not give the tool's point; "" if they do, or are still too few."""
        try:
            if len(points_deg) == len(self.points):
                taught_tool.of_postures(self._flanges(points_deg), self._step_error_mm)
        except InputError as error:
            return f"{error.problem}; {error.hint}"
        return ""

    def _flanges(self, points_deg: Sequence[Sequence[float]]) -> Array:
        return np.array([forward(self._arm, angles) for angles in points_deg])

    def save(self, points_deg: Sequence[Sequence[float]]) -> None:
        """Write the tool whose point is at one tip in postures (4, J); InputError if they give none."""
        found = taught_tool.of_postures(self._flanges(points_deg), self._step_error_mm)
        place = (tool.KIND, self._name)
        old = next((each for each in self._arm.tools if each.name == self._name), None)
        turns = to_rpy_deg(old.matrix) if old else (0.0, 0.0, 0.0)
        values = taught_tool.values(taught.table_of(self._file, place), turns, found.position_mm)
        taught.save_table(self._file, place, values, self._replace)
        results.echo(
            f"{self._file}: tool {self._name!r}: {', '.join(f'{key} {value}' for key, value in values.items())}"
        )
        results.echo(
            f"the postures meet within {found.apart_mm:.2g} mm; half a step of each joint may move the point by up to "
            f"{found.error_mm:.2g} mm"
        )


def postures_deg(arm: Arm, names: Sequence[str], points: Sequence[str]) -> list[list[float]]:
    """The angles, (J,), of the postures of the arm file at ``points``; InputError unless there is one for each."""
    if len(names) != len(points):
        raise InputError(
            f"--at {','.join(names)}: {len(names)} postures", f"give {len(points)}: at {', '.join(points)}"
        )
    return [via_points.posture_deg(arm, arm.posture(name.strip())).tolist() for name in names]


class NamedPoints(TaughtPoints):
    """The points of a frame, or the postures for a tool, which are taken in this order."""

    def __init__(self, arm: Arm, where: Callable[[], Array], new: NewFrame | NewTool) -> None:
        super().__init__(arm, where)
        self._new = new

    def take(self) -> str:
        """Store the arm's position as the next point; returns a message."""
        count, points = len(self.points_deg), self._new.points
        if count == len(points):
            return f"not taken: all {count} are there; q writes the {self._new.kind}, u removes the last"
        said = super().take()
        if len(self.points_deg) == count:
            return said
        if problem := self._new.problem(self.points_deg):
            self.points_deg.pop()
            return f"not taken: {problem}"
        then = [*points[1:], f"q writes the {self._new.kind}"][count]
        return f"{points[count]} taken; next: {then}"

    def save(self) -> None:
        """Write what they give; raises InputError if some are missing."""
        points = self._new.points
        if len(self.points_deg) < len(points):
            raise InputError(
                f"{len(self.points_deg)} of {len(points)} points, so no {self._new.kind} was written",
                f"take {', '.join(points)}",
            )
        self._new.save(self.points_deg)


def row(point: Sequence[float]) -> str:
    """A posture as the list in a file has it."""
    return ", ".join(f"{angle + 0.0:.12g}" for angle in point)
