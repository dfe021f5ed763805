"""Replays on a virtual board, with its pin log: the whole chain through a trajectory file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from armtempo import arm as arms
from armtempo import job as jobs
from armtempo import operate, pipeline, planner, runs, trajectory_file, virtual
from armtempo.interrupt import StopRequest
from armtempo.link import open_board
from armtempo.plan import Plan
from armtempo.virtual import edgelog

from tests import interpreters

JOBS: dict[str, dict[str, Any]] = {
    "shipped": {},
    "refined": {"timing": "shared", "refine": 4, "iterations": 50},
    "cubic": {"degree": 3, "iterations": 50},
}
"""What is changed in the shipped job."""


@dataclass(frozen=True)
class Replay:
    """One replay: the plan as its file has it, all pins of the board, and what was recorded."""

    plan: Plan
    pins: dict[str, edgelog.Edges]
    """Per pin its edges since power-up, in ticks of the motion clock."""
    samples: runs.Samples
    repetition: dict[str, Any]
    """What run.json says of it."""


def plan_file(job: str, folder: Path) -> Path:
    """Plan one of ``JOBS``; gives the trajectory file."""
    arm = arms.load_arm(arms.default_path())
    plan = planner.plan(arm, replace(jobs.load_job(jobs.default_path(), arm), **JOBS[job]))
    path = folder / f"{job}.json"
    trajectory_file.save(plan, path)
    return path


def replay(trajectory: Path, interpreter: str, folder: Path) -> Replay:
    """Replay a trajectory file on a virtual board under the interpreter of that name."""
    motion = pipeline.from_file(trajectory, None)
    log = folder / "edges.bin"
    starter = interpreters.starter(interpreter)
    with (
        virtual.launch(arm=motion.arm, edge_log=log, interpreter=starter) as process,
        open_board(process.port) as board,
        StopRequest() as stop,
    ):
        operate.configure(board, motion.arm, replace=True)
        pipeline.bring_to_start(board, "sim", motion, stop)
        run = pipeline.new_run(folder, motion, "sim", board)
        assert len(list(pipeline.repeat(board, motion, run, 1, stop))) == 1
    recorded = runs.load(run.path)
    assert recorded.trajectory_path is not None
    (session,) = edgelog.read(log)
    (zero,) = session.starts  # the arm stood at the start already
    pins = {pin: (ticks - zero, levels) for pin, (ticks, levels) in session.pins.items()}
    plan = trajectory_file.load(recorded.trajectory_path)
    return Replay(plan, pins, recorded.repetitions[0], recorded.meta["repetitions"][0])
