"""Replays on a virtual board, what its STEP and DIR pins did in them, and the exact steps by SciPy and bisection."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from armtempo import simulator
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import DrivenJoint
from armtempo.model.plan import Plan
from armtempo.planning import planner
from armtempo.report import run_reader
from armtempo.robot.connect import connect
from armtempo.simulator import edgelog
from armtempo.splines.trajectory import JointSpline
from numpy.typing import NDArray
from scipy.interpolate import BSpline, PPoly

from tests import interpreters
from tests.plans import changed

JOBS: dict[str, dict[str, Any]] = {
    "shipped": {},
    "refined": {"timing": "shared", "iterations": 50},
    "cubic": {"degree": 3, "iterations": 50},
}
"""What is changed in the shipped job."""
REFINE = 4
"""Time segments per path segment of "refined"; the planner's search for them takes too long for a test."""


@dataclass(frozen=True)
class Replay:
    """One replay: the plan as its file has it, all pins of the board, and what was recorded."""

    plan: Plan
    pins: dict[str, edgelog.Edges]
    """Per pin its edges since power-up, in ticks of the motion clock."""
    samples: run_reader.RepetitionData
    repetition: dict[str, Any]
    """What run.json says of it."""


def plan_file(job: str, folder: Path) -> Path:
    """Plan one of ``JOBS``; gives the trajectory file."""
    arm = Arm.paper()
    plan = planner.plan(arm, replace(Job.paper(arm), **JOBS[job]))
    path = folder / f"{job}.json"
    (refined(plan) if job == "refined" else plan).save(path)
    return path


def refined(plan: Plan) -> Plan:
    """The plan with a finer and somewhat uneven shared time axis, as fast as the limits allow."""
    intervals = np.diff(plan.trajectory.joints[0].time_points_s)[2:-2]
    middles = (np.arange(len(intervals) * REFINE) + 0.5) / REFINE - 0.5
    steps = np.interp(middles, np.arange(len(intervals)), intervals)
    steps *= np.random.default_rng(7).uniform(0.99, 1.01, len(steps))
    # mirrored at both ends, so that time begins at 0 with the first segment
    points = np.cumsum(np.concatenate(([0.0], steps[1::-1], steps, steps[:-3:-1])))
    points -= points[2]
    joints = [replace(joint, refine=REFINE, time_points_s=points) for joint in plan.trajectory.joints]
    excess = max(_excess(joint, driven) for joint, driven in zip(joints, plan.arm.driven, strict=True))
    slowed = tuple(replace(joint, time_points_s=points * excess) for joint in joints)
    return changed(plan, trajectory=replace(plan.trajectory, joints=slowed))


def _excess(joint: JointSpline, driven: DrivenJoint) -> float:
    """By how much the joint must be slowed to keep its limits."""
    instants = np.linspace(0.0, joint.duration_s, 5000)
    return max(
        float(np.max(np.abs(joint(instants, order)) / limit) ** (1 / order))
        for order, limit in enumerate(driven.limits.values, start=1)
    )


def replay(trajectory: Path, interpreter: str, folder: Path) -> Replay:
    """Replay a trajectory file on a virtual board under the interpreter of that name."""
    plan = Plan.load(trajectory)
    log = folder / "edges.bin"
    starter = interpreters.starter(interpreter)
    with (
        simulator.launch(
            simulator.LaunchOptions(edge_log=log, interpreter=starter)
        ) as process,  # without an arm: ideal motors
        connect(process.port) as board,
    ):
        board.home(plan.arm)
        run = board.run(plan, out=folder)
    assert run.plan is not None
    (session,) = edgelog.read(log)
    (zero,) = session.starts  # the arm stood at the start already
    pins = {pin: (ticks - zero, levels) for pin, (ticks, levels) in session.pins.items()}
    return Replay(run.plan, pins, run.repetitions[0], run.meta["repetitions"][0])


# what a joint's STEP and DIR pins did, from the pin log, and its exact steps by SciPy and bisection


TICK_HZ = 84_000_000
Array = NDArray[np.float64]
PINS = (("A15", "E7"), ("A1", "E8"), ("B10", "E10"))
"""STEP and DIR of the shipped arm's joints (board-side home of the fact: armtempo_board/hardware/pins.py)."""
Ticks = NDArray[np.int64]


@dataclass(frozen=True)
class Crossings:
    """Where the angle crosses half a step, in order."""

    ticks: Array
    directions: NDArray[np.int64]
    """+1 or -1"""


class ExactJoint:
    """One joint of a trajectory file; ``steps_per_deg`` from the arm in it."""

    def __init__(self, angle_points_deg: Array, time_points_s: Array, degree: int, refine: int,
                 steps_per_deg: float) -> None:  # fmt: skip
        self.segments = len(angle_points_deg) - degree
        self._angle = _uniform(angle_points_deg * steps_per_deg, degree, 1)
        self._time = _uniform(time_points_s * TICK_HZ, degree, refine)
        self.start = round(float(self._angle(0.0)))
        self.end = float(self._angle(self.segments))
        self.duration_ticks = float(self._time(self.segments))
        self._turns = self._monotone_ends()

    def crossings(self) -> Crossings:
        """All of them; a turn of the spline exactly on a threshold is none."""
        ticks, directions = [], []
        for low, high in zip(self._turns[:-1], self._turns[1:], strict=True):
            first, last = float(self._angle(low)), float(self._angle(high))
            sign = 1 if last > first else -1
            bottom, top = sorted((first, last))
            halves = np.arange(np.floor(bottom + 0.5), np.ceil(top + 0.5)) + 0.5
            halves = halves[(halves > bottom) & (halves < top)][::sign]
            u = _bisect(lambda u: sign * self._angle(u), sign * halves, low, high)  # noqa: B023
            ticks.append(self._time(u))
            directions.append(np.full(len(u), sign))
        return Crossings(np.concatenate(ticks), np.concatenate(directions))

    def angle(self, ticks: Array) -> Array:
        """Angle at these times; at rest before 0 and after the end."""
        return np.asarray(self._angle(self._u(ticks)))

    def rate(self, ticks: Array) -> Array:
        """Speed at these times, steps/s, without sign."""
        u = self._u(ticks)
        return np.asarray(np.abs(self._angle(u, 1) / self._time(u, 1))) * TICK_HZ

    def turn_ticks(self) -> Array:
        """Both ends, and where the joint turns round."""
        return np.asarray(self._time(np.array(self._turns)))

    def _u(self, ticks: Array) -> Array:
        inside = np.clip(ticks, 0.0, self.duration_ticks)
        return _bisect(self._time, inside, 0.0, float(self.segments))

    def _monotone_ends(self) -> list[float]:
        slope = PPoly.from_spline(self._angle.derivative())
        roots = slope.roots(discontinuity=False, extrapolate=False)
        inside = roots[(roots > 0.0) & (roots < self.segments)]
        return [0.0, *np.sort(inside), float(self.segments)]


def _uniform(points: Array, degree: int, refine: int) -> BSpline:
    """The uniform B-spline with these control points; a knot every 1 / refine."""
    knots = np.arange(-degree, len(points) + 1) / refine
    return BSpline(knots, points, degree, extrapolate=False)


def _bisect(function: Any, values: Array, low: float, high: float) -> Array:
    """Where an increasing function takes each of the values, to the last bit."""
    below, above = np.full(len(values), low), np.full(len(values), high)
    for _ in range(60):
        middle = (below + above) / 2
        under = function(middle) < values
        below, above = np.where(under, middle, below), np.where(under, above, middle)
    return above


@dataclass(frozen=True)
class Pulses:
    """Times in ticks of the motion clock."""

    rises: Ticks
    falls: Ticks
    directions: NDArray[np.int64]
    """DIR at each rise: +1 high, -1 low."""
    dir_ticks: Ticks
    """Every change of DIR since power-up."""

    def position(self, start: int, ticks: NDArray[np.float64]) -> NDArray[np.int64]:
        """Commanded position at these times."""
        made = np.concatenate(([0], np.cumsum(self.directions)))
        return np.asarray(start + made[np.searchsorted(self.rises, ticks, side="right")])


def pulses(replay: Replay, joint: int) -> Pulses:
    """Of a joint, counted from 0."""
    ticks, levels = replay.pins[PINS[joint][0]]
    rises = ticks[levels == 1]
    dir_ticks, dir_levels = replay.pins.get(PINS[joint][1], (np.zeros(0, np.int64), np.zeros(0, np.int8)))
    at_first = 1 - int(dir_levels[0]) if len(dir_levels) else 0  # pins are low after a reset
    history = np.concatenate(([at_first], dir_levels)).astype(np.int64)
    directions = 2 * history[np.searchsorted(dir_ticks, rises, side="right")] - 1
    return Pulses(rises, ticks[levels == 0], directions, dir_ticks)


def exact(replay: Replay, joint: int) -> ExactJoint:
    """The spline of a joint, counted from 0."""
    spline, motor = replay.plan.trajectory.joints[joint], replay.plan.arm.driven[joint].motor
    assert motor is not None
    return ExactJoint(
        spline.angle_points_deg, spline.time_points_s, spline.degree, spline.refine, motor.steps_per_deg
    )
