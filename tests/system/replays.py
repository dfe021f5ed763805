"""Replays on a virtual board, with its pin log: the whole chain through a trajectory file."""

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

from tests import interpreters

JOBS: dict[str, dict[str, Any]] = {
    "shipped": {},
    "refined": {"timing": "shared", "iterations": 50},
    "cubic": {"degree": 3, "iterations": 50},
    "half": {"via": Job.paper(Arm.paper()).via[:4], "iterations": 50},
}
"""What is changed in the shipped job; half of it is for the emulated interpreter, which is slow."""
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
    return replace(plan, trajectory=replace(plan.trajectory, joints=slowed))


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
