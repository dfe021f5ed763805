"""A homing run to limit switches: approach, back off, approach slowly, joint after joint.

The board takes these motions while the joint's position is unknown: it calls wherever the joint stands the
motion's start, and forgets it at the end. So the position is never wrong, only unknown, until the last step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from armtempo_shared.messages import START_HOMING

from armtempo.errors import InputError, LinkError
from armtempo.link import Board
from armtempo.model.arm import Arm, Joint, Limits
from armtempo.planning import point_to_point
from armtempo.records import encode
from armtempo.robot import operate
from armtempo.robot.stop_request import StopRequest

FAST, SLOW = 0.2, 0.04
"""Shares of the joint's limits in the first and in the second approach."""
_STEP_DEG = 0.1
"""So close to the end of a way counts as there; a step is less."""
BACK_DEG = 3.0
"""How far a joint backs off from its switch."""


@dataclass(frozen=True)
class _Switch:
    """Where a joint's switch is: ``side`` -1 at the low end, 1 at the high one."""

    side: int
    trip_deg: float
    edge_deg: float
    """The end of the range on that side."""
    far_deg: float


def homes_by_switch(joint: Joint) -> bool:
    """Whether a joint has a switch whose angle is known."""
    return _switch(joint) is not None


def home_to_switches(board: Board, arm: Arm, stop: StopRequest) -> None:
    """Home every joint that has a switch of known angle; the others stay as they are.

    Raises InputError where no joint has one, LinkError where a switch does not trip, BoardError where the
    board refuses or a fault ends it, KeyboardInterrupt after a stop request.
    """
    found = [index for index, joint in enumerate(arm.driven) if homes_by_switch(joint)]
    if not found:
        raise InputError(
            f"arm {arm.name!r} has no limit switch whose angle is known; give low_deg or high_deg in a "
            "joint's [switches], or home by hand"
        )
    for index in found:
        _home_joint(board, arm, index, stop)


def _switch(joint: Joint) -> _Switch | None:
    low_deg, high_deg = joint.range_deg
    switches = joint.switches
    if switches.low is not None and switches.low_deg is not None:
        return _Switch(-1, switches.low_deg, low_deg, high_deg)
    if switches.high is not None and switches.high_deg is not None:
        return _Switch(1, switches.high_deg, high_deg, low_deg)
    return None


def _home_joint(board: Board, arm: Arm, index: int, stop: StopRequest) -> None:
    joint = arm.driven[index]
    switch = _switch(joint)
    assert switch is not None
    edge_deg, back_deg = switch.edge_deg, -switch.side * BACK_DEG
    if abs(_move(board, arm, index, (switch.far_deg, edge_deg), FAST, stop) - edge_deg) <= _STEP_DEG:
        raise LinkError(f"{joint.name}: its limit switch did not trip over the whole range; check its wiring")
    _move(board, arm, index, (edge_deg, edge_deg + back_deg), FAST, stop)
    before_deg = edge_deg + 2 * back_deg
    way_deg = abs(_move(board, arm, index, (before_deg, edge_deg), SLOW, stop) - before_deg)
    if not 0.5 * BACK_DEG < way_deg < 1.5 * BACK_DEG:
        raise LinkError(
            f"{joint.name}: its limit switch tripped {way_deg:.2f} degrees after it had been left by {BACK_DEG:g}; "
            "check its wiring"
        )
    outside_deg = max(0.0, switch.side * (switch.trip_deg - edge_deg))
    away_deg = switch.side * (BACK_DEG + outside_deg)
    _move(board, arm, index, (edge_deg, edge_deg - away_deg), FAST, stop)
    steps: list[int | None] = [None] * len(arm.driven)
    steps[index] = round((switch.trip_deg - away_deg) * encode.steps_per_deg(joint))
    board.home(steps)


def _move(
    board: Board, arm: Arm, index: int, way_deg: tuple[float, float], share: float, stop: StopRequest
) -> float:
    """Move one joint along a way of its own; gives where on it the joint came to rest, degrees."""
    start_deg = _posture_deg(board, arm)
    end_deg = list(start_deg)
    start_deg[index], end_deg[index] = way_deg
    trajectory = point_to_point.straight(operate.TEMPORARY + "home", start_deg, end_deg, _slowed(arm, share))
    motion = operate.store(board, trajectory.name, operate.motion_data(trajectory, arm))
    end = operate.replay(board, motion, stop, flags=START_HOMING)
    board.remove(motion.name)
    operate.raise_fault(end)
    if stop.wanted:
        raise KeyboardInterrupt
    return end.stand.commanded_steps[index] / encode.steps_per_deg(arm.driven[index])


def _posture_deg(board: Board, arm: Arm) -> list[float]:
    """Where the joints stand; for one that is unknown any angle will do, as it does not move."""
    status = board.status()
    return [
        steps / encode.steps_per_deg(joint) if status.joint_known(index) else joint.home_deg
        for index, (joint, steps) in enumerate(zip(arm.driven, status.stand.commanded_steps, strict=True))
    ]


def _slowed(arm: Arm, share: float) -> Arm:
    """The arm with every limit multiplied by ``share``."""
    joints = tuple(replace(joint, limits=_part(joint.limits, share)) for joint in arm.joints)
    return replace(arm, joints=joints)


def _part(limits: Limits | None, share: float) -> Limits | None:
    if limits is None:
        return None
    return Limits(share * limits.speed_deg_s, share * limits.acceleration_deg_s2, share * limits.jerk_deg_s3)
