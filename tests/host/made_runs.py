"""Run folders as the recorder writes them, made from a plan with an ideal or a scattered encoder."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from armtempo.encoding import encoded_motion
from armtempo.link.board_messages import Positions, Sample
from armtempo.model import arm_json
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.planning import planner
from armtempo.report import arm_picture, drawing, plots, run_folder
from armtempo_shared.limits import SAMPLE_TICKS, TICK_HZ


@cache
def shipped_plan() -> Plan:
    """The plan of the shipped job."""
    arm = Arm.paper()
    return planner.plan(arm, Job.paper(arm))


@cache
def shipped_record() -> bytes:
    """Its record for the board."""
    return encoded_motion.of_plan(shipped_plan()).data


def blind_plan(*joints: int) -> Plan:
    """The shipped plan for the same arm without encoders at these joints."""
    whole = shipped_plan()
    left = tuple(
        replace(joint, encoder=None if number in joints else joint.encoder)
        for number, joint in enumerate(whole.arm.joints)
    )
    return replace(whole, arm=replace(whole.arm, joints=left))


def draw_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures take most of a page's time; a test of what it says in words has them left empty."""
    for module, names in (
        (plots, ("tracking", "errors", "convergence", "overlay")),
        (arm_picture, ("postures",)),
    ):
        for name in names:
            monkeypatch.setattr(module, name, lambda *_: None)
    monkeypatch.setattr(drawing, "save", lambda figure, path: path.write_bytes(b""))
    monkeypatch.setattr(drawing, "inline_svg", lambda figure, name, description: "<svg></svg>")


def make(
    path: Path,
    repetitions: int = 3,
    scatter_deg: float = 0.02,
    seed: int = 1,
    drop: tuple[int, ...] = (),
    plan: Plan | None = None,
    on_board: bool = False,
) -> Path:
    """A run folder at ``path``; ``drop``: indices of samples that the first repetition lost.

    ``plan``: what was run, else the shipped one; ``on_board``: only the board had it, so the folder has no plan.
    """
    made = plan or shipped_plan()
    rng = np.random.default_rng(seed)
    path.mkdir(parents=True)
    folder = run_folder.RunFolder(path, made.job.name, run_folder.scales(made.arm), {"port": "sim"})
    folder.write_motion(shipped_record() if plan is None else encoded_motion.of_plan(made).data)
    if on_board:
        arm_json.save(made.arm, path / run_folder.ARM)
    else:
        made.save(path / run_folder.TRAJECTORY)
    for number in range(repetitions):
        with folder.begin_repetition() as file:
            for sample in _samples(made, scatter_deg, rng):
                if number or sample.index not in drop:
                    file.append(sample)
            file.repetition.end(run_folder.COMPLETE, "", sample.ticks, sample.positions, ())
    return path


def _samples(made: Plan, scatter_deg: float, rng: np.random.Generator) -> list[Sample]:
    scales = run_folder.scales(made.arm)
    end = round(made.trajectory.duration_s * TICK_HZ)
    ticks = np.append(np.arange(0, end, SAMPLE_TICKS), end)
    angles = made.trajectory(ticks / TICK_HZ)
    seen = angles + rng.normal(scale=scatter_deg, size=angles.shape)
    motors = made.arm.transmission.matrix
    steps = np.rint(angles @ motors.T * [scale.steps_per_deg for scale in scales]).astype(int).tolist()
    counts = np.rint(seen @ motors.T * [scale.counts_per_deg for scale in scales]).astype(int).tolist()
    rows = enumerate(zip(ticks.tolist(), steps, counts, strict=True))
    return [
        Sample(run=1, index=n, ticks=t, path_ticks=t, flags=0, positions=Positions(tuple(step), tuple(count)))
        for n, (t, step, count) in rows
    ]
