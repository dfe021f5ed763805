"""Plans of jobs with parts of their motion replaced."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from armtempo.model.plan import Plan

_OF_THE_WHOLE = ("arm", "trajectory", "notes", "versions")


def changed(plan: Plan, **parts: Any) -> Plan:
    """The plan of a job with other ``parts``: of the whole, or of how its motion was found."""
    whole = {name: parts.pop(name, getattr(plan, name)) for name in _OF_THE_WHOLE}
    return Plan.of_job(solution=replace(plan.solution, **parts), **whole)
