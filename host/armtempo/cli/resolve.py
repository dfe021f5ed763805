"""Board, arm, job and plan of the shared options, and the defaults if an option is missing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from armtempo.basics.errors import InputError, PortGivenUpError
from armtempo.basics.settings import ARM, JOB, RUNS, ProjectSettings, missing_setting
from armtempo.basics.text import did_you_mean
from armtempo.cli.options import BoardOptions
from armtempo.cli.results import remark
from armtempo.model import shipped, via_table
from armtempo.model.arm import Arm
from armtempo.model.job import Job, is_name
from armtempo.model.tool_pose import Pose
from armtempo.ports import board_port
from armtempo.ports.names import SIM, is_sim

if TYPE_CHECKING:  # planner and link take long to import, and many commands need neither
    from armtempo.link.traffic import Sink
    from armtempo.model.plan import Plan
    from armtempo.model.thinning import Tolerance
    from armtempo.robot.board import Board
    from armtempo.robot.board_state import BoardState
    from armtempo.robot.shared_board import SharedBoard

_ANEW = ", started for this command; its arm is where it was left"


# arm and job


def named_arm(path: Path | None, for_shape: bool = False) -> Arm | None:
    """The arm of ``--arm``, the variable or the project folder, its postures checked; None if none is set.

    ``for_shape``: only its kinematics are needed, so it may have no motors.
    """
    setting = ProjectSettings().get(ARM, path)
    if not setting:
        return None
    arm = (Arm.shape if for_shape else Arm.load)(setting.path)
    if any(isinstance(posture.where, Pose) for posture in arm.postures):
        from armtempo.planning import via_points  # imported here, because most arms need no kinematics

        via_points.check_postures(arm)
    return arm


def arm_file(path: Path | None) -> Path:
    """The file of the arm as in ``named_arm``; default: the paper's arm, which is printed."""
    setting = ProjectSettings().get(ARM, path)
    if not setting:
        remark(f"no arm given; using the shipped arm {shipped.PAPER!r}")
    return shipped.find(setting.value or shipped.PAPER).path


def load_arm(path: Path | None) -> Arm:
    """The arm as in ``named_arm``; raises InputError if none is set."""
    found = named_arm(path)
    if found is None:
        raise missing_setting(ARM, "which arm?")
    return found


def arm_or_paper(path: Path | None, for_shape: bool = False) -> Arm:
    """The arm as in ``named_arm``; default: the paper's arm, which is printed. For commands that move
    nothing."""
    found = named_arm(path, for_shape)
    if found is None:
        found = Arm.paper()
        remark(f"no arm given; using the shipped arm {found.name!r}")
    return found


def load_job(path: Path | None, arm: Arm) -> Job:
    """The job of ``--job``, the variable or the project folder; raises InputError if none is set."""
    setting = ProjectSettings().get(JOB, path)
    if not setting:
        raise missing_setting(JOB, "which job?")
    return Job.load(setting.path, arm)


def job_file(path: Path | None) -> Path | None:
    """The job's file as in ``load_job``; None if none is set."""
    setting = ProjectSettings().get(JOB, path)
    return setting.path if setting else None


def arm_and_job(arm_path: Path | None, job_path: Path | None) -> tuple[Arm, Job]:
    """The arm and the job to plan; the demo's if neither is set.

    Raises InputError if only one of them is set: a job is never planned for a default arm.
    """
    settings = ProjectSettings()
    arm, job = settings.get(ARM, arm_path), settings.get(JOB, job_path)
    if arm or job:
        if not arm:
            raise missing_setting(ARM, f"no arm is set for job {job.value} ({job.source})")
        loaded = load_arm(arm_path)
        return loaded, load_job(job_path, loaded)
    remark("no arm and no job given; using the shipped feeding job and arm")
    return Arm.paper(), Job.paper()


def arm_of_board(board: Board, named: Arm | None) -> Arm:
    """``named`` if given, else the paper's arm if the board is set up for it.

    Raises InputError otherwise.
    """
    if named is not None:
        return named
    from armtempo.robot.board_state import record_crc

    paper = Arm.paper()
    if board.info.arm_crc == record_crc(paper):
        remark(f"arm: {paper.name}, which the board is set up for")
        return paper
    has = "an arm other than the paper's" if board.info.arm_crc else "none yet"
    raise missing_setting(ARM, f"which arm does the board move? It is set up for {has}")


def describe_arm(arm: Arm) -> str:
    """An arm as commands name it."""
    return describe_source(arm.name, arm.source)


def describe_source(name: str, source: str) -> str:
    """An arm's name and file; without the file for a shipped arm."""
    ships = Path(source).is_relative_to(Path(__file__).parents[1]) if source else False
    where = "ships with armtempo" if ships else source
    return f"{name} ({where})" if where else name


def remark_other_arm(arm: Arm) -> None:
    """Say that the board is set up for another arm than this one, which is set."""
    remark(f"the board is set up for a different arm than {describe_arm(arm)}; see 'armtempo configure'")


# plans


def is_file(what: str) -> bool:
    """Whether an argument is a trajectory file rather than the name of a motion on the board.

    Raises InputError, with the most similar file, if it can be neither.
    """
    path = Path(what)
    if path.is_file():
        return True
    if path.suffix != ".json" and is_name(what):
        return False
    beside = [str(path.parent / one.name) for one in path.parent.glob("*.json") if one.is_file()]
    near = did_you_mean(what, beside)
    raise InputError(
        f"{what or repr(what)}: no such file{near}",
        "check the path; 'armtempo plan' makes one, 'armtempo list' shows the board's",
    )


_NO_PLANS = {
    ".toml": "plan it first: 'armtempo plan' writes the file to give here",
    ".py": "if it is a program, run it with 'armtempo program'",
}
"""What to do with files of jobs, sequences and programs."""


def load_plan(path: Path, arm_path: Path | None, altered: bool = False) -> Plan:
    """The plan of a file, of a motion or a sequence, or one on the times of a recording; InputError if an arm is set
    and does not fit."""
    from armtempo import pipeline

    if path.suffix in _NO_PLANS:
        raise InputError(f"{path}: is not a plan", _NO_PLANS[path.suffix])
    if via_table.is_recording(path):
        plan = as_recorded(path, load_arm(arm_path), path.stem)
        for note in plan.notes:
            remark(f"note: {note}")
        return plan
    return pipeline.load(path, named_arm(arm_path), altered)


def as_recorded(
    path: Path, arm: Arm, name: str, radians: bool | None = None, tolerance: Tolerance | None = None
) -> Plan:
    """A plan on the recording's own times; errors as in ``recorded.plan``."""
    from armtempo.planning import recorded  # here, as it loads the planner

    found = via_table.recorded(path, arm, radians, tolerance)
    given = recorded.TOLERANCE_DEG if tolerance is None else tolerance
    return recorded.plan(arm, name, found.times_s, found.angles_deg, given, found.notes)


# board


def port(given: str | None, others: bool = False) -> str:
    """The port of ``--port``, the variable or the project folder; default: the only board plugged in,
    printed.

    ``others``: the default may also be a port that another armtempo program has open.
    """
    setting = board_port.choose(given, others)
    if setting.source in board_port.UNASKED:
        remark(f"port {setting.value}: {setting.source}")
    return setting.value


def any_port(given: BoardOptions) -> BoardOptions:
    """The options with their port filled in, which another armtempo program may have open."""
    return replace(given, port=port(given.port, others=True))


def runs(out: Path | None) -> Path:
    """The folder for run folders."""
    return ProjectSettings().get(RUNS, out).path


def board(
    given: BoardOptions,
    arm: Arm | None = None,
    any_program: bool = False,
    sink: Sink | None = None,
    wait: bool = True,
    tell: Callable[[str], object] = remark,
) -> Board:
    """The board of ``--port``. A virtual board moves ``arm``, and a remark says that it is virtual.

    ``sink`` gets the traffic, ``tell`` messages about the connection. ``wait``: wait a few seconds for a port
    that another program has, see ``connect``.
    """
    from armtempo.link import Opening, patiently
    from armtempo.robot import connect

    how = Opening(given.log_traffic, sink, any_program, tell=tell)
    port = connect.chosen(given.port, tell)
    found = (
        patiently(lambda: connect.connect_now(port, arm, how))
        if wait
        else connect.connect_now(port, arm, how)
    )
    if found.info.virtual:
        remark(f"port {found.port}: {_describe_virtual(found.port)}")
    return found


def shared_or_own(
    given: BoardOptions, arm: Arm | None = None, any_program: bool = False, sink: Sink | None = None
) -> SharedBoard | Board:
    """The board through the program that has its port open (printed), else over the port itself.

    ``given.port`` must be set. Retries while another program is opening or closing the port.
    """
    from armtempo.link import patiently
    from armtempo.robot import shared_board

    def either() -> SharedBoard | Board:
        shared = shared_board.find(given.port or "")
        if shared is None:
            return board(given, arm, any_program, sink, wait=False)
        remark(f"port {given.port}: through {shared.program}")
        return shared

    return patiently(either)


def board_state(given: BoardOptions) -> BoardState:
    """The board's state, also if another program has the port; ``given.port`` must be set."""
    while True:
        with shared_or_own(given, any_program=True) as found:
            try:
                return found.state()
            except PortGivenUpError:  # the port is free now, or another program has it
                continue


def _describe_virtual(port: str) -> str:
    """Describe the virtual board on a port."""
    if port == SIM:
        return "a virtual board, which ends with this command"
    return f"a virtual board{_ANEW}" if is_sim(port) else "a virtual board"
