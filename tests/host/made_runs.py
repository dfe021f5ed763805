"""Run folders as the recorder writes them, of a motion or a sequence, made from a plan with an ideal or a scattered
encoder."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from armtempo.encoding import encoded_plan
from armtempo.link.board_messages import Positions, RowBegun, Sample, SequenceState
from armtempo.model import arm_json
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.posture import ArmPosture
from armtempo.model.sequence import Sequence
from armtempo.model.steps import Count, Goto, Repeat
from armtempo.planning import planner, sequence_planner
from armtempo.report import arm_picture, drawing, plots, run_folder
from armtempo.splines.trajectory import Trajectory
from armtempo_shared.limits import SAMPLE_TICKS, TICK_HZ
from armtempo_shared.sequence import COUNT, MOVE


@cache
def shipped_plan() -> Plan:
    """The plan of the shipped job."""
    arm = Arm.paper()
    return planner.plan(arm, Job.paper(arm))


@cache
def shipped_record() -> bytes:
    """Its record for the board."""
    return encoded_plan.of_plan(shipped_plan()).data


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
    folder.write_legs([shipped_record() if plan is None else encoded_plan.of_plan(made).data])
    if on_board:
        arm_json.save(made.arm, path / run_folder.ARM)
    else:
        made.save(path / run_folder.TRAJECTORY)
    for number in range(repetitions):
        with folder.begin_repetition() as file:
            for sample in _samples(made.arm, made.trajectory, scatter_deg, rng):
                if number or sample.index not in drop:
                    file.append(sample)
            file.repetition.end(run_folder.COMPLETE, "", sample.ticks, sample.positions, ())
    return path


@cache
def small_sequence() -> Plan:
    """There and back without end, each pass counted."""
    steps = (Goto((3.0, -58.0, 41.0)), Goto("home"), Count("parts"))
    arm = Arm.paper()
    start = ArmPosture("home", tuple(arm.home_deg))
    return sequence_planner.plan(arm, Sequence("pick", (Repeat(steps),), start))


def make_sequence(
    path: Path,
    cycles: int = 3,
    state: str = "finished",
    code: str = "",
    scatter_deg: float = 0.0,
    steps_off: int = 0,
    lost_rows: tuple[int, ...] = (),
    drop: tuple[int, ...] = (),
    blind: bool = False,
) -> Path:
    """The run folder of ``small_sequence``, which ended in its third step; ``lost_rows``: counted from 1.

    ``steps_off``: of joint 1 at the end of each motion; ``drop``: samples of the first motion; ``blind``: joint 1
    has no encoder.
    """
    plan = small_sequence()
    scales = list(run_folder.scales(plan.arm))
    if blind:
        scales[0] = replace(scales[0], counts_per_deg=0.0)
    path.mkdir(parents=True)
    rows = tuple(map(run_folder.run_row, plan.rows))
    names = tuple(f"pick-{number}" for number in range(1, len(plan.legs) + 1))
    folder = run_folder.RunFolder(path, "pick", tuple(scales), {"port": "sim"}, legs=names, rows=rows)
    folder.write_legs(motion.data for motion in encoded_plan.of_plan(plan).legs)
    plan.save(path / run_folder.SEQUENCE)
    passes = [0, *(list(range(1, len(rows))) * cycles)]
    rng = np.random.default_rng(1)
    with folder.begin_repetition(with_rows=True) as file:
        run = 0
        for passed, number in enumerate(passes, 1):
            row, cycle = plan.rows[number], (passed - 2) // (len(rows) - 1)
            run += row.op == MOVE
            if passed not in lost_rows:
                value = cycle + 1 if row.op == COUNT else 0
                file.begin_row(RowBegun(passed, run, number, row.step, max(cycle, 0), value), 0.5 * passed)
            if row.op == MOVE:
                for sample in _samples(
                    plan.arm, plan.legs[row.number].trajectory, scatter_deg, rng, run, steps_off
                ):
                    if run > 1 or sample.index not in drop:
                        file.append(sample, None if passed in lost_rows else number)
        end = SequenceState(state, 0, 4, 0, cycles, "pick")
        file.repetition.end_rows(end, code, {"parts": cycles}, 0.5 * len(passes), ())
    return path


def _samples(
    arm: Arm,
    trajectory: Trajectory,
    scatter_deg: float,
    rng: np.random.Generator,
    run: int = 1,
    steps_off: int = 0,
) -> list[Sample]:
    """The samples of a motion, ``steps_off`` from the last step of joint 1."""
    scales = run_folder.scales(arm)
    end = round(trajectory.duration_s * TICK_HZ)
    ticks = np.append(np.arange(0, end, SAMPLE_TICKS), end)
    angles = trajectory(ticks / TICK_HZ)
    seen = angles + rng.normal(scale=scatter_deg, size=angles.shape)
    motors = arm.transmission.matrix
    steps = np.rint(angles @ motors.T * [scale.steps_per_deg for scale in scales]).astype(int).tolist()
    counts = np.rint(seen @ motors.T * [scale.counts_per_deg for scale in scales]).astype(int).tolist()
    steps[-1][0] += steps_off
    rows = enumerate(zip(ticks.tolist(), steps, counts, strict=True))
    return [
        Sample(
            run=run, index=n, ticks=t, path_ticks=t, flags=0, positions=Positions(tuple(step), tuple(count))
        )
        for n, (t, step, count) in rows
    ]
