"""A target as constraints for the numerical solver, and the distance of a tool from it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from armtempo.kinematics.forward import Frame
from armtempo.model.tool_pose import APPROACH, PITCH, ROLL, YAW, Pose

Vector = tuple[float, float, float]
X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)

UPRIGHT = 1e-9
"""Cosine of the pitch below which the tool's x axis is vertical: then its direction is completely constrained."""

STIFFEST = 1e4
"""Largest ratio of the two tolerances, relative to their scales (reach, 1 rad), used by the search."""


class Miss(NamedTuple):
    """Distance of a tool from its target."""

    position_mm: float
    rotation_deg: float
    """Angle between the orientations, the directions, or the constrained roll, pitch or yaw."""

    def __str__(self) -> str:
        return f"{round(self.position_mm, 6):.4g} mm and {round(self.rotation_deg, 6):.4g} deg"


class Turned(NamedTuple):
    """The squared error of orientation and its derivatives by rotations about axes z; vectors of length 3.

    The error itself is ``square``. Half its gradient for a joint is -z·torque; the second derivatives, by Gauss
    and Newton, are ``both`` z_i·z_j + ``each`` (z_i·along)(z_j·along).
    """

    square: float
    torque: Vector
    both: float
    each: float
    along: Vector


class Component(NamedTuple):
    """Constraint: the component of a direction fixed to the tool along a direction fixed to the base."""

    tool: Vector
    base: Vector
    value: float


class Direction(NamedTuple):
    """Constraint: a direction fixed to the tool equals a direction fixed to the base."""

    tool: Vector
    base: Vector


@dataclass(frozen=True)
class Constraint:
    """A target, ready for the solver."""

    target: Pose
    position: Vector
    axes: tuple[Vector, Vector, Vector]
    """x, y, z axes of the tool in the target's matrix."""
    partly: Component | Direction | None
    """The partial constraint on the orientation, if any."""

    @classmethod
    def of(cls, target: Pose) -> Constraint:
        """The constraint of a target."""
        x, y, z, position = (_column(target, index) for index in range(4))
        return cls(target, position, (x, y, z), _partly(target, (x, y, z)))

    def turned(self, tool: Frame[float]) -> Turned:
        """The squared error of orientation (of the chords), and its derivatives."""
        if self.partly is None:
            return _whole(self.axes, tool) if self.target.fixed else NOTHING
        here = _sum(self.partly.tool, tool)
        across = cross(here, self.partly.base)
        if isinstance(self.partly, Direction):
            return Turned(_apart(here, self.partly.base), across, 1.0, -1.0, here)
        off = dot(here, self.partly.base) - self.partly.value
        torque = (-off * across[0], -off * across[1], -off * across[2])
        return Turned(off * off, torque, 0.0, 1.0, across)

    def miss(self, tool: Frame[float]) -> Miss:
        """The distance of the tool from the target."""
        return Miss(math.sqrt(_apart(tool.origin, self.position)), math.degrees(self._turn_rad(tool)))

    def _turn_rad(self, tool: Frame[float]) -> float:
        if isinstance(self.partly, Component):
            name = self.target.fixed[0]
            return abs(math.remainder(_angle(name, *tool[:3]) - _angle(name, *self.axes), math.tau))
        square = self.turned(tool).square
        # the chord of one direction is 2 sin(angle / 2), that of three axes 2 sqrt(2) sin(angle / 2)
        longest = 4.0 if self.partly else 8.0
        return 2.0 * math.asin(min(math.sqrt(square / longest), 1.0))

    def reached(self, miss: Miss) -> bool:
        """Whether the distance is within the tolerances."""
        return miss.position_mm <= self.target.tolerance_mm and miss.rotation_deg <= self.target.tolerance_deg

    def weights(self, reach: float) -> tuple[float, float]:
        """Factors of the errors of position (of length 1) and orientation (rad): 1 in units of the tolerance."""
        position, rotation = 1.0 / self.target.tolerance_mm, 1.0 / math.radians(self.target.tolerance_deg)
        ratio = min(max(rotation / (position * reach), 1.0 / STIFFEST), STIFFEST)
        return position, position * reach * ratio


NOTHING = Turned(0.0, (0.0, 0.0, 0.0), 0.0, 0.0, (0.0, 0.0, 0.0))


def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _whole(axes: Sequence[Vector], tool: Frame[float]) -> Turned:
    square, torque = 0.0, (0.0, 0.0, 0.0)
    for here, wanted in zip(tool, axes, strict=False):
        square += _apart(here, wanted)
        part = cross(here, wanted)
        torque = torque[0] + part[0], torque[1] + part[1], torque[2] + part[2]
    return Turned(square, torque, 2.0, 0.0, (0.0, 0.0, 0.0))


def _partly(target: Pose, axes: tuple[Vector, Vector, Vector]) -> Component | Direction | None:
    x, y, z = axes
    upright = math.hypot(x[0], x[1]) < UPRIGHT
    below = x[2], y[2], z[2]  # the base's z axis, seen from the tool
    if target.fixed == (APPROACH,):
        return Direction(Z, z)
    if target.fixed == (PITCH, YAW) or (target.fixed == (PITCH,) and upright):
        return Direction(X, x)
    if target.fixed == (ROLL, PITCH):
        return Direction(below, Z)
    if target.fixed == (PITCH,):
        return Component(X, Z, x[2])
    if target.fixed == (YAW,):
        cos, sin = _unit(x[0], x[1])
        return Component(X, (-sin, cos, 0.0), 0.0)
    if target.fixed == (ROLL,):
        cos, sin = _unit(below[2], below[1])
        return Component((0.0, cos, -sin), Z, 0.0)
    return None


def _column(target: Pose, index: int) -> Vector:
    a, b, c = (float(row[index]) for row in target.matrix[:3])
    return a, b, c


def _angle(name: str, x: Vector, y: Vector, z: Vector) -> float:
    """Roll, pitch or yaw of a tool with these axes, in rad."""
    if name == ROLL:
        return math.atan2(y[2], z[2])
    return math.atan2(x[1], x[0]) if name == YAW else math.atan2(-x[2], math.hypot(x[0], x[1]))


def _unit(a: float, b: float) -> tuple[float, float]:
    length = math.hypot(a, b) or 1.0
    return a / length, b / length


def _sum(parts: Vector, tool: Frame[float]) -> Vector:
    """The direction in the base frame of one with these components in the tool's."""
    x, y, z, _ = tool
    return (
        parts[0] * x[0] + parts[1] * y[0] + parts[2] * z[0],
        parts[0] * x[1] + parts[1] * y[1] + parts[2] * z[1],
        parts[0] * x[2] + parts[1] * y[2] + parts[2] * z[2],
    )


def _apart(a: Vector, b: Vector) -> float:
    """Square of the distance."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return x * x + y * y + z * z
