"""The whole chain, from via angles to pulses and from encoder counts to plots; read this first.

::

    planner.plan             via angles -> splines over time, as fast as the limits allow
    encode.motion_record     degrees and seconds -> steps and ticks
    Board.upload, .start     -> flash; there evaluator, rings and timers take over
    Follower.samples         <- encoder counts every 0.1 s
    RunFolder                <- run.json, samples-01.csv, …
    report.write             -> runs, analyse, plots: what was measured beside the plan
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from armtempo_shared.limits import MAX_NAME, TICK_HZ
from armtempo_shared.wire import record_crc

from armtempo.errors import InputError, LinkError
from armtempo.formats.text_table import aligned
from armtempo.link import Board
from armtempo.link.follow import Follower
from armtempo.link.ports import is_sim
from armtempo.model import trajectory_file
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.planning import point_to_point
from armtempo.records import decode, encode
from armtempo.robot import operate
from armtempo.robot.stop_request import StopRequest
from armtempo.runs import run_folder
from armtempo.runs.run_folder import Repetition, RunFolder
from armtempo.splines.bspline import Array
from armtempo.splines.trajectory import Trajectory

_END_S = 1e-3
"""A run that ended by more before its motion's end was stopped."""


@dataclass(frozen=True, eq=False)
class Motion:
    """What is to be replayed: the record for the board and the trajectory that it holds."""

    name: str
    arm: Arm
    trajectory: Trajectory
    data: bytes
    plan: Plan | None
    """How it was planned, where that is known."""

    @property
    def stored(self) -> operate.Stored:
        """What the board knows it by."""
        return operate.Stored(self.name, record_crc(self.data))

    @property
    def start_deg(self) -> Array:
        """Where it begins, degrees (J,)."""
        return self.trajectory(0.0)


def planned(plan: Plan, name: str | None = None) -> Motion:
    """The motion of a plan; ``name`` for the board, else made of the job's. InputError for a wrong one."""
    if name is not None and not re.fullmatch(f"[A-Za-z0-9_-]{{1,{MAX_NAME}}}", name):
        raise InputError(f"{name!r} is no name for the board: 1 to {MAX_NAME} characters of a-z A-Z 0-9 - _")
    board_name = name or re.sub(r"[^A-Za-z0-9_-]", "-", plan.job.name)[:MAX_NAME]
    data = operate.motion_data(plan.trajectory, plan.arm)
    return Motion(board_name, plan.arm, plan.trajectory, data, plan)


def from_file(path: Path, arm: Arm | None, name: str | None = None) -> Motion:
    """The motion of a trajectory file; InputError where it was planned for another arm than ``arm``."""
    motion = planned(trajectory_file.load(path), name)
    if arm is not None and encode.arm_record(arm) != encode.arm_record(motion.arm):
        raise InputError(f"{path} was planned for another arm than {arm.source}; plan it again with this arm")
    return motion


def from_board(board: Board, name: str, arm: Arm) -> Motion:
    """A motion that the board keeps."""
    data = board.fetch(name)
    return Motion(name, arm, decode.trajectory(data, arm, name), data, None)


def prepare(board: Board, port: str, motion: Motion, stop: StopRequest) -> None:
    """Upload the motion; home a virtual board and move it to the start; a real arm must stand there already.

    Raises BoardError where the board does not take it, LinkError, with what to do, where the arm stands
    elsewhere.
    """
    operate.store(board, motion.name, motion.data)
    if is_sim(port):
        operate.home(board, motion.arm)
        operate.go_to(board, motion.arm, motion.start_deg, stop)
    elif not operate.stands_at(board, motion.arm, motion.start_deg):
        raise LinkError(
            f"the arm does not stand where {motion.name!r} begins; bring it there with 'armtempo goto'"
        )


def new_run(parent: Path, motion: Motion, port: str, board: Board) -> RunFolder:
    """A run folder with everything that is needed to repeat the run."""
    assert board.info is not None  # greeted
    origin = {
        "arm": motion.arm.name,
        "port": port,
        "board": vars(board.info),
        "motion_crc": motion.data[-4:][::-1].hex(),
    }
    folder = RunFolder(
        run_folder.new_folder(parent, motion.name), motion.name, run_folder.scales(motion.arm), origin
    )
    folder.write_motion(motion.data)
    if motion.plan is not None:
        trajectory_file.save(motion.plan, folder.path / run_folder.TRAJECTORY)
    folder.write()
    return folder


def repeat(
    board: Board,
    motion: Motion,
    folder: RunFolder,
    times: int,
    stop: StopRequest,
    watch: operate.Take = lambda *_: None,
) -> Iterator[Repetition]:
    """Replay a motion that has been prepared ``times`` times, with the motion backwards in between.

    ``watch`` sees each sample. Gives each repetition when it has ended; a fault or a stop request ends the
    series.
    """
    back = point_to_point.backwards(motion.trajectory, operate.TEMPORARY + "back")
    for number in range(times):
        if number:
            operate.move_once(board, motion.arm, back, stop)
        if stop.wanted:
            return
        end = operate.replay_recorded(board, motion=motion.stored, folder=folder, stop=stop, watch=watch)
        yield folder.repetitions[-1]
        operate.raise_fault(end)


def fetch(board: Board, port: str, motion: Motion, parent: Path) -> tuple[RunFolder, Repetition]:
    """The samples that the board keeps of its last run, which was one of ``motion``, into a new run folder.

    Raises LinkError where it keeps none.
    """
    status = board.status()
    if not status.run or not (status.moving or status.samples_kept):
        raise LinkError("the board keeps no samples: nothing was run since it started, or they were fetched")
    follower = Follower(board, status.run)
    folder = new_run(parent, motion, port, board)
    with folder.begin_repetition() as file:
        for sample in follower.samples():
            file.append(sample)
        end = follower.end
        assert end is not None  # the samples have ended
        cut = end.ticks < motion.trajectory.duration_s * TICK_HZ - TICK_HZ * _END_S
        state = run_folder.FAULT if end.fault else run_folder.INTERRUPTED if cut else run_folder.COMPLETE
        file.repetition.end(state, operate.fault_name(end.fault), end.ticks, end.stand, end.lost)
    return folder, folder.repetitions[-1]


def results(motion: Motion, repetition: Repetition) -> list[str]:
    """What became of each joint, one line each: steps sent, and how far the arm ended from the plan."""
    end_deg = motion.trajectory(motion.trajectory.duration_s)
    scales = run_folder.scales(motion.arm)
    rows = [["joint", "steps sent", "angle", "error"], ["", "net", "deg", "deg"]]
    for joint, scale in enumerate(scales):
        steps = repetition.commanded_steps[joint]
        angle_deg = steps / scale.steps_per_deg
        if scale.counts_per_deg:
            angle_deg = repetition.counts[joint] / scale.counts_per_deg
        error_deg = angle_deg - end_deg[joint]
        sent = steps - round(motion.start_deg[joint] * scale.steps_per_deg)
        rows.append([scale.name, str(sent), f"{angle_deg:.3f}", f"{error_deg:+.4f}"])
    return aligned(rows, (11, 11, 12, 12))
