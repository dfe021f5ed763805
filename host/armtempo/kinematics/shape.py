"""The class of arms with a closed form, and their constants.

The paper's class: shoulder axis perpendicular to the base axis, elbow axis parallel to the shoulder axis, and
three perpendicular wrist axes that intersect in one point. Signs of the twists, a1, a2, a3, d1, d4, the
shoulder offsets d2 and d3, and the whole last row (d6, a6, alpha6) are free.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

from armtempo.basics.errors import InputError
from armtempo.kinematics.geometry import Geometry, twist

TOLERANCE = 1e-12
"""Lengths closer than this times the reach count as equal: a wrist centre that little beyond a border of
Eq. (3), or that near to axis 1, is taken to lie on it."""

ROUNDING = 1e-14
"""The same for a wrist centre within a border: just above what rounding makes of a pose. Elbow up and down
are two solutions farther in: from about 4e-7 rad of the elbow on."""


STRAIGHT_WRIST = 1e-10
"""Sine of theta5 up to which theta4 is taken from the previous posture, and the error of orientation, in rad,
that this allows."""


@dataclass(frozen=True)
class Shape:
    """Constants of the closed form. The twist signs are +1 or -1; all lengths in the geometry's unit.

    A negative a2 is taken as a positive one with joint 2 half a turn on, see ``turn2``.
    """

    height: float
    """d1, of the shoulder axis."""
    shoulder: float
    """a1, of the shoulder axis from the base axis."""
    offset: float
    """Of the arm's plane from the base axis: d2 and d3 together; exactly 0 if they cancel out."""
    upper: float
    """L2 of Eq. (4)."""
    fore: float
    """L34 of Eq. (4)."""
    bend: float
    """Angle of L34 against the elbow's x axis, in rad: arctan(d4 / a3) of Eq. (7), with its signs."""
    turn2: float
    """Half a turn if a2 is negative, else 0."""
    sign1: float
    sign2: float
    """+1 if alpha2 is 0, -1 if it is half a turn."""
    sign3: float
    sign4: float
    sign5: float
    flange: tuple[float, float, float]
    """The tool from the wrist centre, along the axes n, o, a of Eq. (1)."""
    flange_twist: tuple[float, float]
    """Cosine and sine of alpha6."""
    joint_offset: tuple[float, ...]
    near: float
    """Lengths below this count as zero."""
    blur: float
    """How far within a border a wrist centre still counts as on it."""

    @cached_property
    def farthest(self) -> float:
        """L2 + L34: radius of the wrist centre about the shoulder, elbow stretched."""
        return self.upper + self.fore

    @cached_property
    def nearest(self) -> float:
        """|L2 - L34|: the same, elbow folded."""
        return abs(self.upper - self.fore)

    @cached_property
    def excess(self) -> float:
        """L2² - L34²."""
        return (self.upper - self.fore) * (self.upper + self.fore)

    @cached_property
    def fore_turn(self) -> tuple[float, float]:
        """Cosine and sine of the angle from L34 to the elbow's x axis."""
        turn = self.turn2 - self.bend
        return math.cos(turn), math.sin(turn)

    @cached_property
    def turn2_sign(self) -> float:
        """-1 if a2 is negative, else 1."""
        return -1.0 if self.turn2 else 1.0

    @cached_property
    def wrist_offset(self) -> bool:
        """Whether joints 4 to 6 count from other than the angles of the formulas."""
        return any(self.joint_offset[3:])

    @cached_property
    def hand(self) -> float:
        """sign1 * sign2 * sign3."""
        return self.sign1 * self.sign2 * self.sign3

    @classmethod
    @lru_cache(maxsize=64)
    def of(cls, geometry: Geometry) -> Shape:
        """Take the constants of ``geometry.moving``; InputError with all reasons if it is outside the class."""
        reasons = refusals(geometry)
        geometry = geometry.moving
        if reasons:
            raise InputError(
                "no closed-form inverse for this arm: " + "; ".join(reasons), "use the numerical solver"
            )
        cosines, sines = zip(*map(twist, geometry.alpha), strict=True)
        sign2 = cosines[1]
        cos6, sin6 = cosines[5], sines[5]
        near = TOLERANCE * geometry.reach
        offset = geometry.d[1] + sign2 * geometry.d[2]
        backwards = geometry.a[1] < 0.0
        return cls(
            height=geometry.d[0],
            shoulder=geometry.a[0],
            offset=offset if abs(offset) > near else 0.0,
            upper=abs(geometry.a[1]),
            fore=math.hypot(geometry.a[2], geometry.d[3]),
            bend=math.atan2(-sign2 * sines[2] * geometry.d[3], geometry.a[2]) - backwards * math.pi,
            turn2=backwards * math.pi,
            sign1=sines[0],
            sign2=sign2,
            sign3=sines[2],
            sign4=sines[3],
            sign5=sines[4],
            flange=(geometry.a[5], geometry.d[5] * sin6, geometry.d[5] * cos6),
            flange_twist=(cos6, sin6),
            joint_offset=geometry.offset,
            near=near,
            blur=ROUNDING * geometry.reach,
        )


def refusals(geometry: Geometry) -> list[str]:
    """The reasons why ``geometry`` has no closed form; empty if it has one.

    Constant rows at the base and at the tool are ignored.
    """
    geometry = geometry.moving
    if geometry.joints != 6:
        return [f"it has {geometry.joints} joints, not 6"]
    if geometry.slides:
        return [f"joint {geometry.slides[0][0] + 1} slides"]
    if geometry.linked:
        return [f"a parallel linkage turns joint {geometry.linked[0] + 1}"]
    return [*_twist_refusals(geometry), *_length_refusals(geometry)]


def _twist_refusals(geometry: Geometry) -> list[str]:
    needed = (
        (0, "axis 2 is not square to axis 1", "90 or -90"),
        (1, "the shoulder and elbow axes (2 and 3) are not parallel", "0 or 180"),
        (2, "axis 4 is not square to axis 3", "90 or -90"),
        (3, "axis 5 is not square to axis 4", "90 or -90"),
        (4, "axis 6 is not square to axis 5", "90 or -90"),
    )
    return [
        f"{what} (alpha{row + 1} is {math.degrees(geometry.alpha[row]):g} degrees, not {wanted})"
        for row, what, wanted in needed
        if abs(twist(geometry.alpha[row])[0 if row != 1 else 1]) > 1e-12
    ]


def _length_refusals(geometry: Geometry) -> list[str]:
    near = TOLERANCE * geometry.reach
    wrist = {"a4": geometry.a[3], "a5": geometry.a[4], "d5": geometry.d[4]}
    reasons = [
        f"the wrist is not spherical: axes 4, 5 and 6 do not meet in one point ({name} is {length:g}, not 0)"
        for name, length in wrist.items()
        if abs(length) > near
    ]
    if abs(geometry.a[1]) <= near:
        reasons.append("the upper arm has no length (a2 is 0)")
    if math.hypot(geometry.a[2], geometry.d[3]) <= near:
        reasons.append("the forearm has no length (a3 and d4 are 0)")
    return reasons
