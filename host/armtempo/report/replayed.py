"""What a run folder says was replayed: the plan, else the motion that the board had; the arm; how each joint ended."""

from __future__ import annotations

from dataclasses import dataclass

from armtempo.basics.atomic_file import why
from armtempo.basics.errors import InputError, RunFolderError
from armtempo.model import arm_json
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.records import decode
from armtempo.report.run_folder import ARM, MOTION
from armtempo.report.run_reader import RunData
from armtempo.splines.trajectory import Trajectory


def plan_of(run: RunData) -> Plan | None:
    """The plan; None if only the board had the motion. InputError if its file is damaged."""
    return Plan.load(run.trajectory_path) if run.trajectory_path else None


def trajectory_of(run: RunData) -> Trajectory:
    """The motion as the board's record has it, to the rounding of its integers.

    Raises RunFolderError if that is not there or not whole.
    """
    path = run.path / MOTION
    try:
        return decode.trajectory(path.read_bytes(), run.joints, str(run.meta["name"]))
    except OSError as error:
        raise RunFolderError(
            f"{run.path}: neither a plan nor {MOTION} can be read ({why(error)}), so the planned motion is not known",
            "restore one of them from a copy, or run again",
        ) from error
    except InputError as error:
        raise RunFolderError(f"{path}: {error.problem}", "restore it from a copy, or run again") from error


def arm_of(run: RunData) -> Arm | None:
    """The arm of a motion without a plan; None if the folder does not say. InputError if it is damaged."""
    path = run.path / ARM
    return arm_json.load(path) if path.is_file() else None


@dataclass(frozen=True)
class JointResult:
    """How one joint ended."""

    name: str
    steps_sent: int
    """Step pulses from start to end, signed."""
    angle_deg: float
    """Where it ended: by its encoder, without one by the steps."""
    error_deg: float
    """That less where the trajectory ends."""


def results(run: RunData, trajectory: Trajectory) -> tuple[JointResult, ...]:
    """The joints of the last repetition; empty if run.json does not say how that ended."""
    last = run.entries[-1] if run.entries else None
    steps, counts = (last.commanded_steps, last.counts) if last else ((), ())
    start_deg, end_deg = trajectory(0.0), trajectory(trajectory.duration_s)
    found = []
    for joint, scale in enumerate(run.joints[: len(steps)]):
        angle_deg = steps[joint] / scale.steps_per_deg
        if scale.counts_per_deg:
            angle_deg = counts[joint] / scale.counts_per_deg
        sent = steps[joint] - round(start_deg[joint] * scale.steps_per_deg)
        found.append(JointResult(scale.name, sent, angle_deg, float(angle_deg - end_deg[joint])))
    return tuple(found)
