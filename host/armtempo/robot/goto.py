"""Motions that are run once: to a posture, to a start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from armtempo_shared import limits
from numpy.typing import ArrayLike

from armtempo.basics.arrays import Array
from armtempo.basics.errors import LinkError
from armtempo.basics.progress import Progress
from armtempo.encoding import encoded_plan
from armtempo.encoding.encoded_plan import Encoded
from armtempo.link import Client
from armtempo.link.board_messages import Sample
from armtempo.link.follow import Followed, MotionFollower
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.planning import point_to_point, workspace_check
from armtempo.ports.names import is_sim
from armtempo.robot import arm_state, running
from armtempo.robot.running import attended, follow, nothing, raise_failure
from armtempo.robot.stop_request import StopRequest
from armtempo.splines.trajectory import Trajectory

Where = Plan | Encoded | Path | str | ArrayLike
"""A posture: its name in the arm file, the driven joints' angles in degrees (J,), or the start of a motion
(or of its file) or sequence."""
_NAME = "goto"


@dataclass(frozen=True)
class MovePace:
    """How to move to a posture."""

    speed: float = 1.0
    """Fraction of the fastest move."""
    line: bool = False
    """Move the tool in a straight line instead of the joints."""


def go_to(
    client: Client,
    arm: Arm,
    target_deg: Array,
    stop: StopRequest,
    progress: Progress | None = None,
    pace: MovePace | None = None,
) -> None:
    """Move straight to a posture (J,); does nothing if the arm is there.

    Raises LinkError if the position is unknown, BoardError if the board refuses or a fault ends the move,
    PlanError if the arm would leave its workspace, or the tool cannot reach it in a straight line.
    """
    status = arm_state.known_status(client, arm)
    if not arm_state.stands_at(status, arm, target_deg):
        here = arm_state.angles_deg(status, arm)
        trajectory = motion(arm, here, target_deg, pace or MovePace())
        data = encoded_plan.of_trajectory(trajectory, arm).data
        move_once(client, data, stop, _shown(progress, trajectory.duration_s))


def motion(arm: Arm, here_deg: Array, target_deg: Array, pace: MovePace) -> Trajectory:
    """The motion from one posture (J,) to another; errors as in ``go_to``."""
    target = point_to_point.posture(target_deg, arm)
    if not pace.line:
        begin_deg = here_deg + point_to_point.ahead(here_deg, target, arm) * (target - here_deg)
        found = point_to_point.straight(_NAME, begin_deg, target, arm, pace.speed)
        point_to_point.check_switches(here_deg, target, arm)
        workspace_check.tell_start(arm, here_deg)
        workspace_check.check(arm, found, outwards=True)
        return found
    from armtempo.planning import planner  # imported here, because it loads everything that plans

    trajectory = planner.straight_line(arm, here_deg.tolist(), target.tolist())
    return replace(planner.slower(trajectory, pace.speed), name=_NAME)


def move_once(
    client: Client, data: bytes, stop: StopRequest, take: Callable[[Followed], object] = nothing
) -> None:
    """Run a motion record once; raises BoardError if a fault ends it."""
    with running.on_board(client, data) as key, attended(client, stop):
        end = follow(client, stop, MotionFollower(client, client.start(key.name, key.crc)), take).end
    raise_failure(client, end)


def _shown(progress: Progress | None, duration_s: float) -> Callable[[Followed], object]:
    """Reports samples as the progress in seconds of the motion's own time."""

    def show(event: Followed) -> None:
        if progress is not None and isinstance(event, Sample):
            progress(event.path_ticks / limits.TICK_HZ, duration_s)

    return show


@dataclass
class StartPosition:
    """Moves a virtual arm of one board to a start position; checks the position of a real arm."""

    client: Client
    port: str
    moved: bool = False
    """Whether this arm was moved or homed by this object; then its position is not assumed."""

    def home_virtual_arm(self, arm: Arm) -> None:
        """Declare that a virtual arm that has not moved yet is at home."""
        if is_sim(self.port) and not self.moved:
            arm_state.home_unknown(self.client, arm)
        self.moved = True

    def take(self, arm: Arm, start_deg: Array | None, name: str, advice: str, stop: StopRequest) -> None:
        """Move a virtual arm to ``start_deg``, degrees (J,); None: any start.

        Raises LinkError with ``advice`` if a real arm is not there.
        """
        if is_sim(self.port):
            self.home_virtual_arm(arm)
            if start_deg is not None:
                go_to(self.client, arm, start_deg, stop)
        elif start_deg is not None and not arm_state.is_at(self.client, arm, start_deg):
            raise LinkError(f"the arm is not at the start of {name}", advice)


def posture_deg(where: Where, arm: Arm) -> Array:
    """The driven joints' angles of a posture, degrees (J,); for a sequence without motions: the home posture.

    Raises InputError for an unknown name, or a posture that does not fit the arm.
    """
    if isinstance(where, Path) or (isinstance(where, str) and where.endswith(".json")):
        where = Plan.load(where)
    if isinstance(where, Plan | Encoded):
        start_deg = where.arm.home_deg if where.start_deg is None else where.start_deg
        return point_to_point.posture(start_deg, where.arm)
    if isinstance(where, str):
        from armtempo.planning import via_points  # here, because angles need no inverse kinematics

        return via_points.posture_deg(arm, arm.posture(where))
    return point_to_point.posture(where, arm)
