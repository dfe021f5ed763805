"""The figures of each driven joint that a check rests on, as a table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from armtempo.arm_check import drives, torque
from armtempo.arm_check.resolution import resolutions
from armtempo.model.arm import Arm


@dataclass(frozen=True)
class JointFigures:
    """What one driven joint can do."""

    name: str
    steps_per_deg: float
    step_deg: float
    step_at_tool_mm: float
    """How far one step moves the tool at most."""
    top_steps_s: float
    """Step rate at the speed limit."""
    motor_rpm: float
    """Speed of the motor there."""
    torque_margin: float | None
    """Torque of the motor over what is asked of it; None: not known, infinite: nothing is asked."""

    @property
    def values(self) -> dict[str, Any]:
        """For JSON, which knows no infinity."""
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
    """Lines for people; none where nothing is driven."""
    if not joints:
        return []
    width = max(len("joint"), *(len(joint.name) for joint in joints))
    head = (
        f"{'joint':<{width}}  steps/deg    step deg  step at tool mm  top steps/s  motor rpm  torque margin"
    )
    return [head, *(_line(joint, width) for joint in joints)]


def _line(joint: JointFigures, width: int) -> str:
    margin = "not known" if joint.torque_margin is None else f"{joint.torque_margin:.3g} x"
    return (
        f"{joint.name:<{width}}  {joint.steps_per_deg:9.5g}  {joint.step_deg:10.4g}  {joint.step_at_tool_mm:15.3g}"
        f"  {joint.top_steps_s:11.0f}  {joint.motor_rpm:9.4g}  {margin:>13}"
    )
