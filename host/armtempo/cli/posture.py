"""Postures on the command line: angles, a via point of a job, or the start of a trajectory."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from armtempo.errors import InputError

if TYPE_CHECKING:
    from armtempo.arrays import Array
    from armtempo.model.arm import Arm
    from armtempo.robot.board import Board

_VIA = re.compile(r"[Pp]\d+")


def is_named(text: str) -> bool:
    """Whether the text means a via point or a trajectory file, and no angles."""
    return bool(_VIA.fullmatch(text)) or text.endswith(".json")


def parse(text: str, arm: Arm, job_path: Path | None) -> Array:
    """Angles in degrees (J,): of '0,-60,40', of 'P3' in the job, or of the start of 'file.json'.

    Raises InputError where the text is none of these, or does not fit the arm.
    """
    from armtempo.planning import point_to_point

    if _VIA.fullmatch(text):
        return _via(int(text[1:]), arm, job_path)
    if text.endswith(".json"):
        from armtempo import pipeline

        return pipeline.load(text, arm).trajectory(0.0)
    try:
        angles_deg = [float(cell) for cell in text.split(",")]
    except ValueError:
        raise InputError(
            f"{text!r} is no posture",
            "give angles in degrees ('0,-60,40'), a via point of the job ('P0') or a trajectory file",
        ) from None
    return point_to_point.posture(angles_deg, arm)


def where_it_is(board: Board) -> str:
    """Where the arm is, as the commands that place it say in the end."""
    return f"the arm stands at {words(board.posture_deg())}"


def words(angles_deg: Array) -> str:
    """A posture as text: the driven joints' angles in degrees."""
    return ", ".join(f"{round(angle, 2) + 0.0:.2f}" for angle in angles_deg) + " degrees"


def _via(index: int, arm: Arm, job_path: Path | None) -> Array:
    from armtempo.cli import options
    from armtempo.planning import planner

    job = options.load_job(job_path, arm)
    via_deg, _ = planner.via_angles(arm, job)
    if index >= len(via_deg):
        raise InputError(
            f"job {job.name!r} has no via point P{index}",
            f"give one of P0 to P{len(via_deg) - 1}",
        )
    return np.asarray(via_deg[index])
