"""Points that are taught one by one, and what becomes of them: the via points of a job, a frame, or a tool."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

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
from armtempo.model.taught_frame import ThreePoints
from armtempo.model.taught_tool import Tip
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
        self._name = name
        self._replace = replace_old
        self._step_error_mm = 0.5 * sum(resolution.step_mm for resolution in figures.resolutions(arm))
        """By how much half a step of each joint moves the tool at most."""

    def problem(self, points_deg: Sequence[Sequence[float]]) -> str:
        """Why the first points, postures (N, J), cannot be used; "" if they can."""
        try:
            self._check(points_deg)
        except InputError as error:
            return f"{error.problem}; {error.hint}"
        return ""

    def _check(self, points_deg: Sequence[Sequence[float]]) -> None:
        raise NotImplementedError

    def save(self, points_deg: Sequence[Sequence[float]]) -> None:
        """Write the table that all points, postures (N, J), give; InputError if they give none."""
        raise NotImplementedError

    def _write(self, values: Mapping[str, Any], accuracy: str) -> None:
        taught.save_table(self._file, (self.kind, self._name), values, self._replace)
        written = ", ".join(f"{key} {value}" for key, value in values.items())
        results.echo(f"{self._file}: {self.kind} {self._name!r}: {written}")
        results.echo(accuracy)

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

    def _check(self, points_deg: Sequence[Sequence[float]]) -> None:
        if len(points_deg) == len(self.points):
            self._found(points_deg)
        else:
            taught_frame.check_apart(self._poses(points_deg)[:, :3, 3], self._step_error_mm)

    def _found(self, points_deg: Sequence[Sequence[float]]) -> ThreePoints:
        return taught_frame.of_points(self._poses(points_deg)[:, :3, 3], self._step_error_mm, self._level)

    def save(self, points_deg: Sequence[Sequence[float]]) -> None:
        """As of ``NewTable``."""
        found = self._found(points_deg)
        tilt = "made level, it was tilted" if self._level else "it is tilted"
        self._write(
            taught_frame.values(self._arm, self._name, found.matrix),
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

    def _check(self, points_deg: Sequence[Sequence[float]]) -> None:
        if len(points_deg) == len(self.points):
            self._found(points_deg)

    def _found(self, points_deg: Sequence[Sequence[float]]) -> Tip:
        return taught_tool.of_postures(self._poses(points_deg), self._step_error_mm)

    def save(self, points_deg: Sequence[Sequence[float]]) -> None:
        """As of ``NewTable``."""
        found = self._found(points_deg)
        old = next((each for each in self._arm.tools if each.name == self._name), None)
        turns = to_rpy_deg(old.matrix) if old else (0.0, 0.0, 0.0)
        before = taught.table_of(self._file, (self.kind, self._name))
        self._write(
            taught_tool.values(before, turns, found.position_mm),
            f"the postures meet within {found.apart_mm:.2g} mm; half a step of each joint may move the point by up to "
            f"{found.error_mm:.2g} mm",
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

    def __init__(self, arm: Arm, where: Callable[[], Array], new: NewTable) -> None:
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
