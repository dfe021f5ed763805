"""Plans of jobs with parts of their motion replaced."""

from __future__ import annotations

from typing import Any

from armtempo.model.plan import Plan

_PARTS = ("arm", "job", "via_deg", "notes", "trajectory", "searches", "extremes", "versions")


def changed(plan: Plan, **parts: Any) -> Plan:
    """The plan of a job with other ``parts``, by their names in ``Plan.of_job``."""
    return Plan.of_job(**{name: getattr(plan, name) for name in _PARTS} | parts)
