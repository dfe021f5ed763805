"""A pose as options: its position, alone or with an orientation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import Any

import click

from armtempo.basics.errors import InputError
from armtempo.cli.options import FC, FiniteNumber
from armtempo.model.pose import from_quaternion
from armtempo.model.tool_pose import WHOLE, Pose

Three = tuple[float, float, float]
Four = tuple[float, float, float, float]

_OPTIONS: tuple[Callable[[Any], Any], ...] = (
    click.option(
        "--position",
        type=FiniteNumber(),
        nargs=3,
        metavar="X Y Z",
        help="Tool position in mm; alone, or with an orientation.",
    ),
    click.option(
        "--rpy",
        type=FiniteNumber(),
        nargs=3,
        metavar="R P Y",
        help="Roll, pitch, yaw in deg: the whole orientation.",
    ),
    click.option(
        "--quaternion", type=FiniteNumber(), nargs=4, metavar="W X Y Z", help="The same as a quaternion."
    ),
    click.option(
        "--roll",
        type=FiniteNumber(),
        metavar="DEG",
        help="Roll in deg; alone or with the pitch (the rest is free).",
    ),
    click.option(
        "--pitch",
        type=FiniteNumber(),
        metavar="DEG",
        help="Pitch in deg; alone or with roll or yaw, the rest is free.",
    ),
    click.option(
        "--yaw",
        type=FiniteNumber(),
        metavar="DEG",
        help="Yaw in deg; alone or with the pitch, the rest is free.",
    ),
    click.option(
        "--approach",
        type=FiniteNumber(),
        nargs=3,
        metavar="X Y Z",
        help="Direction of the tool's z axis; rotation about it is free.",
    ),
)


def options(command: FC) -> FC:
    """Give a command the options of a pose, which ``TypedPose`` takes by their names."""
    found: FC = reduce(lambda of, option: option(of), reversed(_OPTIONS), command)
    return found


@dataclass(frozen=True)
class TypedPose:
    """The options that describe a pose."""

    position: Three | None
    rpy: Three | None
    quaternion: Four | None
    roll: float | None
    pitch: float | None
    yaw: float | None
    approach: Three | None

    @property
    def angles_deg(self) -> dict[str, float]:
        """The single angles that are given."""
        return {name: getattr(self, name) for name in WHOLE if getattr(self, name) is not None}

    def _check(self) -> None:
        """Raise InputError for more than one orientation, or one without a position."""
        whole = sum(form is not None for form in (self.rpy, self.quaternion, self.approach))
        if whole + bool(self.angles_deg) > (self.position is not None):
            raise InputError(
                "these options do not describe a pose",
                "--position goes alone or with one of --rpy, --quaternion, --approach, or any of --roll, --pitch and "
                "--yaw; and they go with it",
            )

    def pose(self) -> Pose | None:
        """The pose; None if none is given. Raises InputError for an invalid one."""
        self._check()
        if self.position is None:
            return None
        if self.quaternion is not None:
            return Pose.of_matrix(from_quaternion(self.position, self.quaternion, "--position --quaternion"))
        if self.approach is not None:
            return Pose.of_approach(self.position, self.approach, "--approach")
        angles = self.angles_deg
        if self.rpy is not None:
            angles = dict(zip(WHOLE, self.rpy, strict=True))
        return Pose.of_angles(
            self.position, angles, " ".join(("--position", *(f"--{name}" for name in angles)))
        )
