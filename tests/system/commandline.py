"""The armtempo command as a user meets it: in this process by click's runner, or as a process of its own; a small plan.

In the process it has its imports already, which take a second of processor time. What sends a signal, kills, or runs at
the same time as something else needs ``start``.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from armtempo.cli import main
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import planner
from click.testing import CliRunner

COMMAND = (sys.executable, "-c", "from armtempo.__main__ import main; main()")
SLOW_S = 600.0
"""Nothing here takes longer, on however loaded a machine."""
ARM = Arm.paper()
SOURCES_BLOCKS = 1400
"""A flash in which the sources have space; the chip takes compiled files."""


@dataclass(frozen=True)
class Ended:
    """What a command did."""

    exit_code: int
    output: str
    errors: str

    def said(self, *words: str) -> None:
        """All of the words are in its error output, without a traceback."""
        assert "Traceback" not in self.errors, self.errors
        for word in words:
            assert word in self.errors, self.errors


def run(*arguments: str | Path, folder: Path, **environment: str) -> Ended:
    """Run to the end in ``folder``, on a virtual board unless another port is named; an exception passes through.

    In a process of its own for another ``PYTHONPATH``, in a thread, and for ``stop``, which begins before click does.
    """
    in_thread = threading.current_thread() is not threading.main_thread()
    if in_thread or "PYTHONPATH" in environment or arguments[0] == "stop":
        return ended(start(*arguments, folder=folder, **environment))
    runner = CliRunner(env={"ARMTEMPO_PORT": "sim", **environment})
    with chdir(folder):
        done = runner.invoke(main, [*map(str, arguments)], prog_name="armtempo", catch_exceptions=False)
    return Ended(done.exit_code, done.stdout, done.stderr)


def start(*arguments: str | Path, folder: Path, **environment: str) -> subprocess.Popen[str]:
    """Start in ``folder``, away from the terminal's signals; on a virtual board unless another port is named."""
    return subprocess.Popen(
        [*COMMAND, *map(str, arguments)],
        cwd=folder,
        env={**os.environ, "ARMTEMPO_PORT": "sim", "PYTHONUNBUFFERED": "1", **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def python(
    *arguments: str | Path, timeout: float = SLOW_S, **options: Any
) -> subprocess.CompletedProcess[str]:
    """This interpreter with ``arguments``, its output and errors kept as text."""
    command = [sys.executable, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout, **options)


def ended(process: subprocess.Popen[str], within_s: float = SLOW_S) -> Ended:
    """Wait for the end; a command that does not come to it within ``within_s`` is killed, and fails."""
    try:
        output, errors = process.communicate(timeout=within_s)
    except subprocess.TimeoutExpired:
        process.kill()
        output, errors = process.communicate()
        raise AssertionError(f"no end within {within_s} s; it said:\n{output}\n{errors}") from None
    return Ended(process.returncode, output, errors)


def wait_for(condition: Callable[[], bool], what: str) -> None:
    """Wait until ``condition`` holds."""
    limit_s = time.monotonic() + SLOW_S
    while not condition():
        assert time.monotonic() < limit_s, f"waited in vain for {what}"
        time.sleep(0.02)


def small_plan(path: Path, end_deg: tuple[float, ...] = (20.0, -75.0, 50.0), name: str = "small") -> Path:
    """A trajectory file that needs little search: from the paper arm's home straight to ``end_deg``."""
    start_deg = tuple(joint.home_deg for joint in ARM.driven)
    job = Job(
        name,
        (start_deg, end_deg),
        timing="per-joint",
        refine=1,
        polish=False,
        bounds_s=(0.1, 3.0),
        population=5,
        iterations=20,
        path="through",
    )
    planner.plan(ARM, job).save(path)
    return path


def armtempo(*arguments: str | Path, folder: Path, code: int = 0) -> str:
    """A command's output, both streams; it must end with ``code``."""
    done = run(*arguments, folder=folder)
    assert done.exit_code == code, done.output + done.errors
    return done.output + done.errors
