"""From the key press to the brake: ``python -m tests.benchmark.stop_latency``.

A program runs a motion on the virtual board in real time. A hundred times each it is stopped by ``armtempo stop`` in
another process, from the start of that process on (the key press), and by Ctrl-C, from the signal on. The end is
when the board's answer to the stop has reached the program that watches: a little after it braked. Besides them
the least that any command costs here: a Python that starts and ends. A time takes about 3.5 s.
"""

from __future__ import annotations

import argparse
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from armtempo.robot.shared_board import SharedBoard, find
from armtempo.simulator import LaunchOptions, launch

OWNER = """
import sys
import armtempo
arm = armtempo.Arm.paper()
plan = armtempo.plan(arm, armtempo.Job("long", via_deg=[[0, -60, 40], [170, -10, -50]], path="through"))
with armtempo.connect(sys.argv[1], arm) as board:
    board.upload(plan)
    while True:
        board.home(arm, plan)
        try:
            board.run(plan, out=sys.argv[2])
        except armtempo.Stopped:
            pass
        print("stopped", flush=True)
"""
"""Begins anew where it was stopped, as if the arm stood at the start again: the board takes its word for it."""
STOP = (str(Path(sys.executable).with_name("armtempo")), "stop", "--port")
"""The command as pip installs it."""
_AFTER_SAMPLES = 3
_PATIENCE_S = 60.0


@dataclass
class Watch:
    """What the program that runs the motion says of it."""

    shared: SharedBoard
    moving: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))
    stopped_s: queue.Queue[float] = field(default_factory=queue.Queue)
    """When stops were answered; the program that is stopped says it once more than who asked."""

    def follow(self) -> None:
        """Note when samples come and when a stop was answered; ends with the port."""
        run = 0
        for message in self.shared.watch("sample", "traffic"):
            if message["topic"] == "sample" and message["run"] > run and message["index"] >= _AFTER_SAMPLES:
                run = message["run"]
                self.moving.release()
            if any("ok stop" in word for word in message.get("words", ())):
                self.stopped_s.put(time.monotonic())


def measure(watch: Watch, times: int, press: Callable[[], object]) -> list[float]:
    """Seconds from each ``press`` to the brake."""
    found = []
    for _ in range(times):
        assert watch.moving.acquire(timeout=_PATIENCE_S), "no motion"
        begin_s = time.monotonic()
        ended = press()
        while (stopped_s := watch.stopped_s.get(timeout=_PATIENCE_S)) < begin_s:
            pass
        found.append(stopped_s - begin_s)
        # It waits for the arm's rest, and the next motion begins at once
        if isinstance(ended, subprocess.Popen):
            ended.kill()
            ended.wait()
    return found


def python_starts(times: int) -> list[float]:
    """Seconds that a Python takes to start and end."""
    found = []
    for _ in range(times):
        begin_s = time.monotonic()
        subprocess.run([sys.executable, "-c", ""], check=True)
        found.append(time.monotonic() - begin_s)
    return found


def show(name: str, seconds: list[float]) -> None:
    """A line: median and worst in ms, of how many, and how busy the machine was."""
    ordered = sorted(1000 * value for value in seconds)
    print(
        f"{name:<30} median {ordered[len(ordered) // 2]:6.1f} ms   worst {ordered[-1]:6.1f} ms   of {len(ordered)}"
        f"   load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors",
        flush=True,
    )


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--times", type=int, default=100)
    times = parser.parse_args().times
    options = LaunchOptions(virtual_time=False)
    with launch(options) as board, tempfile.TemporaryDirectory() as folder:
        owner = subprocess.Popen([sys.executable, "-c", OWNER, board.port, folder], stdout=subprocess.DEVNULL)
        try:
            while (shared := find(board.port)) is None:
                time.sleep(0.05)
            with shared:
                watch = Watch(shared)
                threading.Thread(target=watch.follow, daemon=True).start()
                by_stop = measure(
                    watch,
                    times,
                    lambda: subprocess.Popen(
                        [*STOP, board.port], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
                    ),
                )
                show("'armtempo stop' to the brake", by_stop)
                by_key = measure(watch, times, lambda: owner.send_signal(signal.SIGINT))
                show("Ctrl-C to the brake", by_key)
        finally:
            owner.kill()
            owner.wait()
    show("a Python that starts and ends", python_starts(times))


if __name__ == "__main__":
    main()
