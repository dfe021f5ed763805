"""The geometry of a serial arm: its Denavit-Hartenberg table, lengths in any one unit, angles in radians.

A sliding joint's position counts in radians too, of ``SLIDE_MM`` each (model/joint_unit.py), so that one conversion
serves all joints; an arm with one is in mm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, TypeVar

from armtempo.basics.arrays import Array
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import SLIDE_MM

T = TypeVar("T", float, Array)
"""Type of formulas for floats and arrays, element by element."""


class Link(NamedTuple):
    """One Denavit-Hartenberg row, with cosine and sine of its twist."""

    d: float
    a: float
    cos_alpha: float
    sin_alpha: float
    offset: float


STILL_DEG = 0.01
"""A joint without a motor whose range is no wider than this never turns."""

_CLOSED_FORM = 6


@dataclass(frozen=True)
class Geometry:
    """Denavit-Hartenberg rows, standard (distal) convention.

    Row i is the transform Rz(angle + offset) Tz(d) Tx(a) Rx(alpha) from frame i - 1 to frame i, and that of a sliding
    joint Rz(offset) Tz(d + SLIDE_MM angle) Tx(a) Rx(alpha). All lengths share one unit, which is also the unit of
    the poses.
    """

    d: tuple[float, ...]
    a: tuple[float, ...]
    alpha: tuple[float, ...]
    offset: tuple[float, ...]
    """Added to each joint's angle."""
    linked: tuple[int, ...] = ()
    """Indices of joints with a parallel linkage: their row turns by their angle minus that of the joint before."""
    still: tuple[tuple[int, float], ...] = ()
    """Indices and angles of rows that never turn: a pedestal under the arm, a tool on it."""
    tool: tuple[float, ...] = ()
    """The tool's pose in the frame after the last row, its first 3 rows of 4; (): that frame is the tool's."""
    slides: tuple[tuple[int, float], ...] = ()
    """Indices of sliding joints, and how far each is from 0 at most, in mm."""

    def __hash__(self) -> int:
        """Computed once, as caches look up a geometry for every pose."""
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash(
            (self.d, self.a, self.alpha, self.offset, self.linked, self.still, self.tool, self.slides)
        )

    @classmethod
    def of(cls, arm: Arm) -> Geometry:
        """Take the geometry of ``arm``: lengths in mm."""
        return cls(
            d=tuple(joint.d_mm for joint in arm.joints),
            a=tuple(joint.a_mm for joint in arm.joints),
            alpha=tuple(math.radians(joint.alpha_deg) for joint in arm.joints),
            offset=tuple(math.radians(joint.theta_offset_deg) for joint in arm.joints),
            linked=tuple(i for i, joint in enumerate(arm.joints) if joint.parallel_linkage),
            still=tuple(
                (i, math.radians(joint.home_deg))
                for i, joint in enumerate(arm.joints)
                if joint.motor is None and joint.range_deg[1] - joint.range_deg[0] <= STILL_DEG
            ),
            tool=tuple(value for row in arm.tool.matrix[:3] for value in row) if arm.tool else (),
            slides=tuple(
                (i, max(map(abs, joint.range_deg))) for i, joint in enumerate(arm.joints) if joint.slides
            ),
        )

    @cached_property
    def links(self) -> tuple[Link, ...]:
        """The rows."""
        rows = zip(self.d, self.a, self.alpha, self.offset, strict=True)
        return tuple(Link(d, a, *twist(alpha), offset) for d, a, alpha, offset in rows)

    def turns(self, angles: Sequence[T]) -> Sequence[T]:
        """The rotation of each row, or its sliding, without its offset, from the joints' angles (floats or arrays)."""
        if not self.linked:
            return angles
        turns = list(angles)
        for joint in self.linked:
            turns[joint] = angles[joint] - angles[joint - 1]
        return turns

    @cached_property
    def core(self) -> slice:
        """The joints between the rows that never turn at the base and at the tool; at least six."""
        still = {index for index, _ in self.still}
        first, end = 0, self.joints
        while end - first > _CLOSED_FORM and first in still:
            first += 1
        while end - first > _CLOSED_FORM and end - 1 in still:
            end -= 1
        return slice(first, end)

    @cached_property
    def moving(self) -> Geometry:
        """The geometry of the joints of ``core``, without a tool; itself if these are all and it has none."""
        if self.core == slice(0, self.joints):
            return self.bare
        first, end = self.core.start, self.core.stop
        d, a, alpha, offset = (row[self.core] for row in (self.d, self.a, self.alpha, self.offset))
        linked = tuple(joint - first for joint in self.linked)
        still = tuple((index - first, angle) for index, angle in self.still if first <= index < end)
        slides = tuple((index - first, far) for index, far in self.slides if first <= index < end)
        return Geometry(d, a, alpha, offset, linked, still, slides=slides)

    def holding(self, angles: Sequence[float]) -> Geometry:
        """The geometry whose sliding rows never move from where they are at a posture (joints,): for the closed form of
        an arm on a rail; itself without such rows."""
        if not self.slides:
            return self
        held = dict(self.still) | {row: angles[row] for row, _ in self.slides}
        return replace(self, still=tuple(sorted(held.items())))

    def depths(self, turns: Sequence[T]) -> Sequence[float | T]:
        """d of each row, of the sliding ones where they are; ``turns``: as ``turns`` returns it."""
        found: list[float | T] = list(self.d)
        for row, _ in self.slides:
            found[row] = self.d[row] + SLIDE_MM * turns[row]
        return found

    @cached_property
    def lengths(self) -> tuple[float, ...]:
        """Largest distance along the axis of each row from its frame to the next."""
        found = list(map(abs, self.d))
        for row, far in self.slides:
            found[row] += far
        return tuple(found)

    @cached_property
    def bare(self) -> Geometry:
        """The rows without a tool; itself if it has none."""
        return replace(self, tool=()) if self.tool else self

    @property
    def tool_length(self) -> float:
        """Distance of the tool's point from the frame after the last row."""
        return math.hypot(*self.tool[3::4])

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.d)

    @property
    def reach(self) -> float:
        """Sum of all lengths except the base height: a bound of the tool's distance from the foot of joint 2.

        With that of the base if it slides.
        """
        first = self.lengths[:1] if self.slides and self.slides[0][0] == 0 else ()
        return math.fsum([*first, *self.lengths[1:]]) + math.fsum(map(abs, self.a)) + self.tool_length


def twist(alpha: float) -> tuple[float, float]:
    """Cosine and sine of ``alpha`` (rad), exact at multiples of a quarter turn."""
    quarters = alpha / (math.pi / 2)
    if abs(quarters - round(quarters)) < 1e-12:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarters) % 4]
    return math.cos(alpha), math.sin(alpha)
