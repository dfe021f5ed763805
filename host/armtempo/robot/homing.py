"""Homing by limit switches: approach, back off, approach slowly, one joint after the other.

The board takes these motions while the joint's position is unknown: it assumes that the joint is where the
motion begins, and calls the position unknown again at the end. So the position is never wrong, only unknown,
until the last step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from armtempo_shared.messages import START_HOMING

from armtempo.basics.errors import InputError, LinkError
from armtempo.link import Client
from armtempo.model.arm import Arm
from armtempo.model.parts import DrivenJoint, Limits
from armtempo.planning import point_to_point
from armtempo.records import encoded_motion
from armtempo.robot.stop_request import StopRequest
from armtempo.robot.stored_motion import TEMPORARY, raise_fault, replay, store

FAST, SLOW = 0.2, 0.04
"""Fractions of the joint's limits in the first and in the second approach."""
BACK_DEG = 3.0
"""How far a joint backs off from its switch."""
_TOLERANCE_DEG = 0.1
"""A motion that ends this near to its end has not been stopped by a switch; more than a step of any joint."""


@dataclass(frozen=True)
class _Switch:
    """Where a joint's limit switch is."""

    side: int
    """-1 at the low end of the range, 1 at the high one."""
    trip_deg: float
    edge_deg: float
    """The end of the range on that side."""
    far_deg: float
    """The other end."""


def home_to_switches(client: Client, arm: Arm, stop: StopRequest) -> None:
    """Home every joint that has a switch of known angle; the others stay as they are.

    Raises InputError where no joint has one, LinkError where a switch does not trip, BoardError where the
    board refuses or a fault ends it, Stopped after a stop request.
    """
    switches = [(index, _switch(joint)) for index, joint in enumerate(arm.driven)]
    found = [(index, switch) for index, switch in switches if switch is not None]
    if not found:
        raise InputError(
            f"arm {arm.name!r} has no limit switch whose angle is known",
            "give low_deg or high_deg in a joint's [switches], or home by hand",
        )
    for index, switch in found:
        _JointHoming(client, arm, index, switch, stop).run()


def _switch(joint: DrivenJoint) -> _Switch | None:
    low_deg, high_deg = joint.range_deg
    switches = joint.switches
    if switches.low is not None and switches.low_deg is not None:
        return _Switch(-1, switches.low_deg, low_deg, high_deg)
    if switches.high is not None and switches.high_deg is not None:
        return _Switch(1, switches.high_deg, high_deg, low_deg)
    return None


@dataclass(frozen=True)
class _JointHoming:
    """Homing one joint."""

    client: Client
    arm: Arm
    index: int
    """Of the joint, among the driven ones."""
    switch: _Switch
    stop: StopRequest

    def run(self) -> None:
        """Both approaches, then the position is declared, a little away from the switch."""
        joint, switch = self.arm.driven[self.index], self.switch
        edge_deg, back_deg = switch.edge_deg, -switch.side * BACK_DEG
        if abs(self._move(switch.far_deg, edge_deg, FAST) - edge_deg) <= _TOLERANCE_DEG:
            raise LinkError(
                f"{joint.name}: its limit switch did not trip over the whole range",
                "check its wiring and its pin in the arm file",
            )
        self._move(edge_deg, edge_deg + back_deg, FAST)
        before_deg = edge_deg + 2 * back_deg
        way_deg = abs(self._move(before_deg, edge_deg, SLOW) - before_deg)
        if not 0.5 * BACK_DEG < way_deg < 1.5 * BACK_DEG:
            raise LinkError(
                (
                    f"{joint.name}: its limit switch tripped {way_deg:.2f} degrees after it had been left by "
                    f"{BACK_DEG:g}"
                ),
                "check its wiring and that it sits firmly",
            )
        outside_deg = max(0.0, switch.side * (switch.trip_deg - edge_deg))
        away_deg = switch.side * (BACK_DEG + outside_deg)
        self._move(edge_deg, edge_deg - away_deg, FAST)
        steps: list[int | None] = [None] * len(self.arm.driven)
        steps[self.index] = round((switch.trip_deg - away_deg) * joint.steps_per_deg)
        self.client.home(steps)

    def _move(self, from_deg: float, to_deg: float, fraction: float) -> float:
        """Move the joint, at a fraction of its limits; gives the angle at which it came to rest, degrees."""
        start_deg = self._posture_deg()
        end_deg = list(start_deg)
        start_deg[self.index], end_deg[self.index] = from_deg, to_deg
        slow_arm = _slowed(self.arm, fraction)
        trajectory = point_to_point.straight(TEMPORARY + "home", start_deg, end_deg, slow_arm)
        motion = encoded_motion.of_trajectory(trajectory, self.arm)
        key = store(self.client, motion.name, motion.data)
        end = replay(self.client, key, self.stop, flags=START_HOMING)
        self.client.remove(key.name)
        raise_fault(end)
        self.stop.check()
        return end.positions.commanded_steps[self.index] / self.arm.driven[self.index].steps_per_deg

    def _posture_deg(self) -> list[float]:
        """Where the joints are; for one that is unknown any angle will do, as it does not move."""
        status = self.client.status()
        joints = enumerate(zip(self.arm.driven, status.positions.commanded_steps, strict=True))
        return [
            steps / joint.steps_per_deg if status.joint_known(index) else joint.home_deg
            for index, (joint, steps) in joints
        ]


def _slowed(arm: Arm, fraction: float) -> Arm:
    """The arm with every limit multiplied by ``fraction``."""
    joints = tuple(replace(joint, limits=_scaled(joint.limits, fraction)) for joint in arm.joints)
    return replace(arm, joints=joints)


def _scaled(limits: Limits | None, factor: float) -> Limits | None:
    return None if limits is None else Limits(*(factor * value for value in limits.values))
