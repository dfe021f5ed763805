"""From degrees and seconds to the board's steps, counts and ticks: arm record and motion record; and back."""

from __future__ import annotations

import json
import math
from binascii import crc32
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from armtempo_shared import armrecord, limits, motion
from armtempo_shared import way_back as motion_way_back
from armtempo_shared.motion import Motion, MotionError
from armtempo_shared.wire import record_crc
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model import pin_use
from armtempo.model.arm import Arm
from armtempo.model.boards import TimerOutput, pin_number
from armtempo.model.drive_limits import Crossing
from armtempo.model.joint_unit import REVOLUTE
from armtempo.model.outputs import SERVO, Output
from armtempo.model.parts import PROGRAM, DrivenJoint
from armtempo.model.pin_use import Period
from armtempo.model.transmission import Transmission
from armtempo.planning import board_limits
from armtempo.planning.brake_time import BrakeTimes
from armtempo.splines.trajectory import JointSpline, Trajectory

_NOT_IDENTITY = ("name", "range_deg", "home_deg", "limits", "model", "radius_mm")
"""Fields of a joint that do not affect its position in steps."""
_TICKS_PER_US = limits.TICK_HZ / 1e6
_packed: tuple[Arm, bytes] | None = None
"""The last arm, which never changes, with its record: each motion names that, and a press of a jog waits for it."""


def arm_record(arm: Arm) -> bytes:
    """The arm record (layout: ``armtempo_shared.armrecord``); raises InputError if a value does not fit the board."""
    global _packed
    packed = _packed
    if packed is None or packed[0] is not arm:
        record = armrecord.pack(_head(arm), motor_rows(arm), outputs(arm), inputs(arm), backlash(arm))
        packed = _packed = arm, record
    return packed[1]


def motor_rows(arm: Arm) -> list[dict[str, Any]]:
    """Rows of ``armrecord.JOINT``; raises as ``arm_record``."""
    return [_motor(arm, number, rate) for number, rate in enumerate(step_rates(arm))]


def step_rates(arm: Arm) -> list[int]:
    """The highest step rates of the motors in the arm record, steps/s; raises as ``arm_record``."""
    return [with_margin(rate) for rate in board_limits.highest_rates(arm)]


def move_limits(arm: Arm, fraction: float = 1.0) -> list[list[int]]:
    """Speed, acceleration and jerk of each driven joint in steps, times ``fraction``, rounded down
    (``armtempo_shared.rest_to_rest``)."""
    return [
        [max(1, int(fraction * limit * joint.steps_per_deg)) for limit in joint.limits.values]
        for joint in arm.driven
    ]


def motion_record(trajectory: Trajectory, arm: Arm, brakes: BrakeTimes | None = None) -> bytes:
    """The motion record (layout: ``armtempo_shared.motion``), with the checksum of the arm's record.

    ``brakes``: its times for braking and changes of speed; None: neither is possible. Raises InputError if
    trajectory and arm do not fit together or exceed the record's ranges, PlanError if the numbers are too large for
    the board.
    """
    if len(trajectory.joints) != len(arm.driven):
        raise InputError(
            (
                f"trajectory {trajectory.name!r} has {len(trajectory.joints)} joints, arm {arm.name!r} drives "
                f"{len(arm.driven)}"
            ),
            "plan it for this arm",
        )
    angles = [
        _fixed(points, limits.STEP_FRACTION_BITS)
        for points in board_limits.motor_points_steps(trajectory, arm)
    ]
    axes = trajectory.joints[:1] if trajectory.shared else trajectory.joints
    times = [_fixed(spline.time_points_s * limits.TICK_HZ, limits.TICK_FRACTION_BITS) for spline in axes]
    board_limits.check_held(trajectory, arm)
    first = trajectory.joints[0]
    crc = record_crc(arm_record(arm))
    return motion.pack(first.degree, angles, times, first.refine, _ramps(brakes), crc)


def way_back(data: bytes, name: str, brakes: BrakeTimes) -> bytes:
    """The record (layout: ``armtempo_shared.backwards``) of the way back along the motion record ``data``.

    ``name``: of the stored motion; ``brakes``: those of the way back.
    """
    return motion_way_back.pack(data, name, _ramps(brakes))


def _ramps(brakes: BrakeTimes | None) -> motion.Ramps:
    """Ramp entries, to rest and others, as integers, the bits of their unit, and e (``armtempo_shared.motion``)."""
    if brakes is None:
        return motion.no_ramps()
    shapes = (motion.RAMP_LENGTH + 1) * np.append(brakes.shapes, motion.EVEN_RAMP)
    to_rest = [int(entry) for entry in brakes.to_rest + shapes]
    return to_rest, [int(entry) for entry in brakes.others], brakes.unit_bits, brakes.edge_bits


def _fixed(points: NDArray[np.float64], bits: int) -> list[int]:
    """Control points as integers with ``bits`` fraction bits."""
    scaled = np.rint(points * 2.0**bits)
    if not np.all(np.abs(scaled) < 2.0**62):
        raise InputError(
            "a control point is too large for the board",
            "check the limits and the via points",
        )
    return [int(value) for value in scaled]


def _head(arm: Arm) -> dict[str, Any]:
    safety, driver = arm.safety, arm.driver
    flags = 0
    for flag, wanted in (
        (armrecord.FLAG_ENABLE_HIGH, driver.enable_active == "high"),
        (armrecord.FLAG_ESTOP_RELEASES, safety.estop_releases_enable),
        (armrecord.FLAG_STOP_ON_LINK_LOSS, safety.on_link_loss == "stop"),
        (armrecord.FLAG_ESTOP_ACTIVE_HIGH, safety.estop_active == "high"),
        (armrecord.FLAG_ESTOP_FITTED, safety.estop_fitted),
        (armrecord.FLAG_POWER_UP, safety.at_power_up == PROGRAM),
    ):
        flags |= flag if wanted else 0
    ticks = {
        f"{name}_ticks": round(getattr(driver, f"{name}_us") * _TICKS_PER_US)
        for name in ("pulse", "low", "dir_setup", "dir_hold")
    }
    return {
        "flags": flags,
        "link_timeout_ms": safety.link_timeout_ms,
        "identity": _identity(arm),
        **ticks,
    }


def _identity(arm: Arm) -> int:
    """A hash of everything that maps joint angles to the arm's position: all except names, limits, backlash, models."""
    joints = [_as_floats(joint) for joint in arm.joints]
    for joint in joints:
        for name in _NOT_IDENTITY:
            joint.pop(name, None)
        if joint["encoder"]:
            del joint["encoder"]["following_error_deg"]
        if joint["motor"]:
            del joint["motor"]["backlash_deg"]
        if joint["type"] == REVOLUTE:  # as before there were sliding joints
            del joint["type"]
            (joint["motor"] or {}).pop("mm_per_rev", None)
    facts = [joints, _as_floats(arm.coupling)] if arm.coupling else joints
    text = json.dumps(facts, sort_keys=True)
    return crc32(text.encode())


def _as_floats(value: Any) -> Any:
    """The value as JSON has it, with all numbers as floats, as 20 and 20.0 are the same gear ratio."""
    if is_dataclass(value):
        return {entry.name: _as_floats(getattr(value, entry.name)) for entry in fields(value)}
    if isinstance(value, list | tuple):
        return [_as_floats(entry) for entry in value]
    return float(value) if isinstance(value, int | float) else value


def _motor(arm: Arm, number: int, max_rate: int) -> dict[str, Any]:
    joint = arm.motors[number]
    motor, encoder, switches = joint.motor, joint.encoder, joint.switches
    per_step = joint.counts_per_step
    if max(abs(per_step.numerator), per_step.denominator) >= 2**31:
        raise InputError(
            f"{joint.name}: the board cannot represent the ratio of encoder counts to steps",
            "check gear_ratio, microsteps and counts_per_rev in the arm file",
        )
    following = encoder.following_error_deg * joint.counts_per_deg if encoder else 0.0
    low, high = (round(angle * joint.steps_per_deg) for angle in joint.range_deg)
    if max(abs(low), abs(high)) >= 2**30:
        raise InputError(
            f"{joint.name}: its range is {high - low} steps, more than the board can count",
            f"make {joint.unit.key('range_deg')} narrower, or use fewer microsteps",
        )
    forward = (
        arm.transmission.matrix[number, number] > 0.0
    )  # else it turns backwards when its joint alone goes up
    return {
        "channel": motor.channel - 1,
        "dir_inverted": int(motor.direction < 0),
        "encoder": encoder.channel - 1 if encoder else armrecord.NONE,
        "encoder_inverted": int(encoder is not None and encoder.direction < 0),
        "counts_num": per_step.numerator,
        "counts_den": per_step.denominator,
        "min_steps": low,
        "max_steps": high,
        "max_rate": max_rate,
        "following_counts": round(following),
        "limit_low": _switch(switches.low if forward else switches.high),
        "limit_high": _switch(switches.high if forward else switches.low),
        "limit_active_high": int(switches.active == "high"),
        "spare": 0,
    }


def _switch(where: int | str | None) -> int:
    if where is None:
        return armrecord.NONE
    return where - 1 if isinstance(where, int) else armrecord.POLLED + pin_number(where)


def backlash(arm: Arm) -> list[dict[str, Any]]:
    """Rows of ``armrecord.BACKLASH`` of all motors; none if no motor has a step of it.

    Raises InputError if the board cannot cross one.
    """
    board_limits.check_crossings(arm)
    rows = [_backlash(motor, crossing) for motor, crossing in zip(arm.motors, arm.crossings, strict=True)]
    return rows if armrecord.backlash_count(rows) else []


def _backlash(motor: DrivenJoint, crossing: Crossing | None) -> dict[str, Any]:
    steps = round(crossing.play_deg * motor.steps_per_deg) if crossing else 0
    if not crossing or not steps:
        return {"steps": 0, "on_motor": 0, "spare": 0, "pace": 0}
    pace = math.sqrt(2.0 / (crossing.acceleration_deg_s2 * motor.steps_per_deg)) * limits.TICK_HZ / 64
    on_motor = motor.encoder is not None and motor.encoder.on == "motor"
    return {"steps": steps, "on_motor": int(on_motor), "spare": 0, "pace": math.ceil(pace)}


def with_margin(rate: float) -> int:
    """What the arm record has for a joint that steps at most at a rate, in steps/s: more, for rounding."""
    return int(rate * 1.01) + 1


def outputs(arm: Arm) -> list[dict[str, Any]]:
    """Rows of ``armrecord.OUTPUT``, of an arm whose pins were checked by ``pin_use``."""
    places = pin_use.timer_outputs(arm) if arm.outputs else {}
    return [_output(output, places.get(output.name)) for output in arm.outputs]


def inputs(arm: Arm) -> list[dict[str, Any]]:
    """Rows of ``armrecord.INPUT``."""
    return [
        {
            "pin": pin_number(entry.pin),
            "active_high": int(entry.active == "high"),
            "debounce_ms": entry.debounce_ms,
        }
        for entry in arm.inputs
    ]


def _output(output: Output, place: TimerOutput | None) -> dict[str, Any]:
    row = {"pin": pin_number(output.pin), "spare": 0, "safe": output.raw(output.safe)}
    if place is None:
        on = int(output.active == "high")
        return {**row, "timer": 0, "channel": 0, "prescaler": 0, "period": 0, "low": 1 - on, "high": on}
    period = Period.of(output, place)
    low, high = 0, period.counts
    if output.kind == SERVO:
        low, high = (period.counts_in(width, place) for width in output.pulse_us)
    return {
        **row,
        "timer": place.timer,
        "channel": place.channel,
        "prescaler": period.prescaler - 1,
        "period": period.counts - 1,
        "low": low,
        "high": high,
    }


# and back
def decoded(data: bytes, gears: Transmission, name: str, arm: str = "the arm") -> Trajectory:
    """The motion in a record, to the rounding of its integers; ``gears``: of the arm that it was made for.

    ``name`` and ``arm`` are used in messages. Raises InputError if the record is damaged or has another number of
    joints.
    """
    try:
        motion = Motion(data)
    except MotionError as error:
        raise InputError(f"motion {name!r}: not a motion record ({error})", "upload it again") from error
    joints = len(gears.steps_per_deg)
    if motion.joints != joints:
        raise InputError(
            f"motion {name!r} has {motion.joints} joints, {arm} drives {joints}",
            "connect the board that it was made for, or upload it again",
        )
    if gears.coupling and not motion.shared:
        raise InputError(
            f"motion {name!r}: its joints have a time axis each, but {arm} has coupled joints",
            "upload it again",
        )
    steps = [
        _points(data, motion.angle_offset(index), motion.segments + motion.degree) for index in range(joints)
    ]
    angles = gears.angles_of_steps(np.stack(steps, axis=-1) / 2.0**limits.STEP_FRACTION_BITS)
    splines = []
    for index in range(joints):
        times = _points(data, motion.time_offset(index), motion.segments * motion.refine + motion.degree)
        splines.append(
            JointSpline(
                motion.degree,
                motion.refine,
                angles[:, index].copy(),
                times / 2.0**limits.TICK_FRACTION_BITS / limits.TICK_HZ,
            )
        )
    return Trajectory(name, tuple(splines), motion.shared)


def _points(data: bytes, offset: int, count: int) -> Array:
    return np.frombuffer(data, "<i8", count, offset).astype(float)
