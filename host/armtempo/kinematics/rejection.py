"""Reasons for the rejection of a solution, as numbers and as text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from armtempo.kinematics import formulas
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.shape import Shape
from armtempo.kinematics.solutions import (
    DUPLICATE,
    ELBOW_STRETCHED,
    IN_OFFSET,
    OUT_OF_REACH,
    TOO_FAR,
    TOO_NEAR,
    PoseSolutions,
)
from armtempo.model.joint_unit import DEG, MM


@dataclass(frozen=True)
class Rejection:
    """One reason."""

    kind: str
    """"unreachable", "duplicate" or "range"."""
    text: str
    amount: float = 0.0
    """Excess: a length for "unreachable", in the joint's unit for "range" (negative below the range)."""
    joint: int | None = None
    """For "range": 1 to 6."""
    inequality: int | None = None
    """For "unreachable": the line of Eq. (3) that is violated; None: the shoulder offset's own."""
    twin: int | None = None
    """For "duplicate": the solution it equals, 1 to 8."""


@dataclass(frozen=True, eq=False)
class WristCentre:
    """The wrist centre of a pose, for the regions of Fig. 3."""

    shape: Shape
    position: tuple[float, float, float]
    """x, y, z from the base."""
    unit: str
    """Of the lengths, for the texts."""

    @cached_property
    def _from_shoulder(self) -> list[float]:
        """Distance from the shoulder's axis, with the base turned either way."""
        x, y, z = self.position
        planar = math.sqrt(x * x + y * y)
        square = (
            0.0 if formulas.on_axis(self.shape, planar) else formulas.square_of_forward(self.shape, planar)
        )
        if square < 0.0:
            return [math.nan] * 2
        forward = math.sqrt(square)
        return [math.hypot(*formulas.to_shoulder(self.shape, way * forward, z)) for way in (1.0, -1.0)]

    @property
    def beyond(self) -> float:
        """Least excess over the reach, front or rear; inf if neither is out of reach."""
        if math.isnan(self._from_shoulder[0]):
            return abs(self.shape.offset) - math.hypot(*self.position[:2])
        gaps = [max(r - self.shape.farthest, self.shape.nearest - r) for r in self._from_shoulder]
        return min((gap for gap in gaps if gap > 0.0), default=math.inf)

    def swing_rad(self, index: int, moved: float) -> float:
        """Bound, to first order, of the change of joints 1 to 3 of solution ``index`` for a centre moved by this."""
        shape, r = self.shape, self._from_shoulder[index // 4]
        x, y, _ = self.position
        forward = math.sqrt(max(formulas.square_of_forward(shape, math.sqrt(x * x + y * y)), 0.0))
        opened, folded = (
            (shape.farthest - r) * (shape.farthest + r),
            (r - shape.nearest) * (r + shape.nearest),
        )
        # twice the area of the triangle of shoulder, elbow and wrist centre
        area = 0.5 * math.sqrt(max(opened * folded, 0.0))
        if not forward or not area:
            return math.inf
        first = moved / forward
        return first + (moved + abs(shape.offset) * first) * shape.farthest / area

    def unreachable(self, index: int, outcome: int) -> Rejection:
        """Say which inequality of Eq. (3) it violates for solution ``index``."""
        shape, unit = self.shape, self.unit
        if outcome == IN_OFFSET:
            return _in_offset(shape, math.hypot(*self.position[:2]), unit)
        r = self._from_shoulder[index // 4]
        if outcome == TOO_NEAR:
            text = (
                f"out of reach by {shape.nearest - r:.6g} {unit}: wrist centre {r:.6g} {unit} from the shoulder "
                f"axis, at least |L2 - L34| = {shape.nearest:.6g} {unit} needed (Eq. (3), line 4)"
            )
            return Rejection("unreachable", text, shape.nearest - r, inequality=4)
        assert outcome == TOO_FAR
        line = _outer_line(shape, float(self.position[2]))
        text = (
            f"out of reach by {r - shape.farthest:.6g} {unit}: wrist centre {r:.6g} {unit} from the shoulder "
            f"axis, at most L2 + L34 = {shape.farthest:.6g} {unit} allowed (Eq. (3), line {line})"
        )
        return Rejection("unreachable", text, r - shape.farthest, inequality=line)


def _in_offset(shape: Shape, planar: float, unit: str) -> Rejection:
    missing = abs(shape.offset) - planar
    text = (
        f"out of reach by {missing:.6g} {unit}: wrist centre {planar:.6g} {unit} from axis 1, "
        f"at least the shoulder offset of d2 and d3, {abs(shape.offset):.6g} {unit}, needed"
    )
    return Rejection("unreachable", text, missing)


def _outer_line(shape: Shape, z: float) -> int:
    """Line 2 or 3 of Eq. (3) if the wrist centre is too low or too high for any distance from axis 1."""
    highest = math.sqrt(max(shape.farthest**2 - shape.shoulder**2, 0.0))
    if z <= shape.height - highest:
        return 2
    return 3 if z >= shape.height + highest else 1


def duplicate(index: int, singular: int) -> Rejection:
    """Say which earlier solution the one at ``index`` equals, on a border."""
    if index & 2 and singular & ELBOW_STRETCHED:
        twin, why = index - 2, "the elbow is stretched or folded"
    else:
        twin, why = index ^ 6, "the wrist centre is as near to axis 1 as the shoulder offset allows"
    return Rejection("duplicate", f"equals solution {twin + 1}: {why}", twin=twin + 1)


def out_of_range(ranges: Ranges, angles: Sequence[float]) -> tuple[Rejection, ...]:
    """Say which joints are outside their ranges and by how much; ``angles`` (joints,) from ``Ranges.placed``."""
    return tuple(
        Rejection("range", _range_text(ranges, joint, angles[joint]), math.degrees(excess), joint=joint + 1)
        for joint, excess in enumerate(ranges.excess(angles))
        if excess
    )


def _range_text(ranges: Ranges, joint: int, angle: float) -> str:
    low, high, at = map(math.degrees, (*ranges.ends[joint], angle))
    side, by = ("below", low - at) if at < low else ("above", at - high)
    unit = (MM if joint in ranges.slides else DEG).name
    return f"joint {joint + 1} at {at:.4g} {unit} is {by:.4g} {unit} {side} its range {low:g} to {high:g}"


def reasons(
    wrist: WristCentre, solutions: PoseSolutions, index: int, ranges: Ranges, placed: Sequence[float]
) -> tuple[Rejection, ...]:
    """All reasons against solution ``index``, 0 to 7, with angles (6,) from ``Ranges.placed``."""
    outcome = solutions.outcome[index]
    if outcome in OUT_OF_REACH:
        return (wrist.unreachable(index, outcome),)
    outside = out_of_range(ranges, placed)
    return (duplicate(index, solutions.singular[index]), *outside) if outcome == DUPLICATE else outside


def table(rejections: Iterable[Sequence[Rejection]]) -> str:
    """The reasons against solutions 1, 2, ..., equal ones together, as lines to hang under a message."""
    numbers: dict[str, list[str]] = {}
    for number, reasons_of_one in enumerate(rejections, 1):
        text = "; ".join(reason.text for reason in reasons_of_one)
        numbers.setdefault(text, []).append(str(number))
    rows = [("solution", "why not"), *((", ".join(which), text) for text, which in numbers.items())]
    width = max(len(which) for which, _ in rows)
    return "".join(f"\n  {which:<{width}}  {text}" for which, text in rows)
