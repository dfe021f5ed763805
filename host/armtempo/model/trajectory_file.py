"""The trajectory file: a plan as JSON, whole enough to run it and to plan it again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from armtempo_shared.basis import BASIS

from armtempo.errors import InputError
from armtempo.formats import json_codec
from armtempo.formats.atomic_file import replace_text, why
from armtempo.model import arm_json
from armtempo.model.plan import Plan
from armtempo.splines.trajectory import JointSpline

FORMAT = "armtempo trajectory"
VERSION = 1


def save(plan: Plan, path: Path | str) -> None:
    """Write the plan, whole or not at all.

    Raises InputError where the file cannot be written.
    """
    content = {"format": FORMAT, "version": VERSION, "plan": json_codec.encode(plan)}
    text = json.dumps(content, indent=1, allow_nan=False)
    replace_text(Path(path), text + "\n")


def load(path: Path | str) -> Plan:
    """The plan of a trajectory file.

    Raises InputError for a file that is missing, cut, of another format or version, or holds a key, value or
    shape that this program does not understand.
    """
    content = _read(path)
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise InputError(f"{path}: is not a trajectory file", "make one with: armtempo plan")
    if content.get("version") != VERSION:
        raise InputError(
            f"{path}: has version {content.get('version')!r}, this program reads version {VERSION}",
            "plan it again",
        )
    if content.keys() != {"format", "version", "plan"}:
        raise InputError(
            f"{path}: unknown or missing key beside format, version and plan",
            "plan it again",
        )
    plan: Plan = json_codec.decode(Plan, content["plan"], f"{path}: plan")
    _check(plan, path)
    return plan


def _read(path: Path | str) -> Any:
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(
            f"{path}: no such file",
            f"check the path, or make it with: armtempo plan -o {path}",
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {why(error)}", "check its permissions") from None
    try:
        return json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: damaged or cut: {error}", "plan it again or copy it again") from None


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is not a number")


def _check(plan: Plan, path: Path | str) -> None:
    """Check what types cannot express: shapes, increasing times, one spline for each driven joint."""
    arm_json.check(plan.arm, f"{path}: arm", "plan it again")
    joints, driven = plan.trajectory.joints, plan.arm.driven
    if not joints or len(joints) != len(driven):
        raise InputError(
            f"{path}: {len(joints)} joints in the trajectory, the arm drives {len(driven)}",
            "plan it again",
        )
    if plan.via_deg.shape[1:] != (len(driven),) or len(plan.extremes) != len(driven):
        raise InputError(
            f"{path}: via_deg and extremes must have an entry for each of {len(driven)} joints",
            "plan it again",
        )
    for number, spline in enumerate(joints, 1):
        _check_spline(spline, len(plan.via_deg) - 1, f"{path}: trajectory joint {number}")
    if plan.trajectory.shared and any(
        not np.array_equal(spline.time_points_s, joints[0].time_points_s) for spline in joints
    ):
        raise InputError(
            f"{path}: shared timing, but the joints' time control points differ",
            "plan it again",
        )
    if any(not 0 <= index < len(joints) for search in plan.searches for index in search.joints):
        raise InputError(f"{path}: searches name a joint that there is not", "plan it again")


def _check_spline(spline: JointSpline, segments: int, where: str) -> None:
    if spline.degree not in BASIS or spline.refine < 1:
        raise InputError(
            f"{where}: degree {spline.degree} with refine {spline.refine} is not known",
            "plan it again",
        )
    for what, points, pieces in (
        ("angle", spline.angle_points_deg, segments),
        ("time", spline.time_points_s, segments * spline.refine),
    ):
        if points.shape != (pieces + spline.degree,):
            raise InputError(
                f"{where}: {points.size} {what} control points do not fit {pieces} segments",
                "plan it again",
            )
    if not np.all(np.diff(spline.time_points_s) > 0):
        raise InputError(f"{where}: its time control points do not increase", "plan it again")
