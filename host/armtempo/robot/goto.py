"""Motions that are not kept on the board: to a posture, and backwards between repetitions."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

from armtempo_shared import limits

from armtempo.basics.arrays import Array
from armtempo.basics.errors import LinkError
from armtempo.basics.progress import Progress
from armtempo.link import Client
from armtempo.link.board_messages import Sample
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point, room_check
from armtempo.records import encoded_motion
from armtempo.records.encoded_motion import EncodedMotion
from armtempo.robot import arm_state
from armtempo.robot.stop_request import StopRequest
from armtempo.robot.stored_motion import TEMPORARY, SampleSink, raise_fault, replay, store
from armtempo.splines.trajectory import Trajectory


@dataclass(frozen=True)
class MovePace:
    """How to go to a posture."""

    speed: float = 1.0
    """Part of the quickest."""
    line: bool = False
    """The tool goes in a straight line, instead of the joints each at an even pace."""


def go_to(
    client: Client,
    arm: Arm,
    target_deg: Array,
    stop: StopRequest,
    progress: Progress | None = None,
    pace: MovePace | None = None,
) -> None:
    """Move straight to a posture (J,); nothing happens if it is there.

    Raises LinkError if the position is unknown, BoardError if the board refuses or a fault ends the move,
    PlanError if the arm would leave its room, or the tool cannot go there in a line.
    """
    if not arm_state.is_at(client, arm, target_deg):
        here = arm_state.posture_deg(client, arm)
        trajectory = motion(arm, here, target_deg, pace or MovePace())
        move_once(client, encoded_motion.of_trajectory(trajectory, arm), stop, progress)


def motion(arm: Arm, here_deg: Array, target_deg: Array, pace: MovePace) -> Trajectory:
    """The motion from one posture (J,) to another; errors as in ``go_to``."""
    name = TEMPORARY + "goto"
    if not pace.line:
        found = point_to_point.straight(name, here_deg, target_deg, arm, pace.speed)
        room_check.check(arm, found)
        return found
    from armtempo.planning.line import line_move  # here, because it loads the whole planner

    target = point_to_point.posture(target_deg, arm)
    trajectory = line_move.straight_line(arm, here_deg.tolist(), target.tolist())
    return replace(line_move.slower(trajectory, pace.speed), name=name)


def go_back(client: Client, motion: EncodedMotion, stop: StopRequest) -> None:
    """Move from the end of a motion along its path to its start."""
    trajectory = point_to_point.backwards(motion.trajectory, TEMPORARY + "back")
    move_once(client, encoded_motion.of_trajectory(trajectory, motion.arm), stop)


def move_once(
    client: Client, motion: EncodedMotion, stop: StopRequest, progress: Progress | None = None
) -> None:
    """Store a motion, run it and remove it; BoardError if a fault ends it."""
    key = store(client, motion.name, motion.data)
    try:
        raise_fault(replay(client, key, stop, shown(progress)))
    finally:
        with suppress(LinkError):  # an earlier error says more
            client.remove(key.name)


def shown(progress: Progress | None) -> SampleSink:
    """A sink that tells how far the motion is, in seconds of its own time."""

    def show(sample: Sample, duration_s: float) -> None:
        if progress is not None:
            progress(sample.path_ticks / limits.TICK_HZ, duration_s)

    return show
