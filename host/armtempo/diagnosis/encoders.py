"""Checks of encoders: resolution, rate, following error."""

from __future__ import annotations

from armtempo.diagnosis.finding import Finding, error, note, warning
from armtempo.model.arm import Arm
from armtempo.model.parts import DrivenJoint

_FASTEST_COUNTS_S = 1e6
"""Largest rate: fewer than 32 768 counts between two readings (board/docs/hardware.md)."""


def findings(arm: Arm) -> list[Finding]:
    """Findings about the encoders."""
    found = [finding for joint in arm.driven if joint.encoder for finding in _of(joint)]
    without = [joint.name for joint in arm.driven if joint.encoder is None]
    if without:
        text = f"no encoder: {', '.join(without)}; lost steps there are not seen"
        found.append(
            note("encoders", text, "nothing to do; with an encoder the board would stop on a lost step")
        )
    return found


def _of(joint: DrivenJoint) -> list[Finding]:
    assert joint.encoder is not None
    limit_deg, count_deg = joint.encoder.following_error_deg, 1.0 / joint.counts_per_deg
    found = []
    if joint.limits.speed_deg_s / count_deg > _FASTEST_COUNTS_S:
        text = f"at its speed limit the encoder gives {joint.limits.speed_deg_s / count_deg:.3g} counts/s"
        found.append(
            warning(joint.name, text, "lower speed_deg_s: above a million counts/s they may be miscounted")
        )
    if limit_deg == 0.0:
        text = "its encoder is recorded, but following_error_deg = 0 lets nobody watch it"
        found.append(
            note(joint.name, text, "give following_error_deg, such as 2.0, to stop when steps are lost")
        )
    elif limit_deg < count_deg:
        text = (
            f"following_error_deg = {limit_deg:g} is less than one count of its encoder, {count_deg:.3g} deg"
        )
        found.append(error(joint.name, text, "raise following_error_deg, or check counts_per_rev and 'on'"))
    elif limit_deg < _ordinary_deg(joint, count_deg):
        text = (
            f"following_error_deg = {limit_deg:g} is less than what a healthy joint may show: a full step of lag, "
            f"two counts and the backlash, {_ordinary_deg(joint, count_deg):.3g} deg"
        )
        found.append(warning(joint.name, text, "raise it above that, else it trips in ordinary motion"))
    return found


def _ordinary_deg(joint: DrivenJoint, count_deg: float) -> float:
    """Largest following error of a joint without a lost step, degrees."""
    full_step_deg = 360.0 / joint.motor.steps_per_rev / joint.motor.gear_ratio
    return full_step_deg + 2 * count_deg + joint.model.backlash_deg
