"""Ten minutes of motion, recorded by a host that is stopped again and again: ``python -m tests.benchmark.pauses``.

A virtual board moves in real time; the recording process gets SIGSTOP every 3 to 20 s, for 2 s or for 8 s, and
SIGCONT behind it. Prints how many samples arrived and were lost.
"""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from armtempo.link import open_board
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.planning import planner
from armtempo.robot import arm_state
from armtempo.simulator import LaunchOptions, launch

SPEED_DEG_S = 0.3
VIAS = ((0.0, -60.0, 40.0), (90.0, -100.0, 0.0), (180.0, -38.0, -52.0))
PAUSES_S = (2.0, 8.0)
SEED = 3


def slow_plan() -> Plan:
    """A motion of about ten minutes."""
    arm = Arm.paper()
    joints = [
        replace(joint, limits=replace(joint.limits, speed_deg_s=SPEED_DEG_S)) if joint.limits else joint
        for joint in arm.joints
    ]
    job = Job("slow", VIAS, timing="shared", refine=4, bounds_s=(1.0, 600.0))
    return planner.plan(replace(arm, joints=tuple(joints)), job)


def record(plan: Plan, folder: Path, numbers: random.Random) -> list[float]:
    """Run the plan in a process of its own that is stopped now and then; gives the pauses."""
    file = folder / "slow.json"
    plan.save(file)
    pauses = []
    with launch(LaunchOptions(arm=plan.arm, virtual_time=False)) as process:
        with open_board(process.port) as board:
            arm_state.configure(board, plan.arm, replace=True)
            arm_state.home(board, plan.arm)
        words = ["run", str(file), "--port", process.port, "--out", str(folder)]
        host = subprocess.Popen([sys.executable, "-c", "from armtempo.cli import main; main()", *words])
        while True:
            try:
                host.wait(numbers.uniform(3.0, 20.0))
                return pauses
            except subprocess.TimeoutExpired:
                pauses.append(numbers.choice(PAUSES_S))
                host.send_signal(signal.SIGSTOP)
                time.sleep(pauses[-1])
                host.send_signal(signal.SIGCONT)


def main() -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as name:
        pauses = record(slow_plan(), Path(name), random.Random(SEED))
        (repetition,) = json.loads((Path(name) / "slow-001" / "run.json").read_text())["repetitions"]
    counts = ", ".join(f"{pauses.count(pause_s)} x {pause_s:.0f} s" for pause_s in PAUSES_S)
    lost = sum(count for _, count in repetition["lost"])
    print(f"{repetition['duration_s']:.1f} s of motion, pauses: {counts}")
    print(f"{repetition['state']}: {repetition['samples']} samples, {lost} lost")


if __name__ == "__main__":
    main()
