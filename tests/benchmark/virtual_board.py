"""How long the virtual board takes for the paper's feeding motion, and how far its arm strays from it.

``python -m tests.benchmark.virtual_board`` prints the tables of host/docs/virtual-board.md.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from armtempo.link import open_board
from armtempo.link.board_messages import Sample
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Encoder
from armtempo.planning import planner
from armtempo.records import encode
from armtempo.robot import arm_state, stored_motion
from armtempo.robot.stop_request import StopRequest
from armtempo.simulator import LaunchOptions, edgelog, launch
from armtempo.splines.trajectory import Trajectory
from armtempo_shared.limits import TICK_HZ

from tests import interpreters

FINE_COUNTS = 400_000
ARM = Arm.paper()


def replay(
    trajectory: Trajectory, arm: Arm, interpreter: str, model: Arm | None, log: Path | None
) -> tuple[float, list[Sample]]:
    """(seconds that the replay took, its samples)."""
    samples: list[Sample] = []
    with (
        launch(
            LaunchOptions(interpreter=interpreters.starter(interpreter), arm=model, edge_log=log)
        ) as process,
        open_board(process.port) as board,
        StopRequest() as stop,
    ):
        arm_state.configure(board, arm, replace=True)
        arm_state.home(board, arm)
        stored = stored_motion.store(board, "feed", encode.motion_record(trajectory, arm))
        begin_s = time.monotonic()
        stored_motion.replay(board, stored, stop, lambda sample, _: samples.append(sample))
        return time.monotonic() - begin_s, samples


def plan(arm: Arm, degree: int) -> Trajectory:
    """The feeding motion."""
    return planner.plan(arm, replace(Job.paper(arm), degree=degree)).trajectory


def speed() -> None:
    """Seconds for the whole motion under each interpreter."""
    trajectory = plan(ARM, 5)
    print(f"feeding motion, {trajectory.duration_s:.2f} s; seconds that its replay takes")
    print(f"{'interpreter':<18}{'ideal motors':>14}{'and edge log':>14}{'shipped arm':>14}{'edges':>10}")
    for name in interpreters.AVAILABLE:
        with tempfile.TemporaryDirectory() as folder:
            log = Path(folder) / "edges"
            row = [
                replay(trajectory, ARM, name, model, path)[0]
                for model, path in ((None, None), (None, log), (ARM, None))
            ]
            edges = sum(len(ticks) for ticks, _ in edgelog.read(log)[-1].motion().values())
        print(f"{name:<18}" + "".join(f"{seconds:14.2f}" for seconds in row) + f"{edges:10}")


def ringing() -> None:
    """How far joint 1 swings about its command, quintic and cubic, seen by a fine encoder."""
    print("\njoint 1 of the shipped arm against its command, degrees, without backlash and scatter")
    print(f"{'spline':<18}{'first 0.6 s':>14}{'last 0.6 s':>14}{'anywhere':>14}")
    first = ARM.joints[0]
    encoder = Encoder(channel=1, counts_per_rev=FINE_COUNTS)
    model = replace(first.model, backlash_deg=0.0, scatter_deg=0.0)
    arm = replace(ARM, joints=(replace(first, encoder=encoder, model=model), *ARM.joints[1:]))
    for name, degree in (("quintic", 5), ("cubic", 3)):
        trajectory = plan(arm, degree)
        _, samples = replay(trajectory, arm, interpreters.AVAILABLE[-1], arm, None)
        time_s = np.array([sample.ticks / TICK_HZ for sample in samples])
        seen_deg = np.array([sample.positions.counts[0] for sample in samples]) * 360 / FINE_COUNTS
        off_deg = np.abs(seen_deg - trajectory(time_s)[:, 0])
        end_s = trajectory.joints[0].duration_s
        parts = (time_s <= 0.6, (time_s >= end_s - 0.6) & (time_s <= end_s + 0.05), time_s >= 0)
        print(f"{name:<18}" + "".join(f"{np.max(off_deg[part]):14.3f}" for part in parts))


if __name__ == "__main__":
    speed()
    ringing()
