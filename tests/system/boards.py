"""Virtual boards and the command line as processes, for the system tests."""

from __future__ import annotations

import subprocess
from pathlib import Path

from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import planner

from tests.system import commandline

ARM = Arm.paper()
SOURCES_BLOCKS = 1200
"""A flash in which the sources have room; the chip takes compiled files."""
TIMEOUT_S = commandline.SLOW_S


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
    )
    planner.plan(ARM, job).save(path)
    return path


def start(*arguments: str | Path, cwd: Path) -> subprocess.Popen[str]:
    """An armtempo command under way."""
    return commandline.start(*arguments, folder=cwd, PYTHONUNBUFFERED="1")


def armtempo(*arguments: str | Path, cwd: Path, code: int = 0) -> str:
    """An armtempo command's output, both streams; it must end with ``code``."""
    done = commandline.run(*arguments, folder=cwd)
    assert done.exit_code == code, done.output + done.errors
    return done.output + done.errors
