"""The evaluation of a run folder: its motion, the measured curves, and what is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armtempo.basics.errors import InputError, RunFolderError
from armtempo.model.arm import Arm
from armtempo.model.parts import Limits
from armtempo.model.plan import Plan
from armtempo.report import analysis, peaks, replayed, run_reader
from armtempo.report.run_folder import COMPLETE, transmission
from armtempo.splines import extremes
from armtempo.splines.trajectory import Trajectory


@dataclass(frozen=True)
class Evaluation:
    """A run with its motion, its curves and the problems of its files.

    ``plan`` is None if only the board had the motion; then ``arm`` may be None too.
    """

    run: run_reader.RunData
    trajectory: Trajectory
    arm: Arm | None
    plan: Plan | None
    curves: analysis.Curves
    complaints: tuple[str, ...]

    @property
    def names(self) -> list[str]:
        return [joint.name for joint in self.run.joints]

    @property
    def limits(self) -> list[Limits]:
        """The limits of the driven joints; empty if the arm is not known."""
        return [joint.limits for joint in self.arm.driven] if self.arm else []

    @property
    def extremes(self) -> Sequence[extremes.Extremes]:
        """The planned motion's largest speed, acceleration and jerk of each joint."""
        return self.plan.extremes if self.plan else extremes.of_joints(self.trajectory.joints)

    @property
    def limit_checks(self) -> list[list[peaks.LimitCheck]]:
        """``[joint]``: speed and acceleration next to the limits; empty if the arm is not known."""
        if not self.limits:
            return []
        resolutions = transmission(self.run.joints).count_deg.tolist()
        return peaks.limit_checks(self.curves, self.trajectory, self.limits, resolutions)

    @property
    def last(self) -> run_reader.RepetitionData:
        """The last repetition that has samples."""
        return [repetition for repetition in self.run.repetitions if len(repetition.time_s)][-1]


def evaluate(folder: Path) -> Evaluation:
    """Read and analyse a run folder; ``complaints`` lists what is incomplete.

    Raises RunFolderError if the motion is not known, or there is no sample.
    """
    run = run_reader.load(folder)
    plan = replayed.plan_of(run)
    trajectory = plan.trajectory if plan else replayed.trajectory_of(run)
    if len(run.joints) != len(trajectory.joints):
        raise RunFolderError(
            f"{folder}: run.json lists {len(run.joints)} joints, trajectory.json has {len(trajectory.joints)}",
            "put the trajectory.json has this run there, or run again",
        )
    usable = [repetition for repetition in run.repetitions if len(repetition.time_s)]
    if not usable:
        raise RunFolderError(f"{folder}: contains no samples", "run it again")
    found = complaints(run)
    arm = plan.holding if plan else _arm(run, found)
    return Evaluation(run, trajectory, arm, plan, analysis.curves(usable, trajectory), tuple(found))


def _arm(run: run_reader.RunData, complaints: list[str]) -> Arm | None:
    """The arm of a motion without a plan, if the folder has it and it fits; otherwise adds a complaint."""
    try:
        arm = replayed.arm_of(run)
    except InputError as error:
        complaints.append(error.problem)
        return None
    return arm if arm and len(arm.driven) == len(run.joints) else None


def complaints(run: run_reader.RunData) -> list[str]:
    """Problems of the repetitions, one sentence each."""
    found = []
    for repetition, entry in zip(run.repetitions, run.entries, strict=True):
        steps = np.diff(repetition.index)
        if not len(repetition.time_s):
            found.append(f"{repetition.file}: {repetition.problem or 'no samples'}")
            continue
        if repetition.index[0] > 0:
            found.append(f"{repetition.file}: the first {repetition.index[0]} samples are missing")
        for at in np.flatnonzero(steps > 1):
            first, last = repetition.index[at] + 1, repetition.index[at + 1] - 1
            found.append(f"{repetition.file}: samples {first} to {last} are missing")
        if np.any(steps <= 0):
            found.append(f"{repetition.file}: the sample count starts again in the middle (a reset?)")
        if words := replayed.speed_note(repetition):
            found.append(words)
        if repetition.state != COMPLETE:
            end = repetition.time_s[-1]
            state = f"{entry.state} ({entry.fault})" if entry.fault else entry.state
            found.append(f"{repetition.file}: cut short, ended as {state} after {end:.1f} s")
    return found
