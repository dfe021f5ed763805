"""Homing by switches: approach, back off, approach slowly, go home; joint by joint, or as the arm file groups them.

The board accepts these motions while a joint's position is unknown: it assumes that the joint is at the
motion's start, and marks the position as unknown again at the end, until it is declared. A switch that trips
ends the motion of all its joints; the others continue in another motion.

Coupled joints are homed one after the other: each moves alone, by all motors that turn it. The positions of these
motors are declared, and the joints move home, when the angles of all coupled joints are known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from armtempo_shared.messages import START_HOMING, START_SWITCHES_BIT

from armtempo.basics.errors import InputError, LinkError
from armtempo.encoding import encoded_motion
from armtempo.link import Client
from armtempo.link.follow import MotionFollower
from armtempo.model import home_switches
from armtempo.model.arm import Arm
from armtempo.model.home_switches import HomeSwitch
from armtempo.model.parts import Limits
from armtempo.planning import point_to_point
from armtempo.robot import arm_state
from armtempo.robot.running import attended, follow, put_once, raise_fault
from armtempo.robot.stop_request import StopRequest

HomingProgress = Callable[[str, int, int], object]
"""Called with what happens now or was seen, by joint; how many joints are at home, and how many are homed."""


def silent(text: str, done: int, whole: int) -> None:
    """Nobody is told."""


def home_to_switches(
    client: Client,
    arm: Arm,
    stop: StopRequest,
    joint: int | None = None,
    progress: HomingProgress = silent,
) -> None:
    """Home every joint that has a switch of known angle, in the order of ``arm.homing``; the others do not move.

    ``joint``: only this one, from 0, and those that are coupled with it. Ends at the home posture. Raises InputError
    if no joint has such a switch, LinkError if a switch does not trip, BoardError if the board refuses or a fault
    ends it, Stopped after a stop request.
    """
    wanted = range(len(arm.driven)) if joint is None else arm.transmission.group(joint)
    groups = [
        {index: group[index] for index in group if index in wanted} for group in home_switches.groups(arm)
    ]
    groups = [group for group in groups if group]
    _check_coupled(arm, {index for group in groups for index in group})
    if not groups:
        of = f"arm {arm.name!r}" if joint is None else arm.driven[joint].name
        raise InputError(
            f"{of} has no limit switch whose angle is known",
            "give low_deg or high_deg (of a sliding joint low_mm or high_mm) in a joint's [switches], or home by hand"
            if arm.slides
            else "give low_deg or high_deg in a joint's [switches], or home by hand",
        )
    told = _Told(progress, sum(map(len, groups)))
    found_deg: dict[int, float] = {}
    for group in groups:
        _GroupHoming(client, arm, stop, group, found_deg, told).run()


class _Told:
    """Counts the joints that are at home for the progress."""

    def __init__(self, progress: HomingProgress, whole: int) -> None:
        self._progress, self._whole, self._done = progress, whole, 0

    def __call__(self, text: str, home: int = 0) -> None:
        """What happens; ``home``: how many more joints are at home."""
        self._done += home
        self._progress(text, self._done, self._whole)


def _check_coupled(arm: Arm, fitted: set[int]) -> None:
    """Raise InputError if only some of the joints that are coupled can be homed."""
    for group in arm.transmission.groups:
        missing = [arm.driven[index].name for index in group if index not in fitted]
        if missing and len(missing) < len(group):
            others = ", ".join(arm.driven[index].name for index in group if index in fitted)
            raise InputError(
                f"{', '.join(missing)}: no limit switch whose angle is known, but coupled with {others}: their motors' "
                "positions follow only from the angles of all of them",
                "give each of them a switch with low_deg or high_deg, or home by hand",
            )


@dataclass(frozen=True)
class _GroupHoming:
    """Homing of some joints together. Distances are positive towards the joint's switch."""

    client: Client
    arm: Arm
    stop: StopRequest
    switches: dict[int, HomeSwitch]
    found_deg: dict[int, float]
    """Angles of joints that are found, but not declared: their motors turn other joints too."""
    told: _Told

    def run(self) -> None:
        """Make both approaches, back off, declare the positions, and move the joints home."""
        whole = {index: switch.farthest_deg for index, switch in self.switches.items()}
        self.told(f"{self._names(whole)}: on the way to the switch")
        gone_deg = self._approach(whole, home_switches.FAST)
        for index, distance_deg in gone_deg.items():
            sign = self.arm.driven[index].unit.sign
            self.told(
                f"{self._names([index])}: switch seen after {distance_deg:.1f}{sign}; once more, slowly"
            )
        self._approach_again()
        away_deg = {index: switch.away_deg for index, switch in self.switches.items()}
        self._leave(away_deg)
        for index, distance_deg in away_deg.items():
            switch = self.switches[index]
            self.found_deg[index] = switch.trip_deg - switch.side * distance_deg
        coupled = [self.arm.transmission.group(index) for index in self.switches]
        found = [index for group in coupled if set(group) <= self.found_deg.keys() for index in group]
        if found:
            self._declare(found)
            self._go_home(found)
            self.told(f"{self._names(found)}: at home", len(found))

    def _approach_again(self) -> None:
        """Back off and approach slowly; a joint whose switch trips at once started on it, and backs off further."""
        left = dict.fromkeys(self.switches, 0.0)
        pressed = list(self.switches)
        while pressed:
            self._leave(dict.fromkeys(pressed, home_switches.BACK_DEG))
            moves = self._approach(dict.fromkeys(pressed, 2 * home_switches.BACK_DEG), home_switches.SLOW)
            pressed = []
            for index, distance_deg in moves.items():
                left[index] += home_switches.BACK_DEG - distance_deg
                if distance_deg > 1.5 * home_switches.BACK_DEG:
                    raise LinkError(
                        f"{self.arm.driven[index].name}: its limit switch tripped {distance_deg:.2f} "
                        f"{self.arm.driven[index].unit.word} after it had been left by {home_switches.BACK_DEG:g}",
                        "check its wiring and that it sits firmly",
                    )
                if distance_deg < 0.5 * home_switches.BACK_DEG:
                    pressed.append(index)
            if stuck := [index for index in pressed if left[index] > home_switches.MOST_PRESSED_DEG]:
                self._fail_pressed(stuck)

    def _fail_pressed(self, stuck: list[int]) -> None:
        levels = ", ".join(f'active = "{self.arm.driven[index].switches.active}"' for index in stuck)
        raise LinkError(
            f"{self._names(stuck)}: its limit switch is still pressed {home_switches.MOST_PRESSED_DEG:g} "
            f"{self.arm.driven[stuck[0]].unit.word} away from where it tripped",
            f"its level is probably inverted: the arm file has {levels}; or it is stuck, or wired to another pin",
        )

    def _approach(self, distances_deg: dict[int, float], fraction: float) -> dict[int, float]:
        """Move joints towards their switches until all have tripped; returns the distance of each, degrees."""
        left = dict(distances_deg)
        gone = dict.fromkeys(left, 0.0)
        while left:
            moved, tripped = self._towards(left, fraction)
            for index, distance_deg in moved.items():
                gone[index] += distance_deg
                left[index] -= distance_deg
            missed = [
                index for index, distance_deg in left.items() if distance_deg <= home_switches.TOLERANCE_DEG
            ]
            if tripped in left:
                del left[tripped]
            elif missed:
                raise LinkError(
                    f"{self._names(missed)}: no limit switch tripped within {distances_deg[missed[0]]:.0f} "
                    f"{self.arm.driven[missed[0]].unit.word}, its range and a margin",
                    "check its wiring, its pin and its level ('active') in the arm file, and where the joint stands",
                )
            elif max(moved.values()) <= home_switches.TOLERANCE_DEG:
                raise LinkError(
                    f"{self._names(left)}: a switch of another joint stops it",
                    "check the wiring of the switches",
                )
        return gone

    def _towards(self, left: dict[int, float], fraction: float) -> tuple[dict[int, float], int]:
        """One motion towards the switches, at most over a range; returns each joint's distance, and whose
        switch tripped."""
        moves = {}
        for index, distance_deg in left.items():
            switch = self.switches[index]
            step_deg = min(distance_deg, switch.span_deg)
            moves[index] = (switch.edge_deg - switch.side * step_deg, switch.edge_deg)
        ends, tripped = self._move(moves, fraction)
        return {index: abs(end_deg - moves[index][0]) for index, end_deg in ends.items()}, tripped

    def _leave(self, distances_deg: dict[int, float]) -> None:
        moves = {}
        for index, distance_deg in distances_deg.items():
            switch = self.switches[index]
            moves[index] = (switch.edge_deg, switch.edge_deg - switch.side * distance_deg)
        self._move(moves, home_switches.FAST)

    def _declare(self, found: list[int]) -> None:
        """Declare that joints are at the angles that were found for them."""
        angles = np.zeros(len(self.arm.driven))
        angles[found] = [self.found_deg.pop(index) for index in found]
        steps = self.arm.transmission.whole_steps(angles)
        self.client.home([value if motor in found else None for motor, value in enumerate(steps)])

    def _go_home(self, found: list[int]) -> None:
        stands_deg = self._posture_deg()
        moves = {index: (stands_deg[index], self.arm.driven[index].home_deg) for index in found}
        ends, _ = self._move(moves, home_switches.FAST)
        stopped = [
            index
            for index, end_deg in ends.items()
            if abs(end_deg - moves[index][1]) > home_switches.TOLERANCE_DEG
        ]
        if stopped:
            raise LinkError(
                f"{self._names(stopped)}: a switch tripped on the way to its home posture",
                f"check {self.arm.driven[stopped[0]].unit.key('home_deg')} and the switches in the arm file",
            )

    def _names(self, joints: Iterable[int]) -> str:
        return ", ".join(self.arm.driven[index].name for index in joints)

    def _move(
        self, turns_deg: dict[int, tuple[float, float]], fraction: float
    ) -> tuple[dict[int, float], int]:
        """Move joints at a fraction of their limits, each from and to an angle.

        Returns the angles at which they came to rest, degrees, and the joint whose switch ended it (or NO_JOINT).
        """
        start_deg = self._posture_deg()
        end_deg = list(start_deg)
        for index, (from_deg, to_deg) in turns_deg.items():
            start_deg[index], end_deg[index] = from_deg, to_deg
        slow_arm = _slowed(self.arm, fraction)
        trajectory = point_to_point.straight("home", start_deg, end_deg, slow_arm)
        motion = encoded_motion.of_trajectory(trajectory, self.arm)
        key, flags = put_once(self.client, motion.data), self._flags(turns_deg)
        with attended(self.client, self.stop):
            follower = MotionFollower(self.client, self.client.start(key.name, key.crc, flags))
            end = follow(self.client, self.stop, follower).end
        tripped = self.client.status().fault_joint
        raise_fault(end)
        self.stop.check()
        ends_deg = self.arm.transmission.angles_of_steps(end.positions.commanded_steps)
        return {index: float(ends_deg[index]) for index in turns_deg}, tripped

    def _flags(self, moving: Iterable[int]) -> int:
        """The flags of the start: also whose switches end it, if motors turn that do not show who moves."""
        if not self.arm.coupling:
            return START_HOMING
        return START_HOMING | sum(1 << index for index in moving) << START_SWITCHES_BIT

    def _posture_deg(self) -> list[float]:
        """The joints' angles; of joints of unknown position, which do not move, those found or their home angles."""
        status = self.client.status()
        here_deg = arm_state.angles_deg(status, self.arm).tolist()
        known = arm_state.known_joints(status, self.arm)
        return [
            here_deg[index] if known[index] else self.found_deg.get(index, joint.home_deg)
            for index, joint in enumerate(self.arm.driven)
        ]


def _slowed(arm: Arm, fraction: float) -> Arm:
    """The arm with every limit multiplied by ``fraction``."""
    joints = tuple(replace(joint, limits=_scaled(joint.limits, fraction)) for joint in arm.joints)
    return replace(arm, joints=joints)


def _scaled(limits: Limits | None, factor: float) -> Limits | None:
    return None if limits is None else Limits(*(factor * value for value in limits.values))
