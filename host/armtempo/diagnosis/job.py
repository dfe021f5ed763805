"""A job against its arm: whether it can be read, reached and seen in steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError
from armtempo.diagnosis.finding import Finding, error, note, warning
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import checks, planner


def findings(arm: Arm, path: Path) -> list[Finding]:
    """What looks wrong about the job in the file ``path``."""
    try:
        job = Job.load(path, arm)
        checks.check_job(arm, job)
        via_deg, notes = planner.via_angles(arm, job)
    except ArmtempoError as refused:
        return [error("job", str(refused), "correct that; the rest of the job was not looked at")]
    told = [note("job", text, "change the pose, or take it as it is") for text in notes]
    return [*told, *_steps(arm, via_deg)]


def _steps(arm: Arm, via_deg: Array) -> list[Finding]:
    """Joints that are to move, but by less than a step."""
    found = []
    for joint, angles in zip(arm.driven, via_deg.T, strict=True):
        way_deg = float(np.ptp(angles))
        if 0.0 < way_deg * joint.steps_per_deg < 1.0:
            text = f"{joint.name} is to move by {way_deg:.2g} deg, less than a step"
            found.append(
                warning(
                    "job", text, "check the unit: angles are degrees; it will stand still or make one step"
                )
            )
    return found
