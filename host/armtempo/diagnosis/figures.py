"""The values of each driven joint that are checked, as a table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from armtempo.basics.text import aligned
from armtempo.diagnosis import drives, torque
from armtempo.diagnosis.resolution import resolutions
from armtempo.model.arm import Arm

_HEAD = ("joint", "steps/deg", "step deg", "step at tool mm", "top steps/s", "motor rpm", "torque margin")
_WIDTHS = (5, 11, 12, 17, 13, 11, 15)


@dataclass(frozen=True)
class JointFigures:
    """Resolution, speed and torque of one driven joint."""

    name: str
    steps_per_deg: float
    step_deg: float
    step_at_tool_mm: float
    """Largest motion of the tool by one step."""
    top_steps_s: float
    """Step rate at the speed limit."""
    motor_rpm: float
    """Motor speed at the speed limit."""
    torque_margin: float | None
    """Torque of the motor divided by the needed torque; None: not known, infinite: none is needed."""

    @property
    def values(self) -> dict[str, Any]:
        """Values for JSON, which has no infinity."""
        margin = None if self.torque_margin is None or math.isinf(self.torque_margin) else self.torque_margin
        return {**asdict(self), "torque_margin": margin}


def of(arm: Arm) -> tuple[JointFigures, ...]:
    """The figures of all driven joints."""
    return tuple(
        JointFigures(
            name=joint.name,
            steps_per_deg=1.0 / resolution.step_deg,
            step_deg=resolution.step_deg,
            step_at_tool_mm=resolution.step_mm,
            top_steps_s=drives.top_rate_steps_s(joint),
            motor_rpm=drives.motor_rpm(joint),
            torque_margin=torque.margin(joint),
        )
        for resolution in resolutions(arm)
        for joint in (resolution.joint,)
    )


def table(joints: Sequence[JointFigures]) -> list[str]:
    """Lines for people; none if nothing is driven."""
    return aligned([_HEAD, *map(_row, joints)], _WIDTHS) if joints else []


def _row(joint: JointFigures) -> tuple[str, ...]:
    return (
        joint.name,
        f"{joint.steps_per_deg:.5g}",
        f"{joint.step_deg:.4g}",
        f"{joint.step_at_tool_mm:.3g}",
        f"{joint.top_steps_s:.0f}",
        f"{joint.motor_rpm:.4g}",
        "not known" if joint.torque_margin is None else f"{joint.torque_margin:.3g} x",
    )
