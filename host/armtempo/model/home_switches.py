"""The switches by which joints are homed: which, in what order, and how far they are approached and left.

The host drives homing by them (``robot/homing.py``), or the board alone, for a user's program.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from armtempo.basics.errors import InputError
from armtempo.model.parts import DrivenJoint

FAST, SLOW = 0.2, 0.04
"""Fractions of the joint's limits in the first and in the second approach."""
BACK_DEG = 3.0
"""Distance by which a joint backs off from its switch; here and below in mm of a sliding one."""
MARGIN_DEG = 5.0
"""How far beyond its range and its switch's angle a joint goes on for it: it may have stood beyond the other end."""
MOST_PRESSED_DEG = 12.0
"""Farthest that a joint is taken to have been beyond its switch."""
TOLERANCE_DEG = 0.1
"""A motion that stops this close to its end was not stopped by a switch; more than a step of any joint."""


class HomedArm(Protocol):
    """What is needed of an ``Arm``."""

    @property
    def name(self) -> str:
        """Of the arm."""

    @property
    def homing(self) -> tuple[tuple[str, ...], ...]:
        """Names of joints in the order of homing, those of an entry together."""

    @property
    def coupling(self) -> tuple[tuple[float, ...], ...]:
        """Of the joints; () if none are coupled."""

    @property
    def driven(self) -> tuple[DrivenJoint, ...]:
        """The joints with a motor."""


@dataclass(frozen=True)
class HomeSwitch:
    """Position of a joint's switch."""

    side: int
    """-1 at the low end of the range, 1 at the high end."""
    trip_deg: float
    edge_deg: float
    """The end of the range on that side."""
    far_deg: float
    """The other end."""

    @property
    def span_deg(self) -> float:
        """The whole range."""
        return abs(self.far_deg - self.edge_deg)

    @property
    def outside_deg(self) -> float:
        """Distance beyond the range at which it trips."""
        return max(0.0, self.side * (self.trip_deg - self.edge_deg))

    @property
    def farthest_deg(self) -> float:
        """Longest approach."""
        return self.span_deg + self.outside_deg + MARGIN_DEG

    @property
    def away_deg(self) -> float:
        """Distance by which it is left at last, into the range."""
        return BACK_DEG + self.outside_deg

    def row(self, joint: int) -> tuple[int | float, ...]:
        """Of a joint, from 0, for ``armtempo_shared.homing``; in degrees, or mm of a sliding one."""
        ends = self.trip_deg, self.edge_deg, self.span_deg, self.farthest_deg, self.away_deg
        return joint, self.side, *ends, BACK_DEG, MOST_PRESSED_DEG, TOLERANCE_DEG


def groups(arm: HomedArm) -> list[dict[int, HomeSwitch]]:
    """Joints (from 0, among the driven ones) that are homed together, in order, with their switches."""
    switches = {joint.name: (index, _of_joint(joint)) for index, joint in enumerate(arm.driven)}
    named = [name for group in arm.homing for name in group]
    listed = [*arm.homing, *((name,) for name in switches if name not in named)]
    found = [[switches[name] for name in group if name in switches] for group in listed]
    fitted = [{index: switch for index, switch in group if switch is not None} for group in found]
    return [group for group in fitted if group]


def order(arm: HomedArm) -> list[tuple[str, ...]]:
    """Names of the joints that are homed by switches, those that are homed together in an entry."""
    return [tuple(arm.driven[index].name for index in group) for group in groups(arm)]


@dataclass(frozen=True)
class SwitchProblem:
    """Why a joint cannot be homed as the arm file has its switches."""

    joint: str
    what: str
    next_step: str


def problems(arm: HomedArm) -> list[SwitchProblem]:
    """Switches that contradict each other, the range or the home position, or that the board cannot tell apart."""
    found = [problem for joint in arm.driven for problem in _of_one(joint)]
    for group in groups(arm):
        users: dict[int | str | None, str] = {}
        for index, switch in group.items():
            joint = arm.driven[index]
            pin = joint.switches.low if switch.side < 0 else joint.switches.high
            if pin in users:
                what = (
                    f"its switch is on input {pin}, as that of {users[pin]}, with which it is homed together"
                )
                found.append(
                    SwitchProblem(joint.name, what, "home them one after the other, or wire each to its own")
                )
            users[pin] = joint.name
    return found


def names(arm: HomedArm) -> list[list[str]]:
    """Name and unit of each driven joint, for what ``armtempo_shared.homing`` says of it."""
    return [[joint.name, joint.unit.word] for joint in arm.driven]


def check(arm: HomedArm, joints: Iterable[int]) -> None:
    """Raise InputError for the first of the ``problems`` of these joints (from 0, among the driven ones)."""
    names = [arm.driven[index].name for index in joints]
    for problem in problems(arm):
        if problem.joint in names:
            raise InputError(f"arm {arm.name!r}: {problem.joint}: {problem.what}", problem.next_step)


def _of_one(joint: DrivenJoint) -> list[SwitchProblem]:
    """The problems of one joint's switches."""
    switches, unit, (low, high) = joint.switches, joint.unit, joint.range_deg
    found = []
    if switches.low is not None and switches.low == switches.high:
        what = f"both its switches are on input {switches.low}, so that it could not leave the one at which it stands"
        found.append(SwitchProblem(joint.name, what, "wire each to an input of its own"))
    ends = (switches.low_deg, switches.high_deg)
    if ends[0] is not None and ends[1] is not None and ends[0] >= ends[1]:
        what = f"its low switch trips at {ends[0]:g} {unit.name}, not below its high one at {ends[1]:g}"
        keys = f"{unit.key('low_deg')} and {unit.key('high_deg')}"
        return [*found, SwitchProblem(joint.name, what, f"correct {keys} in its [switches]")]
    for side, pin, sign, trip_deg in (
        ("low", switches.low, -1, ends[0]),
        ("high", switches.high, 1, ends[1]),
    ):
        if pin is None or trip_deg is None:
            continue
        trips = f"its {side} switch trips at {trip_deg:g} {unit.name}"
        of_range = f"its range, {low:g} to {high:g}"
        key = unit.key(f"{side}_deg")
        edge, far = (low, high) if sign < 0 else (high, low)
        if sign * (trip_deg - far) <= 0.0:
            found.append(SwitchProblem(joint.name, f"{trips}, in all of {of_range}", f"correct {key}"))
        elif sign * (trip_deg - edge) > high - low:
            what = f"{trips}, farther away than all of {of_range}"
            found.append(SwitchProblem(joint.name, what, f"correct {key}"))
        elif sign * (joint.home_deg - trip_deg) > TOLERANCE_DEG:
            what = f"{trips}, but its home is at {joint.home_deg:g}, beyond it"
            found.append(SwitchProblem(joint.name, what, f"correct {key}, or {unit.key('home_deg')}"))
    return found


def check_board_can_home(arm: HomedArm) -> None:
    """Raise InputError if the board cannot home all joints of an arm by itself."""
    if arm.coupling:
        raise InputError(
            f"arm {arm.name!r} has coupled joints: the board cannot home them by itself",
            "home it from the host: 'armtempo home --switches'",
        )
    fitted = {index for group in groups(arm) for index in group}
    missing = [joint.name for index, joint in enumerate(arm.driven) if index not in fitted]
    if missing:
        low, high = arm.driven[0].unit.key("low_deg"), arm.driven[0].unit.key("high_deg")
        raise InputError(
            f"{', '.join(missing)}: no limit switch whose angle is known, so the board cannot home arm {arm.name!r} by "
            "itself",
            f"give each of them {low} or {high} in its [switches], or home from the host",
        )
    check(arm, fitted)


def _of_joint(joint: DrivenJoint) -> HomeSwitch | None:
    low_deg, high_deg = joint.range_deg
    switches = joint.switches
    if switches.low is not None and switches.low_deg is not None:
        return HomeSwitch(-1, switches.low_deg, low_deg, high_deg)
    if switches.high is not None and switches.high_deg is not None:
        return HomeSwitch(1, switches.high_deg, high_deg, low_deg)
    return None
