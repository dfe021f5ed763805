"""Plans as JSON values, for scripts: what ``text_summary`` says in lines, with units in the keys."""

from __future__ import annotations

from typing import Any

from armtempo.model.plan import Plan
from armtempo.report import text_summary

_QUANTITIES = ("speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3")


def of_plan(plan: Plan) -> dict[str, Any]:
    """Motion time, and of each driven joint its time, lower bound, extremes and limits."""
    return {
        "name": plan.job.name,
        "arm": plan.arm.name,
        "duration_s": plan.trajectory.duration_s,
        "timing": plan.job.timing,
        "seed": plan.job.seed,
        "record_bytes": text_summary.record_bytes(plan),
        "joints": [_joint(plan, joint) for joint in range(len(plan.extremes))],
        "notes": list(plan.notes),
    }


def _joint(plan: Plan, joint: int) -> dict[str, Any]:
    driven = plan.arm.driven[joint]
    floors = [search.floor_s for search in plan.searches if joint in search.joints]
    return {
        "name": driven.name,
        "duration_s": plan.trajectory.joints[joint].duration_s,
        "floor_s": floors[0] if floors else None,
        "extremes": dict(zip(_QUANTITIES, map(float, plan.extremes[joint].values), strict=True)),
        "limits": dict(zip(_QUANTITIES, driven.limits.values, strict=True)),
    }
