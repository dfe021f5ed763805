"""What a run folder says was replayed: the plan, else the motion that the board had; and the arm."""

from __future__ import annotations

from armtempo.basics.errors import InputError, RunFolderError
from armtempo.formats.atomic_file import why
from armtempo.model import arm_json
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.records import decode
from armtempo.runs.reader import RunData
from armtempo.runs.run_folder import ARM, MOTION
from armtempo.splines.trajectory import Trajectory


def plan_of(run: RunData) -> Plan | None:
    """The plan; None where only the board had the motion. InputError where its file is damaged."""
    return Plan.load(run.trajectory_path) if run.trajectory_path else None


def trajectory_of(run: RunData) -> Trajectory:
    """The motion as the board's record has it, to the rounding of its integers.

    Raises RunFolderError where that is not there or not whole.
    """
    path = run.path / MOTION
    try:
        return decode.trajectory(path.read_bytes(), run.joints, str(run.meta["name"]))
    except OSError as error:
        raise RunFolderError(
            f"{run.path}: neither a plan nor {MOTION} can be read ({why(error)}), so what was to move is not known",
            "restore one of them from a copy, or run again",
        ) from error
    except InputError as error:
        raise RunFolderError(f"{path}: {error.problem}", "restore it from a copy, or run again") from error


def arm_of(run: RunData) -> Arm | None:
    """The arm of a motion without a plan; None where the folder does not say. InputError where it is damaged."""
    path = run.path / ARM
    return arm_json.load(path) if path.is_file() else None
