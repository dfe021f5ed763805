"""Checks of a job for its arm: errors, poses, moves of less than a step."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError, PlanError
from armtempo.diagnosis import units
from armtempo.diagnosis.finding import Finding, error, note, warning
from armtempo.kinematics import Geometry
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.tool_pose import Pose
from armtempo.planning import checks, planner, workspace_check
from armtempo.planning.line import follow, line_path


def findings(arm: Arm, path: Path) -> list[Finding]:
    """Findings about the job in the file ``path``."""
    suspected: list[Finding] = []
    try:
        job = Job.load(path, arm)
        arm = arm.with_tool(job.tool)
        suspected = _units(arm, job)
        checks.check_job(arm, job)
        job, via_deg, notes = planner.points_of(arm, job)
    except ArmtempoError as refused:
        text = "correct that; the rest of the job was not checked"
        return [*suspected, error("job", str(refused), text)]
    poses = [note("job", text, "change the pose, or accept it") for text in notes]
    touching = _touching(arm.holding(job.holds), via_deg)
    return [*suspected, *poses, *_steps(arm, via_deg), *touching, *_lines(arm, job, via_deg)]


def _lines(arm: Arm, job: Job, via_deg: Array) -> list[Finding]:
    """Lines and arcs of the tool that the arm cannot follow, or only near a singular posture."""
    if not job.tool_segments:
        return []
    try:
        led = line_path.led_legs(arm, job, via_deg)
    except PlanError as refused:
        return [error("job", refused.problem, refused.hint)]
    texts = [text for one in led.values() for text in follow.passed(one.followed)]
    return [note("job", text, "move the line, or turn the tool differently") for text in texts]


def _touching(arm: Arm, via_deg: Array) -> list[Finding]:
    """Via points at which the arm touches something."""
    return [
        error(
            "job",
            f"P{number}: {touch.description}",
            "move the via point, or correct [workspace] or radius_mm",
        )
        for number, angles in enumerate(via_deg)
        for touch in workspace_check.posture_touches(arm, angles)
    ]


def _units(arm: Arm, job: Job) -> list[Finding]:
    reach_mm = Geometry.of(arm).reach
    found = [
        units.position_finding(f"via point P{number}", np.array(via.matrix)[:3, 3], reach_mm)
        for number, via in enumerate(job.via)
        if isinstance(via, Pose)
    ]
    return [finding for finding in found if finding is not None]


def _steps(arm: Arm, via_deg: Array) -> list[Finding]:
    """Findings about joints that move by less than a step."""
    found = []
    for joint, angles in zip(arm.driven, via_deg.T, strict=True):
        move_deg = float(np.ptp(angles))
        if 0.0 < move_deg * joint.steps_per_deg < 1.0:
            text = f"{joint.name} is to move by {move_deg:.2g} {joint.unit.name}, less than a step"
            unit = "its positions are mm" if joint.slides else "angles are degrees"
            found.append(warning("job", text, f"check the unit: {unit}; it will not move, or make one step"))
    return found
