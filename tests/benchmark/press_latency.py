"""From a press to the first step, with six joints: ``python -m tests.benchmark.press_latency``.

A virtual board in real time behind a cable that notes when the board's words pass. A hundred times each a held jog of a
joint and of the tool by the library, and ``armtempo goto`` in a process of its own, from its start on (Enter): until
the motion begins, by the board's clock, and until its first step, which the law of the move makes later. Besides them
a Python that starts and ends, and the processor time of a press until it is with the board. A press in a browser:
``panel_stops --only first``.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from armtempo.model.arm import Arm
from armtempo.robot.connect import connect
from armtempo.simulator import LaunchOptions, launch
from armtempo_shared.limits import TICK_HZ

from tests.benchmark.jogs import first_step_s
from tests.benchmark.panel_stops import Ear
from tests.benchmark.stop_latency import python_starts
from tests.system.relay import Cable, Relay

ARM = Arm.load("ar4")
ELBOW_DEG = (20.0, 10.0, -20.0, 15.0, 40.0, 30.0)
"""Far from any singular posture."""
BY_DEG = 5.0
_PATIENCE_S = 30.0


@dataclass
class Times:
    """Of all presses of a kind, seconds."""

    began: list[float] = field(default_factory=list)
    stepped: list[float] = field(default_factory=list)
    processor: list[float] = field(default_factory=list)
    """Of this program."""

    def show(self, name: str) -> None:
        """Lines: median, 95 % and worst in ms."""
        for what, seconds in (("begins", self.began), ("steps", self.stepped), ("processor", self.processor)):
            if seconds:
                ordered = 1000 * np.quantile(seconds, (0.5, 0.95, 1.0))
                print(
                    f"{name}: {what:<10} median {ordered[0]:6.1f} ms   95 % {ordered[1]:6.1f}   worst {ordered[2]:6.1f}"
                    f"   of {len(seconds)}   load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors",
                    flush=True,
                )


def began_s(ear: Ear, after_s: float) -> float:
    """When the motion began whose samples come after a time."""
    while ear.sample is None or ear.sample[0] < after_s:
        assert time.monotonic() < after_s + _PATIENCE_S, "no motion"
        time.sleep(0.001)
    return ear.sample[0] - ear.sample[1].ticks / TICK_HZ


def by_library(ear: Ear, port: str, times: int) -> None:
    """Held jogs of a joint, and along an axis of the tool, to and fro."""
    with connect(port, ARM) as board:
        board.home(ARM, ELBOW_DEG)
        for name, moved in (("joint", {"joint": 1}), ("tool", {"axis": "x"})):
            found = Times()
            for number in range(times):
                begin_s, before_s = time.monotonic(), time.process_time()
                jog = board.motions.held_jog(**moved, direction=(-1) ** number)
                with jog:
                    found.processor.append(time.process_time() - before_s)
                    jog.hold(0.25)
                at_s = began_s(ear, begin_s)
                found.began.append(at_s - begin_s)
                found.stepped.append(at_s - begin_s + first_step_s(ARM, jog.motion.trajectory))
            found.show(f"held jog, {name}")


def by_command(ear: Ear, port: str, times: int) -> None:
    """``armtempo goto``."""
    found = Times()
    command = str(Path(sys.executable).with_name("armtempo"))
    for number in range(times):
        there = [angle + BY_DEG * (number % 2 == 0) for angle in ELBOW_DEG]
        begin_s = time.monotonic()
        subprocess.run(
            [command, "goto", "--port", port, "--arm", "ar4", "--", ",".join(map(str, there))],
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        found.began.append(began_s(ear, begin_s) - begin_s)
    found.show("goto")


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--times", type=int, default=100)
    options = parser.parse_args()
    ear = Ear()
    with (
        tempfile.TemporaryDirectory() as folder,
        launch(LaunchOptions(virtual_time=False)) as process,
        Relay(process.port, Path(folder) / "port", Cable(), ear) as relay,
    ):
        by_library(ear, relay.port, options.times)
        by_command(ear, relay.port, options.times)
    starts = Times(began=python_starts(options.times))
    starts.show("Python, which")


if __name__ == "__main__":
    main()
