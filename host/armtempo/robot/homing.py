"""Homing by switches, joint by joint, or as the arm file groups them; the law is ``armtempo_shared.homing``.

The board accepts these motions while a joint's position is unknown: it assumes that the joint is at the
motion's start, and marks the position as unknown again at the end, until it is declared.

Coupled joints are homed one after the other: each moves alone, by all motors that turn it. The positions of these
motors are declared, and the joints move home, when the angles of all coupled joints are known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
from armtempo_shared.homing import ON_THE_WAY, Homing
from armtempo_shared.messages import START_HOMING, START_SEEKS, START_SWITCHES_BIT

from armtempo.basics.errors import InputError, LinkError
from armtempo.encoding import encoded_plan
from armtempo.link import Client
from armtempo.link.follow import MotionFollower
from armtempo.model import home_switches
from armtempo.model.arm import Arm
from armtempo.model.home_switches import HomeSwitch
from armtempo.model.parts import Limits
from armtempo.planning import point_to_point
from armtempo.robot import arm_state
from armtempo.robot.running import attended, follow, on_board, raise_failure
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
    if no joint has such a switch, or as ``home_switches.check``; LinkError if a switch does not trip, BoardError if
    the board refuses or a fault ends it, Stopped after a stop request.
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
    home_switches.check(arm, [index for group in groups for index in group])
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


class _GroupHoming(Homing):
    """Homing of some joints together; lengths are in degrees, or mm of a sliding joint.

    ``found_deg``: angles of joints that are found, but not declared, as their motors turn other joints too.
    """

    def __init__(
        self,
        client: Client,
        arm: Arm,
        stop: StopRequest,
        switches: dict[int, HomeSwitch],
        found_deg: dict[int, float],
        told: _Told,
    ) -> None:
        rows = [switch.row(index) for index, switch in switches.items()]
        super().__init__(rows, home_switches.names(arm), [1.0] * len(arm.driven))
        self._client, self._arm, self._stop = client, arm, stop
        self._switches, self._found_deg, self._told = switches, found_deg, told
        self._ends_deg: dict[int, float] = {}

    def run(self) -> None:
        """Find the switches, declare the positions, and move the joints home."""
        self._told(f"{self._format_names(self._switches)}: on the way to the switch")
        self.find()
        for index, switch in self._switches.items():
            self._found_deg[index] = switch.trip_deg - switch.side * switch.away_deg
        coupled = [self._arm.transmission.group(index) for index in self._switches]
        found = [index for group in coupled if set(group) <= self._found_deg.keys() for index in group]
        if found:
            self._declare(found)
            self._go_home(found)
            self._told(f"{self._format_names(found)}: at home", len(found))

    def seen(self, lengths: dict[int, int | float]) -> None:
        """Tell it."""
        for index, length_deg in lengths.items():
            sign = self._arm.driven[index].unit.sign
            self._told(
                f"{self._format_names([index])}: switch seen after {length_deg:.1f}{sign}; once more, slowly"
            )

    def error(self, problem: str, hint: str) -> LinkError:
        """As the failure of a link: nobody but the user can mend it."""
        return LinkError(problem, hint)

    def stands(self, joint: int) -> float:
        """After the last motion, in which it moved."""
        return self._ends_deg[joint]

    def _declare(self, found: list[int]) -> None:
        """Declare that joints are at the angles that were found for them."""
        angles = np.zeros(len(self._arm.driven))
        angles[found] = [self._found_deg.pop(index) for index in found]
        steps = self._arm.transmission.whole_steps(angles)
        self._client.home([value if motor in found else None for motor, value in enumerate(steps)])

    def _go_home(self, found: list[int]) -> None:
        stands_deg = self._posture_deg()
        home_deg = {index: self._arm.driven[index].home_deg for index in found}
        self.move({index: stands_deg[index] for index in found}, home_deg, False)
        stopped = [
            index
            for index in found
            if abs(self.stands(index) - home_deg[index]) > home_switches.TOLERANCE_DEG
        ]
        if stopped:
            raise self.failure(ON_THE_WAY, stopped)

    def _format_names(self, joints: Iterable[int]) -> str:
        return ", ".join(self._arm.driven[index].name for index in joints)

    def move(
        self,
        starts: dict[int, int | float],
        ends: dict[int, int | float],
        is_slow: bool,
        seeks: bool = False,
    ) -> int:
        """See ``Homing``; at a fraction of the joints' limits."""
        start_deg = self._posture_deg()
        end_deg = list(start_deg)
        for index in starts:
            start_deg[index], end_deg[index] = starts[index], ends[index]
        slow_arm = _slowed(self._arm, home_switches.SLOW if is_slow else home_switches.FAST)
        trajectory = point_to_point.straight("home", start_deg, end_deg, slow_arm)
        motion = encoded_plan.of_trajectory(trajectory, self._arm)
        flags = self._flags(starts) | START_SEEKS * seeks
        with on_board(self._client, motion.data) as key, attended(self._client, self._stop):
            follower = MotionFollower(self._client, self._client.start(key.name, key.crc, flags))
            end = follow(self._client, self._stop, follower).end
        tripped = self._client.status().fault_joint
        raise_failure(self._client, end)
        self._stop.check()
        ends_deg = self._arm.transmission.angles_of_steps(end.positions.commanded_steps)
        self._ends_deg = {index: float(ends_deg[index]) for index in starts}
        return tripped

    def _flags(self, moving: Iterable[int]) -> int:
        """The flags of the start: also whose switches end it, if motors turn that do not show who moves."""
        if not self._arm.coupling:
            return START_HOMING
        return START_HOMING | sum(1 << index for index in moving) << START_SWITCHES_BIT

    def _posture_deg(self) -> list[float]:
        """The joints' angles; of joints of unknown position, which do not move, those found or their home angles."""
        status = self._client.status()
        here_deg = arm_state.angles_deg(status, self._arm).tolist()
        known = arm_state.known_joints(status, self._arm)
        return [
            here_deg[index] if known[index] else self._found_deg.get(index, joint.home_deg)
            for index, joint in enumerate(self._arm.driven)
        ]


def _slowed(arm: Arm, fraction: float) -> Arm:
    """The arm with every limit multiplied by ``fraction``."""
    joints = tuple(replace(joint, limits=_scaled(joint.limits, fraction)) for joint in arm.joints)
    return replace(arm, joints=joints)


def _scaled(limits: Limits | None, factor: float) -> Limits | None:
    return None if limits is None else Limits(*(factor * value for value in limits.values))
