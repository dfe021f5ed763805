"""A motion for the board: its record, and the trajectory in it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import ClassVar, Literal

from armtempo_shared.limits import MAX_NAME
from armtempo_shared.wire import record_crc

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.encoding import decode, encode, made_with
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.model.sequence_plan import SequenceRow
from armtempo.planning import brake_time, point_to_point
from armtempo.splines.trajectory import Trajectory


@dataclass(frozen=True)
class MotionKey:
    """The board's identification of a stored motion: its name and the checksum of its record."""

    name: str
    crc: int


@dataclass(frozen=True, eq=False)
class EncodedMotion:
    """A motion that the board stores and replays, with the host's data about it."""

    name: str
    """Name on the board."""
    arm: Arm
    trajectory: Trajectory
    data: bytes
    """The motion record (layout: ``armtempo_shared.motion``)."""
    plan: Plan | None = None
    """The plan, if known."""
    is_sequence: ClassVar[Literal[False]] = False

    @property
    def key(self) -> MotionKey:
        """Its identification on the board."""
        return MotionKey(self.name, record_crc(self.data))

    @property
    def motions(self) -> tuple[EncodedMotion, ...]:
        """Itself: what a sequence runs are several."""
        return (self,)

    @property
    def rows(self) -> tuple[SequenceRow, ...]:
        """None; those of a sequence say what it does."""
        return ()

    @property
    def records(self) -> tuple[tuple[str, bytes], ...]:
        """What the board stores: name and record."""
        return ((self.name, self.data),)

    @property
    def start_deg(self) -> Array:
        """Start posture, degrees (J,)."""
        return self.trajectory(0.0)


def of_trajectory(trajectory: Trajectory, arm: Arm) -> EncodedMotion:
    """Encode a trajectory of ``arm`` with its times for braking and changes of speed.

    Raises InputError or PlanError if the board cannot replay it.
    """
    brakes = brake_time.of_motion(trajectory, [joint.limits for joint in arm.driven])
    return EncodedMotion(trajectory.name, arm, trajectory, encode.motion_record(trajectory, arm, brakes))


def way_back(motion: EncodedMotion) -> bytes:
    """The record with which the board makes a stored motion backwards."""
    back = point_to_point.backwards(motion.trajectory, motion.name)
    brakes = brake_time.of_motion(back, [joint.limits for joint in motion.arm.driven])
    return encode.way_back(motion.data, motion.name, brakes)


def of_plan(plan: Plan, name: str | None = None) -> EncodedMotion:
    """Encode the motion of a plan; ``name``: default from the job's name.

    Raises InputError for an invalid name, and as ``of_trajectory``.
    """
    if name is not None and not re.fullmatch(f"[A-Za-z0-9_-]{{1,{MAX_NAME}}}", name):
        raise InputError(
            f"{name!r} is not a valid name on the board",
            f"take 1 to {MAX_NAME} characters of a-z A-Z 0-9 - _",
        )
    board_name = name or re.sub(r"[^A-Za-z0-9_-]", "-", plan.job.name)[:MAX_NAME]
    encoded = of_trajectory(plan.trajectory, plan.arm)
    data = made_with.added(encoded.data, made_with.of_plan(plan))
    return EncodedMotion(board_name, plan.arm, plan.trajectory, data, plan)


def of_record(name: str, data: bytes, arm: Arm) -> EncodedMotion:
    """The motion of a record from the board; raises InputError if it is damaged or does not fit the arm."""
    trajectory = decode.trajectory(data, arm.transmission, name, f"arm {arm.name!r}")
    return EncodedMotion(name, arm, trajectory, data)
