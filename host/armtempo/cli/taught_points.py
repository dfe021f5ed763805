"""Points that are taught one by one, and what becomes of them: the via points of a job, a frame, or a tool."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import click

from armtempo.basics.arrays import Array
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError
from armtempo.cli import results
from armtempo.model import taught
from armtempo.model.arm import Arm
from armtempo.planning import via_points
from armtempo.robot.teaching import NewTable

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
            click.echo(f"[[via]]\n{self._arm.texts.list_key('angles_deg')} = [{row(point)}]", err=True)


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
        try:
            self._new.check(self.points_deg)
        except InputError as error:
            self.points_deg.pop()
            return f"not taken: {error.problem}; {error.hint}"
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
        for line in self._new.save(self.points_deg):
            results.echo(line)


def row(point: Sequence[float]) -> str:
    """A posture as the list in a file has it."""
    return ", ".join(f"{angle + 0.0:.12g}" for angle in point)
