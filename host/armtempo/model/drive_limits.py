"""What a joint's driver, motor and encoder allow, beside the limits of its table: motions keep to the smaller of both.

A motor with backlash has part of its speed and acceleration for that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from armtempo_shared.limits import MAX_STEP_RATE, REVERSAL_SLACK_TICKS, TICK_HZ

from armtempo.model.parts import Driver, Encoder, Joint, Limits, Motor
from armtempo.model.transmission import Matrix

MOST_COUNTS_S = 1e6
"""Largest rate of an encoder: fewer than 32 768 counts between two readings (board/docs/hardware.md)."""
CROSSING_SHARE = 0.25
"""Most of a motor's speed and acceleration that it uses to cross its backlash."""
_REVERSAL_STEPS = 0.16 * 0.99
"""Largest acceleration times the square of the time between opposite steps, of which the board allows 0.16."""
_CURVE_END = 1.0 - 1e-6
"""Of a torque curve's last speed, so that rounding leads to no speed beyond it, where the curve has no torque."""
_SLACK_US = 1e6 * REVERSAL_SLACK_TICKS / TICK_HZ


class Bound(NamedTuple):
    """A limit that hardware sets, of a joint or of its motor."""

    key: str
    """Of ``Limits``."""
    value: float
    reason: str


def bounds(motor: Motor, encoder: Encoder | None, driver: Driver) -> list[Bound]:
    """The limits that the driver's timing, the encoder and the torque curve set, for the motor behind its gear."""
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
    if motor.curve_rpm_nm:
        last_rpm, _ = motor.curve_rpm_nm[-1]
        speed = _CURVE_END * 6.0 * last_rpm / motor.reduction
        found.append(Bound("speed_deg_s", speed, f"its curve_rpm_nm ends at {last_rpm:g} rpm"))
    if encoder is not None:
        turns = motor.gear_ratio if encoder.on == "motor" else 1.0
        counts_per_deg = encoder.counts_per_rev * turns / motor.per_rev
        found.append(
            Bound(
                "speed_deg_s",
                MOST_COUNTS_S / counts_per_deg,
                f"its encoder is read up to {MOST_COUNTS_S:g} counts/s",
            )
        )
    return found


class Crossing(NamedTuple):
    """How a motor crosses its backlash: behind its gear, beside the motion of its joint."""

    play_deg: float
    speed_deg_s: float
    """Reached in the middle of the play."""
    acceleration_deg_s2: float
    """It speeds up with this in the first half of the play, and slows down with it in the second."""
    speed_share: float
    """Of the motor's largest speed,"""
    acceleration_share: float
    """and of its largest acceleration."""

    @property
    def duration_s(self) -> float:
        """From the reversal until the play is crossed."""
        return 2.0 * math.sqrt(self.play_deg / self.acceleration_deg_s2)


def crossings(joints: Sequence[Joint], coupling: Matrix, driver: Driver) -> list[Crossing | None]:
    """How each motor of the driven joints crosses its backlash; None without."""
    limits = np.array([of_joint.values for of_joint in _of_hardware(joints, coupling, driver)])
    found: list[Crossing | None] = []
    for row, joint in zip(_rows(joints, coupling), joints, strict=True):
        assert joint.motor is not None
        play = joint.motor.backlash_deg
        speed, most, _ = (np.abs(row) @ limits).tolist()
        acceleration = min(CROSSING_SHARE * most, (CROSSING_SHARE * speed) ** 2 / play) if play else 0.0
        extra = math.sqrt(acceleration * play)
        found.append(
            Crossing(play, extra, acceleration, extra / speed, acceleration / most) if play else None
        )
    return found


def kept(joints: Sequence[Joint], coupling: Matrix, driver: Driver) -> list[Limits]:
    """The limits that motions of the driven joints keep.

    Those of the tables or of the hardware, less what the motors that turn a joint need to cross their backlash.
    """
    limits = _of_hardware(joints, coupling, driver)
    of_motors = [*zip(_rows(joints, coupling), crossings(joints, coupling, driver), strict=True)]
    for number, of_joint in enumerate(limits):
        turning = [crossing for row, crossing in of_motors if crossing and row[number]]
        if turning:
            limits[number] = replace(
                of_joint,
                speed_deg_s=of_joint.speed_deg_s * (1.0 - max(one.speed_share for one in turning)),
                acceleration_deg_s2=of_joint.acceleration_deg_s2
                * (1.0 - max(one.acceleration_share for one in turning)),
            )
    return limits


def _rows(joints: Sequence[Joint], coupling: Matrix) -> Matrix:
    """Of the motors: how each turns with the joints."""
    return coupling or tuple(tuple(row) for row in np.eye(len(joints)).tolist())


def _of_hardware(joints: Sequence[Joint], coupling: Matrix, driver: Driver) -> list[Limits]:
    """The limits of the tables, or what driver and encoder allow, if that is less."""
    found = []
    for joint, bounds_of_joint in zip(joints, _of_joints(joints, coupling, driver), strict=True):
        limits = joint.limits
        assert limits is not None
        for bound in bounds_of_joint:
            if bound.value < getattr(limits, bound.key):
                limits = replace(limits, **{bound.key: bound.value})
        found.append(limits)
    return found


def exceeded(joints: Sequence[Joint], coupling: Matrix, driver: Driver) -> list[tuple[Joint, Bound]]:
    """The bounds that limits in the tables of the driven joints exceed."""
    return [
        (joint, bound)
        for joint, bounds_of_joint in zip(joints, _of_joints(joints, coupling, driver), strict=True)
        for bound in bounds_of_joint
        if bound.value < getattr(joint.limits, bound.key)
    ]


def _of_joints(joints: Sequence[Joint], coupling: Matrix, driver: Driver) -> list[list[Bound]]:
    """The bounds of each joint.

    A motor that several joints turn keeps its bounds if all of them move at their limits together, which are therefore
    lowered in proportion.
    """
    motors = [bounds(joint.motor, joint.encoder, driver) if joint.motor else [] for joint in joints]
    if not coupling:
        return motors
    found: list[list[Bound]] = [[] for _ in joints]
    for row, joint, of_motor in zip(coupling, joints, motors, strict=True):
        turned = [number for number, factor in enumerate(row) if factor]
        names = " and ".join(joints[number].name for number in turned)
        for bound in of_motor:
            most = sum(abs(row[number]) * getattr(joints[number].limits, bound.key) for number in turned)
            for number in turned:
                value = getattr(joints[number].limits, bound.key) * bound.value / most
                reason = (
                    bound.reason
                    if len(turned) == 1
                    else f"the motor of {joint.name} moves {names}, and {bound.reason}"
                )
                found[number].append(Bound(bound.key, value, reason))
    return found
