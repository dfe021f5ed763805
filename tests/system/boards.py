"""Virtual boards and the command line as processes, for the system tests."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from armtempo import arm, planner, trajectory_file
from armtempo.job import Job

ARM = arm.load_arm(arm.default_path())
COMMAND = [sys.executable, "-c", "from armtempo.cli import main; main()"]
TIMEOUT_S = 120


def small_plan(path: Path, end_deg: tuple[float, ...] = (20.0, -75.0, 50.0)) -> Path:
    """A trajectory file that needs little search: from the paper arm's home straight to ``end_deg``."""
    start_deg = tuple(joint.home_deg for joint in ARM.driven)
    job = Job("small", (start_deg, end_deg), population=5, iterations=20)
    trajectory_file.save(planner.plan(ARM, job), path)
    return path


def start(*arguments: str | Path, cwd: Path) -> subprocess.Popen[str]:
    """An armtempo command under way."""
    return subprocess.Popen(
        [*COMMAND, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=cwd,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )


def armtempo(*arguments: str | Path, cwd: Path, code: int = 0) -> str:
    """An armtempo command's output, both streams; it must end with ``code``."""
    process = start(*arguments, cwd=cwd)
    out, error = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == code, out + error
    return out + error
