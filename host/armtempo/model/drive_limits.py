"""What a joint's driver and encoder allow, beside the limits of its table: motions keep to the smaller of both."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from armtempo_shared.limits import MAX_STEP_RATE, TICK_HZ, TURN_SLACK_TICKS

from armtempo.model.parts import Driver, Encoder, Joint, Limits, Motor

MOST_COUNTS_S = 1e6
"""Largest rate of an encoder: fewer than 32 768 counts between two readings (board/docs/hardware.md)."""
_REVERSAL_STEPS = 0.16 * 0.99
"""Largest acceleration times the square of the time between opposite steps, of which the board allows 0.16."""
_SLACK_US = 1e6 * TURN_SLACK_TICKS / TICK_HZ


class Bound(NamedTuple):
    """A limit that hardware sets."""

    key: str
    """Of ``Limits``."""
    value: float
    reason: str


def bounds(motor: Motor, encoder: Encoder | None, driver: Driver) -> list[Bound]:
    """The limits that the driver's timing and the encoder set, for the joint."""
    step_us = driver.pulse_us + driver.low_us
    turn_us = max(driver.pulse_us + driver.dir_hold_us + driver.dir_setup_us + 2.0 * _SLACK_US, step_us)
    found = [
        Bound(
            "acceleration_deg_s2",
            _REVERSAL_STEPS / (1e-6 * turn_us) ** 2 / motor.steps_per_deg,
            f"dir_setup_us and dir_hold_us allow opposite steps {turn_us:g} us apart",
        )
    ]
    if 1e6 / step_us < MAX_STEP_RATE:  # else the board's rate is the smaller one, and refused beyond
        reason = f"pulse_us and low_us allow a step every {step_us:g} us, {1e6 / step_us:.0f} steps/s"
        found.append(Bound("speed_deg_s", 1e6 / step_us / motor.steps_per_deg, reason))
    if encoder is not None:
        turns = motor.gear_ratio if encoder.on == "motor" else 1.0
        counts_per_deg = encoder.counts_per_rev * turns / 360.0
        found.append(
            Bound(
                "speed_deg_s",
                MOST_COUNTS_S / counts_per_deg,
                f"its encoder is read up to {MOST_COUNTS_S:g} counts/s",
            )
        )
    return found


def kept(limits: Limits, motor: Motor, encoder: Encoder | None, driver: Driver) -> Limits:
    """The limits that motions keep."""
    for bound in bounds(motor, encoder, driver):
        if bound.value < getattr(limits, bound.key):
            limits = replace(limits, **{bound.key: bound.value})
    return limits


def exceeded(joint: Joint, driver: Driver) -> list[Bound]:
    """The bounds that the limits of the joint's table exceed; none without a motor."""
    if joint.motor is None or joint.limits is None:
        return []
    found = bounds(joint.motor, joint.encoder, driver)
    return [bound for bound in found if bound.value < getattr(joint.limits, bound.key)]
