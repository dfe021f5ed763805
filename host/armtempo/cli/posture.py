"""``armtempo goto`` and ``home``, and their WHERE: a name, angles, a via point or a trajectory file."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.cli import options, resolve, results, state, typed_pose
from armtempo.cli.options import BoardOptions
from armtempo.cli.results import ProgressBar
from armtempo.cli.typed_pose import TypedPose
from armtempo.model import via_table
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.posture import HOME as HOME
from armtempo.model.posture import is_via as is_via
from armtempo.model.posture import name_problem
from armtempo.model.tool_pose import BASE, Pose
from armtempo.planning import point_to_point
from armtempo.robot.board import Board
from armtempo.robot.stop_request import Stopped


@click.command("goto", cls=options.TakesNumbers)
@click.argument("where", nargs=-1, shell_complete=options.files)
@typed_pose.options
@options.frame
@click.option("--line", is_flag=True, help="Move the tool in a straight line, turning evenly.")
@options.tool
@options.holds
@options.job
@options.board(options.arm_of_board, options.replace_arm, options.altered)
def goto(
    where: tuple[str, ...],
    frame: str,
    line: bool,
    tool: str | None,
    holds: str | None,
    job_path: Path | None,
    given: BoardOptions,
    **pose: Any,
) -> None:
    """Move straight to a posture, or the tool to a pose.

    WHERE: 'home' or another posture of the arm file, angles such as '0,-60,40', a via point of the job such
    as P0, or a trajectory file or a planned sequence (its start). Or give a pose by --position, alone or with
    an orientation, in the base or in a --frame of the arm file: the arm takes the nearest posture that reaches it.
    All joints move together, within their limits; with --line the tool moves in a straight line. The arm must be
    homed. Ctrl-C, or 'armtempo stop' in another terminal, brakes.
    """
    typed = TypedPose(**pose).pose()
    if bool(where) == (typed is not None):
        raise InputError("give a posture as WHERE, or a pose by --position", "armtempo goto home")
    if where and frame != BASE:
        raise InputError("--frame is the frame of --position", "leave it out with WHERE")
    if len(where) > 1:
        raise InputError(
            f"{len(where)} values for one posture",
            f"write them as one, with commas: armtempo goto {','.join(where)}",
        )
    wanted = typed or NamedPosture.of(where[0], given.arm_path, given.altered)
    named = wanted.arm if isinstance(wanted, NamedPosture) else resolve.named_arm(given.arm_path)
    if named is not None:  # what is wrong is reported before a port is opened
        _target(wanted, named.with_tool(tool).holding(holds), frame, job_path)
    with resolve.board(given, named) as board:
        arm = resolve.arm_of_board(board, named).with_tool(tool).holding(holds)
        target = _target(wanted, arm, frame, job_path)
        board.configure(arm, replace=given.replace_arm)
        try:
            with ProgressBar("moving") as progress:
                board.goto(target, progress, line=line)
        except Stopped:
            print_position(board, given.as_json)
            raise
        print_position(board, given.as_json)


def _target(wanted: NamedPosture | Pose, arm: Arm, frame: str, job_path: Path | None) -> Array | Pose:
    """Where to go; raises InputError if the arm has no such place."""
    return (
        wanted.angles_deg(arm, job_path) if isinstance(wanted, NamedPosture) else arm.in_base(wanted, frame)
    )


@click.command("home", cls=options.TakesNumbers)
@click.argument("where", default=HOME, shell_complete=options.files)
@click.option("--switches", is_flag=True, help="Find the position by moving to the limit switches.")
@click.option("--joint", metavar="JOINT", help="Home this joint alone, by its number (from 1) or name.")
@options.job
@options.board(options.arm_of_board, options.replace_arm, options.altered)
def home(where: str, switches: bool, joint: str | None, job_path: Path | None, given: BoardOptions) -> None:
    """Declare the arm's position.

    WHERE: angles such as '0,-60,40', a posture of the arm file by its name, a via point of the job such as
    P0, or a trajectory file (its start). Default: the home posture of the arm file. Nothing moves; afterwards
    motions may start. With --switches the joints that have a switch of known angle move: to it, off it,
    slowly to it again, and to their home angle; in the order of 'homing' in the arm file, by default one
    after the other. With --joint only that joint, and those that are coupled with it, are homed or declared.
    """
    if joint is not None and where != HOME:
        raise InputError(
            "WHERE and --joint exclude each other", "a joint alone is declared at its home angle"
        )
    if switches and where != HOME:
        raise InputError(
            "WHERE and --switches exclude each other",
            "give the present posture as WHERE, or --switches to move to the limit switches",
        )
    wanted = NamedPosture.of(where, given.arm_path, given.altered)
    if wanted.arm is not None:  # what is wrong is reported before a port is opened
        wanted.angles_deg(wanted.arm, job_path)
    with resolve.board(given, wanted.arm) as board:
        arm = resolve.arm_of_board(board, wanted.arm)
        angles_deg = wanted.angles_deg(arm, job_path)
        board.configure(arm, replace=given.replace_arm)
        unknown = [stands.name for stands in board.state().joints if not stands.known]
        if switches:
            say = results.progress_printer(given.as_json)
            board.home_to_switches(arm, joint=joint, progress=lambda text, done, whole: say(text))
        elif joint is not None:
            board.home(arm, joint=joint)
        else:
            board.home(arm, angles_deg)
        print_position(board, given.as_json)
        if not switches:
            _remark_on_backlash(arm, unknown)


def _remark_on_backlash(arm: Arm, unknown: Collection[str]) -> None:
    """Of joints whose position was unknown, so that it is unknown on which side of its play a motor is."""
    pairs = zip(arm.driven, arm.crossings, strict=True)
    names = [joint.name for joint, crossing in pairs if crossing and joint.name in unknown]
    if names:
        results.remark(
            f"{', '.join(names)}: the first move may lose up to the backlash; to avoid that, jog each of them in one "
            "direction by more than its backlash, then declare again where it stands"
        )


def is_named(text: str) -> bool:
    """Whether the text is a name (of a posture, a via point or a trajectory file) instead of angles."""
    return (
        text == HOME
        or is_via(text)
        or text.endswith(".json")
        or via_table.is_recording(Path(text))
        or not name_problem(text)
    )


@dataclass(frozen=True)
class NamedPosture:
    """The user's text for a posture, before its arm is known."""

    text: str
    arm: Arm | None
    """The arm that is set, else the arm of the plan; None: the arm that the board is set up for."""
    plan: Plan | None
    """Of the file."""

    @classmethod
    def of(cls, text: str, arm_path: Path | None, altered: bool) -> NamedPosture:
        """The posture of ``text``; raises InputError if its file or the arm cannot be read."""
        if text.endswith(".json") or via_table.is_recording(Path(text)):
            plan = resolve.load_plan(Path(text), arm_path, altered)
            return cls(text, plan.arm, plan)
        if not is_named(text):
            _numbers(text)  # a wrong posture is reported before a port is opened
        return cls(text, resolve.named_arm(arm_path), None)

    def angles_deg(self, arm: Arm, job_path: Path | None) -> Array:
        """Angles in degrees (J,); raises InputError if the text is not a posture or does not fit the arm."""
        if self.plan is not None:
            start_deg = arm.home_deg if self.plan.start_deg is None else self.plan.start_deg
            return point_to_point.posture(start_deg, arm)
        if not name_problem(self.text):
            from armtempo.planning import via_points  # here, because angles need no inverse kinematics

            return via_points.posture_deg(arm, arm.posture(self.text))
        if self.text == HOME:
            return point_to_point.posture(arm.home_deg, arm)
        if is_via(self.text):
            return via_deg(self.text, arm, resolve.load_job(job_path, arm))
        return point_to_point.posture(_numbers(self.text), arm)


def _numbers(text: str) -> list[float]:
    try:
        return [float(cell) for cell in text.split(",")]
    except ValueError:
        raise InputError(
            f"{text!r} is not a posture",
            "give angles in degrees ('0,-60,40'; of a sliding joint mm), 'home' or another posture of the arm file, a "
            "via point of the job ('P0') or a trajectory file",
        ) from None


def print_position(board: Board, as_json: bool = False) -> None:
    """Print the arm's position at the end of a command; as JSON like ``status``."""
    found = board.state()
    lines = ["position:", *(f"  {line}" for line in state.joint_lines(found))]
    results.show(as_json, found.to_json(), lines)


def format_angles(angles_deg: Array, arm: Arm) -> str:
    """A posture in one line: each driven joint's name, its angle and its motor's steps."""
    return ", ".join(
        f"{joint.name} {joint.unit.text(angle, 2)} ({steps} steps)"
        for joint, angle, steps in zip(
            arm.driven, angles_deg, arm.transmission.whole_steps(angles_deg), strict=True
        )
    )


def via_deg(text: str, arm: Arm, job: Job) -> Array:
    """The angles of a via point of a job, degrees (J,); raises InputError if the job has no such point."""
    from armtempo.planning import planner  # here, because it loads everything that plans

    points_deg, _ = planner.via_angles(arm, job)
    index = int(text[1:])
    if index >= len(points_deg):
        raise InputError(
            f"job {job.name!r} has no via point P{index}", f"give one of P0 to P{len(points_deg) - 1}"
        )
    return np.asarray(points_deg[index])
