"""The motions that a run replayed, its arm and results, and the theory for a run at another speed than planned."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.atomic_file import os_reason
from armtempo.basics.errors import ArmtempoError, RunFolderError
from armtempo.encoding import encode
from armtempo.model import arm_json
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import DEG, JointUnit
from armtempo.model.plan import Plan
from armtempo.report import run_folder
from armtempo.report.run_folder import ARM
from armtempo.report.run_reader import RESTORE, RepetitionData, RunData
from armtempo.splines.trajectory import Trajectory

_EQUAL_S = 1e-6
"""Times that differ by less are the same: a tick is 12 ns."""
_SHORT_S = 0.01
SPEED_NOTE = "of the planned speed"
"""Part of every text of ``speed_note``."""


def plan_of(run: RunData) -> Plan | None:
    """The plan of what was run; None if only the board had it.

    Raises InputError if its file is damaged, RunFolderError if it is that of another run.
    """
    path = run.plan_path
    plan = Plan.load(path) if path else None
    if plan and len(plan.legs) != len(run.legs):
        raise RunFolderError(
            f"{path} has {len(plan.legs)} motions, but the run {len(run.legs)}",
            "put back the plan of this run",
        )
    return plan


def legs_of(run: RunData, plan: Plan | None) -> tuple[Trajectory, ...]:
    """The motions as planned; without a plan from the board's records, to the rounding of their integers.

    Raises RunFolderError if a record is missing or damaged.
    """
    if plan is not None:
        return tuple(leg.trajectory for leg in plan.legs)
    return tuple(_leg(run.path / leg.file, leg.name, run) for leg in run.legs)


def _leg(path: Path, name: str, run: RunData) -> Trajectory:
    try:
        return encode.decoded(path.read_bytes(), run_folder.transmission(run.joints), name)
    except OSError as error:
        raise RunFolderError(
            f"{path}: cannot be read ({os_reason(error)}), so the planned motion is not known", RESTORE
        ) from error
    except ArmtempoError as error:
        raise RunFolderError(f"{path}: {error.problem}", RESTORE) from error


def arm_of(run: RunData) -> Arm | None:
    """The arm of a run without a plan; None if it is not known. Raises InputError if its file is damaged."""
    path = run.path / ARM
    return arm_json.load(path) if path.is_file() else None


@dataclass(frozen=True)
class JointResult:
    """The final state of a joint."""

    name: str
    steps_sent: int
    """Step pulses of its motor from start to end, signed."""
    angle_deg: float
    """Final angle from the encoder; without one, from the steps."""
    error_deg: float
    """``angle_deg`` minus the end of the trajectory."""
    unit: JointUnit = DEG
    """Of both."""


def results(run: RunData, trajectory: Trajectory) -> tuple[JointResult, ...]:
    """The joints at the end of the last repetition; empty if run.json does not have it."""
    last = run.entries[-1] if run.entries else None
    steps, counts = (last.commanded_steps, last.counts) if last else ((), ())
    start_deg, end_deg = trajectory(0.0), trajectory(trajectory.duration_s)
    if len(steps) != len(run.joints):
        return ()
    gears = run_folder.transmission(run.joints)
    angles_deg = np.where(gears.measured, gears.angles_of_counts(counts), gears.angles_of_steps(steps))
    start_steps = gears.whole_steps(start_deg)
    return tuple(
        JointResult(
            scale.name,
            steps[joint] - start_steps[joint],
            float(angle_deg),
            float(angle_deg - end_deg[joint]),
            scale.unit,
        )
        for joint, (scale, angle_deg) in enumerate(zip(run.joints, angles_deg, strict=True))
    )


def is_scaled(repetition: RepetitionData) -> bool:
    """Whether the speed was ever below 100 %."""
    return bool(np.any(np.abs(repetition.time_s - repetition.path_s) > _EQUAL_S))


def path_times(repetition: RepetitionData, times_s: Array) -> Array:
    """The motion's own time (K,) at real times (K,), interpolated and extrapolated linearly."""
    if len(repetition.time_s) < 2 or not is_scaled(repetition):
        return times_s
    inside = np.interp(times_s, repetition.time_s, repetition.path_s)
    return np.where(times_s > repetition.time_s[-1], repetition.path_s[-1], inside)


def theory(trajectory: Trajectory, times_s: Array, path_s: Array) -> Array:
    """Angle, speed and acceleration of a trajectory over real time, (3, K, J).

    ``path_s`` (K,): the motion's own time at the evenly spaced ``times_s`` (K,). By the chain rule, with finite
    differences of ``path_s``.
    """
    orders = [trajectory(path_s, order) for order in range(3)]
    if len(times_s) > 1 and np.any(np.abs(path_s - times_s) > _EQUAL_S):
        rate = np.gradient(path_s, times_s)[:, None]
        change = np.gradient(rate[:, 0], times_s)[:, None]
        orders = [orders[0], orders[1] * rate, orders[2] * rate**2 + orders[1] * change]
    return np.stack(orders)


def speed_note(repetition: RepetitionData) -> str:
    """Text on the speed of a repetition; "" for the planned speed."""
    if not is_scaled(repetition):
        return ""
    passed_s = np.diff(repetition.time_s)
    whole = passed_s > _SHORT_S  # the last sample may come shortly after another
    rates = 100 * np.diff(repetition.path_s)[whole] / passed_s[whole]
    low, high = round(float(rates.min()), 1), round(float(rates.max()), 1)
    speed = f"at {high:g} %" if high - low < 1.0 else f"between {low:g} and {high:g} %"
    return f"ran {speed} {SPEED_NOTE}; it is checked against the plan at that speed"
