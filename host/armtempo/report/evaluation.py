"""The evaluation of a run folder: its legs, the measured curves of each, and what is missing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, RunFolderError
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import JointUnit
from armtempo.model.leg import JobSolution
from armtempo.model.parts import Limits
from armtempo.model.plan import Plan
from armtempo.report import analysis, peaks, replayed, run_reader
from armtempo.report.run_folder import COMPLETE, JointScale, Repetition, transmission
from armtempo.report.run_reader import RepetitionData, RunData
from armtempo.splines import extremes
from armtempo.splines.trajectory import Trajectory

_END_S = 1e-3
"""A sample this close to the end of the motion is its last."""
_NAMED = 3
"""A complaint names this many places at most, as a sequence may have thousands."""


@dataclass(frozen=True)
class LegEvaluation:
    """A leg with its curves."""

    number: int
    """From 1."""
    words: str
    """What its first row does."""
    joints: tuple[JointScale, ...]
    trajectory: Trajectory
    arm: Arm | None
    """With what the tool holds on this leg; None if it is not known."""
    solution: JobSolution | None
    """None for a leg of a sequence, and if only the board had the motion."""
    repetitions: tuple[RepetitionData, ...]
    """Its recorded runs that have samples."""
    ends_steps: tuple[tuple[int, ...], ...]
    """Steps (J,) at the end of each complete run."""
    curves: analysis.Curves

    @property
    def names(self) -> list[str]:
        """Of the driven joints, of sliding ones with the unit."""
        return [joint.unit.labelled(joint.name) for joint in self.joints]

    @property
    def units(self) -> list[JointUnit]:
        """Of the driven joints."""
        return [joint.unit for joint in self.joints]

    @property
    def limits(self) -> list[Limits]:
        """The limits of the driven joints; empty if the arm is not known."""
        return [joint.limits for joint in self.arm.driven] if self.arm else []

    @property
    def extremes(self) -> Sequence[extremes.Extremes]:
        """The planned motion's largest speed, acceleration and jerk of each joint."""
        return self.solution.extremes if self.solution else extremes.of_joints(self.trajectory.joints)

    @property
    def limit_checks(self) -> list[list[peaks.LimitCheck]]:
        """``[joint]``: speed and acceleration next to the limits; empty if the arm is not known."""
        if not self.limits:
            return []
        resolutions = transmission(self.joints).count_deg.tolist()
        return peaks.limit_checks(self.curves, self.trajectory, self.limits, resolutions)

    @property
    def last(self) -> RepetitionData:
        """The last of them."""
        return self.repetitions[-1]

    @property
    def whole(self) -> int:
        """Number of its recorded runs of which every sample arrived, to the end of the motion."""
        return sum(
            np.array_equal(one.index, np.arange(len(one.index))) and _at_end(one.path_s, self.trajectory)
            for one in self.repetitions
        )


@dataclass(frozen=True)
class Evaluation:
    """A run with those of its legs that have samples, and the problems of its files."""

    run: RunData
    plan: Plan | None
    """None if only the board had what was run."""
    legs: tuple[LegEvaluation, ...]
    complaints: tuple[str, ...]

    @property
    def single(self) -> bool:
        """Whether the run is of one motion only."""
        return len(self.run.legs) == len(self.legs) == 1


def evaluate(folder: Path) -> Evaluation:
    """Read and analyse a run folder; ``complaints`` lists what is incomplete.

    Raises RunFolderError if a motion is not known, or there is neither a sample nor a row.
    """
    run = run_reader.load(folder)
    plan = replayed.plan_of(run)
    legs = replayed.legs_of(run, plan)
    for leg in legs:
        if len(run.joints) != len(leg.joints):
            raise RunFolderError(
                f"{folder}: run.json lists {len(run.joints)} joints, {leg.name!r} has {len(leg.joints)}",
                "put the plan and the records that this run has there, or run again",
            )
    recorded = [[*_runs(run, *both, legs)] for both in zip(run.repetitions, run.entries, strict=True)]
    if not any(recorded) and not any(repetition.rows for repetition in run.repetitions):
        raise RunFolderError(f"{folder}: contains no samples", "run it again")
    found = _complaints(run, legs, recorded)
    arms = _arms(run, plan, found)
    return Evaluation(run, plan, tuple(_legs(run, legs, arms, plan, recorded)), tuple(found))


def _arms(run: RunData, plan: Plan | None, complaints: list[str]) -> Sequence[Arm | None]:
    """The arm on each leg, if it is known and fits; otherwise adds a complaint."""
    if plan is not None:
        return [arm for arm, _ in plan.loaded_legs]
    try:
        arm = replayed.arm_of(run)
    except InputError as error:
        complaints.append(error.problem)
        arm = None
    return [arm if arm and len(arm.driven) == len(run.joints) else None] * len(run.legs)


def _runs(
    run: RunData, repetition: RepetitionData, entry: Repetition, legs: Sequence[Trajectory]
) -> Iterator[tuple[int, RepetitionData]]:
    """The runs of legs in a repetition, each with the leg's index; without samples whose row was not reported."""
    if not entry.rows:
        if len(repetition.time_s):
            yield 0, repetition
        return
    parts = np.split(np.arange(len(repetition.run)), np.flatnonzero(np.diff(repetition.run)) + 1)
    for part in parts:
        row = int(repetition.row[part].max(initial=-1))
        leg = run.rows[row].leg - 1 if row >= 0 else -1
        if 0 <= leg < len(legs):
            done = part is not parts[-1] or entry.complete or _at_end(repetition.path_s[part], legs[leg])
            file = f"{entry.file} run {repetition.run[part[0]]}"
            yield leg, repetition.part(part, file, COMPLETE if done else entry.state)


def _at_end(path_s: Array, leg: Trajectory) -> bool:
    return bool(path_s[-1] >= leg.duration_s - _END_S)


def _legs(
    run: RunData,
    legs: Sequence[Trajectory],
    arms: Sequence[Arm | None],
    plan: Plan | None,
    recorded: list[list[tuple[int, RepetitionData]]],
) -> Iterator[LegEvaluation]:
    """The legs that have samples on the grid of times."""
    for index, leg in enumerate(legs):
        ends: list[tuple[int, ...]] = []
        usable = []
        for entry, runs in zip(run.entries, recorded, strict=True):
            if not entry.rows and entry.complete and len(entry.commanded_steps) == len(run.joints):
                ends.append(entry.commanded_steps)
            for number, one in runs:
                if number == index and analysis.has_grid(one):
                    usable.append(one)
                    if entry.rows and _at_end(one.path_s, leg):
                        ends.append(tuple(map(int, one.commanded_steps[-1])))
        if usable:
            words = next((row.words for row in run.rows if row.leg == index + 1), "")
            curves = analysis.curves(usable, leg)
            solution = plan.legs[index].solution if plan else None
            yield LegEvaluation(
                index + 1, words, run.joints, leg, arms[index], solution, tuple(usable), tuple(ends), curves
            )


def _complaints(
    run: RunData, legs: Sequence[Trajectory], recorded: list[list[tuple[int, RepetitionData]]]
) -> list[str]:
    """Problems of the repetitions, one sentence each."""
    places: dict[str, list[str]] = {}
    for repetition, entry, runs in zip(run.repetitions, run.entries, recorded, strict=True):
        if repetition.problem or not (runs or entry.rows):
            places.setdefault(repetition.problem or "no samples", []).append(repetition.file)
        if repetition.rows and (lost := repetition.rows[-1].passed - len(repetition.rows)):
            places.setdefault(f"{lost} rows were not reported", []).append(entry.rows)
        for leg, one in runs:
            for text in _problems(one, entry, legs[leg]):
                places.setdefault(text, []).append(one.file)
    return [f"{_listed(files)}: {text}" for text, files in places.items()]


def _problems(one: RepetitionData, entry: Repetition, leg: Trajectory) -> Iterator[str]:
    """Problems of the run of a leg."""
    steps = np.diff(one.index)
    if one.index[0] > 0:
        yield f"the first {one.index[0]} samples are missing"
    for at in np.flatnonzero(steps > 1):
        yield f"samples {one.index[at] + 1} to {one.index[at + 1] - 1} are missing"
    if np.any(steps <= 0):
        yield "the sample count starts again in the middle (a reset?)"
    if note := replayed.speed_note(one):
        yield note
    if one.state != COMPLETE:
        state = f"{entry.state} ({entry.fault})" if entry.fault else entry.state
        yield f"cut short, ended as {state} after {one.time_s[-1]:.1f} s"
    elif not _at_end(one.path_s, leg):
        yield "its end is missing"


def _listed(files: Sequence[str]) -> str:
    more = f" and {len(files) - _NAMED} more" if len(files) > _NAMED else ""
    return ", ".join(files[:_NAMED]) + more
