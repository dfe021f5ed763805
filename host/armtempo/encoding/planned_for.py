"""Whether a plan is for an arm as it is now."""

from __future__ import annotations

from pathlib import Path

from armtempo.basics.errors import InputError
from armtempo.encoding import made_with
from armtempo.encoding.encode import arm_record
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan


def check(what: Path | str, plan: Plan, arm: Arm) -> None:
    """Raise InputError if a plan, named ``what``, is for another arm, or old as in ``check_surroundings``."""
    if arm_record(plan.arm) != arm_record(arm):
        raise InputError(
            f"{what} was planned for a different arm than {_named(arm)}", "plan it again with this arm"
        )
    check_surroundings(what, plan, arm)


def check_surroundings(what: Path | str, plan: Plan, arm: Arm) -> None:
    """Raise InputError if something that a plan was made with has changed since."""
    if change := made_with.changed(made_with.of_plan(plan), arm, plan.arm):
        raise InputError(f"{what} is old: {change}, in {_named(arm)}", "plan it again with this arm")


def _named(arm: Arm) -> str:
    return f"arm {arm.name!r}" + (f" ({arm.source})" if arm.source else "")
