"""The ends of a URDF joint's range: its limits, and within them the soft limits of its safety controller."""

from __future__ import annotations

from typing import Any, NamedTuple

SOFT = "the soft limits of its safety_controller"


class Ends(NamedTuple):
    """In the URDF's unit, rad or m."""

    low: float
    high: float
    are_soft: bool
    """Whether one of them is a soft limit."""


def ends(joint: Any) -> Ends | None:
    """The ends of a joint's range; None without limits, as of a continuous joint."""
    hard, soft = joint.limit, _soft(joint)
    known = joint.type != "continuous" and hard is not None and None not in (hard.lower, hard.upper)
    if soft is None or not soft[0] < soft[1]:
        return Ends(hard.lower, hard.upper, False) if known else None
    if not known:
        return Ends(*soft, True)
    low, high = max(hard.lower, soft[0]), min(hard.upper, soft[1])
    if not low < high:
        return Ends(hard.lower, hard.upper, False)
    return Ends(low, high, (low, high) != (hard.lower, hard.upper))


def unread(joint: Any) -> str:
    """What is said of soft limits that leave no range; "" if there is nothing."""
    soft, found = _soft(joint), ends(joint)
    if soft is None or joint.mimic is not None:
        return ""
    if soft[0] < soft[1] and (found is None or max(found.low, soft[0]) < min(found.high, soft[1])):
        return ""
    return (
        f"joint {joint.name!r}: the soft limits of its safety_controller, {soft[0]:g} to {soft[1]:g}, leave it no "
        "range and are not used; correct them"
    )


def _soft(joint: Any) -> tuple[float, float] | None:
    """The soft limits; None if they are not given, 0 being what is left out."""
    controller = joint.safety_controller
    low, high = (getattr(controller, key, None) or 0.0 for key in ("soft_lower_limit", "soft_upper_limit"))
    return (low, high) if low or high else None
