"""Plausibility checks of an arm file and a job, with advice."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from armtempo.basics.errors import InputError, PlanError
from armtempo.diagnosis import drives, figures, geometry, torque, units, wiring
from armtempo.diagnosis.finding import Finding, Level, error, note, warning
from armtempo.model.arm import STILL_DEG, Arm
from armtempo.model.posture import HOME


def check(arm_file: Path, job_file: Path | None = None) -> tuple[Arm | None, list[Finding]]:
    """The arm of the file (None if it cannot be read), and all findings about it and the job.

    Errors of the readers are findings too.
    """
    try:
        arm = Arm.read(arm_file)
    except InputError as refused:
        return None, [error("arm file", str(refused), "correct that; the rest of the file was not checked")]
    found = check_arm(arm)
    if job_file is None:
        return arm, found
    if any(finding.level is Level.ERROR for finding in found):
        return arm, [*found, note("job", "not checked", "correct the arm first")]
    from armtempo.diagnosis import job  # here, because it imports the whole planner

    return arm, _sorted([*found, *job.findings(arm, job_file)])


def check_arm(arm: Arm) -> list[Finding]:
    """All findings about an arm, errors first; it may have no motors (``Arm.read``)."""
    found = [*units.findings(arm), *geometry.findings(arm), *_motors(arm)]
    if arm.driven:
        found += drives.findings(arm)
        found += figures.findings(arm)
        found += drives.encoder_findings(arm)
        found += torque.findings(arm)
        found += wiring.findings(arm)
        if not any(finding.level is Level.ERROR for finding in found):
            found += drives.record_findings(arm)
            found += _postures(arm)
            found += _touching(arm)
    return _sorted(found)


def _postures(arm: Arm) -> list[Finding]:
    """Findings about named postures whose tool pose has no solution."""
    from armtempo.planning import via_points  # here, because it imports the inverse kinematics

    try:
        via_points.check_postures(arm)
    except InputError as refused:
        return [error("posture", refused.problem, refused.hint)]
    return []


def _touching(arm: Arm) -> list[Finding]:
    """Findings about touching parts in the home posture, the named postures, and on the ways to the switches."""
    from armtempo.planning import via_points, workspace_check  # here, as above

    found = []
    for posture in (arm.posture(HOME), *arm.postures):
        try:
            angles = via_points.posture_deg(arm, posture)
        except PlanError:
            continue  # said above
        found += [
            error(
                "workspace",
                f"posture {posture.name}: {touch.description}",
                "correct the posture, [workspace] or radius_mm",
            )
            for touch in workspace_check.posture_touches(arm, angles)
        ]
    if not found:
        found += [
            warning(
                "homing",
                f"a way {problem}",
                "home other joints first ('homing' in the arm file), or put the switch at the other end; nothing "
                "checks the ways of homing while it moves",
            )
            for problem in workspace_check.touching(arm)
        ]
    return found


def _sorted(found: list[Finding]) -> list[Finding]:
    """Errors first, notes last, each in the order found."""
    return sorted(found, key=lambda finding: list(Level).index(finding.level))


def _motors(arm: Arm) -> list[Finding]:
    if not arm.driven:
        next_step = "give each driven joint a motor and a limits table; imported files have them as '#' lines"
        return [error("motors", "no joint has a motor, so nothing can move", next_step)]
    still = [
        joint.name for joint in arm.joints if joint.motor is None and np.ptp(joint.range_deg) > STILL_DEG
    ]
    if not still:
        return []
    text = f"no motor: {', '.join(still)}; they stand still at home_deg"
    return [note("motors", text, "give them a motor and limits table if they are to be driven")]


def examine_arm(path: Path) -> list[Finding]:
    """Whether the arm file can be read, and the number of errors and warnings."""
    arm, findings = check(path)
    errors = sum(finding.level is Level.ERROR for finding in findings)
    warnings = sum(finding.level is Level.WARNING for finding in findings)
    name = f"{arm.name}, {len(arm.driven_indices)} driven joints" if arm else "not readable"
    level = Level.ERROR if errors else Level.NOTE if warnings else Level.GOOD
    advice = f"armtempo check --arm {path}" if errors or warnings else ""
    return [Finding(level, str(path), f"{name}; {errors} errors, {warnings} warnings", advice)]
