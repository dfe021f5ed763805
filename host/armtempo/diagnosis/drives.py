"""Motors, gears and encoders: step rates against the board and the drivers, steps against the ranges."""

from __future__ import annotations

from armtempo_shared.limits import MAX_STEP_RATE, MAX_STEP_RATE_SUM

from armtempo.basics.errors import ArmtempoError
from armtempo.diagnosis.finding import Finding, error, note, warning
from armtempo.encoding import encode
from armtempo.model import drive_limits
from armtempo.model.arm import Arm
from armtempo.model.parts import DrivenJoint
from armtempo.planning.board_limits import ESTIMATED, format_rate

_MICROSTEPS = {*(1 << n for n in range(9)), 5, 10, 20, 25, 40, 50, 100, 125, 200, 250}
"""Microstep settings of stepper drivers: powers of 2, and decimal ones."""
_FAST_RPM = 1500.0
"""Few steppers have torque above this speed."""
_FEWEST_STEPS = 10
_SLOW_STEPS_S = 10.0
_SUDDEN_S = 0.01
"""An acceleration limit that allows full speed in less time is probably wrong."""


def top_rate_steps_s(joint: DrivenJoint) -> float:
    """Step rate of a motor (``Arm.motors``) at its speed limit."""
    return joint.limits.speed_deg_s * joint.steps_per_deg


def motor_rpm(joint: DrivenJoint) -> float:
    """Speed of a motor's shaft at its speed limit."""
    return joint.limits.speed_deg_s * joint.motor.reduction / 6.0


def findings(arm: Arm) -> list[Finding]:
    """Findings about the drives of all driven joints, and about their sum."""
    found = [finding for joint in arm.motors for finding in _of(joint)]
    found += _exceeded(arm) + _backlash(arm)
    rates = sum(top_rate_steps_s(joint) for joint in arm.motors)
    if rates > MAX_STEP_RATE_SUM:
        found.append(
            warning(
                "all joints",
                format_rate(rates),
                "use fewer microsteps or lower speed limits; else a plan that needs more is refused",
            )
        )
    return found


def record_findings(arm: Arm) -> list[Finding]:
    """Findings about values that the board would refuse."""
    try:
        encode.arm_record(arm)
    except (ArmtempoError, OverflowError) as refused:
        return [error("the board", f"cannot be given this arm: {refused}", "correct that figure")]
    return []


def _of(joint: DrivenJoint) -> list[Finding]:
    return [*_motor(joint), *_rates(joint), *_range(joint)]


def _exceeded(arm: Arm) -> list[Finding]:
    """Limits beyond what the driver, the motor's curve or the encoder allows."""
    return [
        warning(
            joint.name,
            f"{key} = {getattr(joint.limits, bound.key):g}, but {bound.reason}: motions keep to {bound.value:.4g}",
            f"lower {key} to that, or change what sets it",
        )
        for joint, bound in drive_limits.exceeded(arm.table_joints, arm.coupling, arm.driver)
        for key in (joint.unit.key(bound.key),)
    ]


def _backlash(arm: Arm) -> list[Finding]:
    """What the crossing of backlash leaves for motions."""
    return [
        note(
            joint.name,
            f"{joint.unit.key('backlash_deg')} = {crossing.play_deg:g} takes {crossing.duration_s:.2g} s to cross, "
            f"with {crossing.acceleration_deg_s2:.3g} {joint.unit.name}/s2 and up to {crossing.speed_deg_s:.3g} "
            f"{joint.unit.name}/s of its motor; motions keep to the rest",
            "nothing to do; set it to what 'armtempo selftest --with-motors' measures",
        )
        for joint, crossing in zip(arm.driven, arm.crossings, strict=True)
        if crossing
    ]


def _motor(joint: DrivenJoint) -> list[Finding]:
    found = []
    if joint.motor.steps_per_rev % 4:
        found.append(
            warning(
                joint.name,
                f"steps_per_rev = {joint.motor.steps_per_rev} is not a multiple of 4, as a stepper's full steps are",
                "give the motor's full steps a turn: 200 for 1.8 deg, 400 for 0.9 deg; microsteps have their own key",
            )
        )
    if joint.motor.microsteps not in _MICROSTEPS:
        found.append(
            warning(
                joint.name,
                f"microsteps = {joint.motor.microsteps} is not a setting of stepper drivers",
                "look up the driver's switches: mostly 1, 2, 4, 8, 16, 32 and on",
            )
        )
    return found


def _rates(joint: DrivenJoint) -> list[Finding]:
    rate, speed = top_rate_steps_s(joint), joint.limits.speed_deg_s
    at_limit = f"at its speed limit of {speed:g} {joint.unit.name}/s"
    speed_key, lead = joint.unit.key("speed_deg_s"), "mm_per_rev" if joint.slides else "gear_ratio"
    rpm = motor_rpm(joint)
    found = []
    if rate > MAX_STEP_RATE:
        text = f"{at_limit} it needs {rate:.0f} steps/s, the board makes at most {MAX_STEP_RATE} {ESTIMATED}"
        found.append(
            error(
                joint.name,
                text,
                f"lower {speed_key} or use fewer microsteps; check "
                f"{'mm_per_rev' if joint.slides else 'the gear ratio'}",
            )
        )
    if rate < _SLOW_STEPS_S:
        text = f"{at_limit} the motor makes only {rate:.2g} steps/s"
        found.append(warning(joint.name, text, f"check {speed_key}, microsteps and {lead} for a wrong unit"))
    if rpm > _FAST_RPM:
        text = f"{at_limit} the motor turns at {rpm:.0f} rpm; few steppers have torque left above {_FAST_RPM:.0f}"
        found.append(
            warning(
                joint.name,
                text,
                f"lower {speed_key}, or check {lead} ({'mm' if joint.slides else 'motor turns'} a "
                f"{'turn' if joint.slides else 'joint turn'})",
            )
        )
    if speed / joint.limits.acceleration_deg_s2 < _SUDDEN_S:
        text = f"its acceleration limit reaches full speed in {1e3 * speed / joint.limits.acceleration_deg_s2:.2g} ms"
        key = joint.unit.key("acceleration_deg_s2")
        found.append(warning(joint.name, text, f"lower {key} to what the motor can do"))
    return found


def _range(joint: DrivenJoint) -> list[Finding]:
    low, high = joint.range_deg
    steps = (high - low) * joint.steps_per_deg
    if steps >= _FEWEST_STEPS:
        return []
    text = f"its whole range, {low:g} to {high:g} {joint.unit.name}, is {steps:.2g} steps"
    lead = "mm_per_rev" if joint.slides else "gear_ratio"
    key = joint.unit.key("range_deg")
    return [error(joint.name, text, f"check {key}, steps_per_rev, microsteps and {lead}")]


def encoder_findings(arm: Arm) -> list[Finding]:
    """Findings about the encoders: resolution, rate, following error."""
    found = [finding for joint in arm.driven if joint.encoder for finding in _encoder(joint)]
    for joint, seen in zip(arm.driven, arm.transmission.measured, strict=True):
        if joint.encoder and not seen:
            text = "the encoder of its motor alone does not give its angle, as other motors turn it too"
            found.append(note(joint.name, text, "fit encoders to all motors that turn it"))
    without = [joint.name for joint in arm.driven if joint.encoder is None]
    if without:
        text = f"no encoder: {', '.join(without)}; lost steps there are not seen"
        found.append(
            note("encoders", text, "nothing to do; with an encoder the board would stop on a lost step")
        )
    return found


def _encoder(joint: DrivenJoint) -> list[Finding]:
    assert joint.encoder is not None
    limit_deg, count_deg = joint.encoder.following_error_deg, 1.0 / joint.counts_per_deg
    found = []
    key, unit = joint.unit.key("following_error_deg"), joint.unit.name
    if limit_deg == 0.0:
        text = f"its encoder is recorded only: with {key} = 0 lost steps stop nothing"
        found.append(note(joint.name, text, f"give {key}, such as 2.0, to stop when steps are lost"))
    elif limit_deg < count_deg:
        text = f"{key} = {limit_deg:g} is less than one count of its encoder, {count_deg:.3g} {unit}"
        found.append(error(joint.name, text, f"raise {key}, or check counts_per_rev and 'on'"))
    elif limit_deg < _ordinary_deg(joint, count_deg):
        text = (
            f"{key} = {limit_deg:g} is less than what a healthy joint may show: a full step of lag, "
            f"two counts and the backlash, {_ordinary_deg(joint, count_deg):.3g} {unit}"
        )
        found.append(warning(joint.name, text, "raise it above that, else it trips in ordinary motion"))
    return found


def _ordinary_deg(joint: DrivenJoint, count_deg: float) -> float:
    """Largest following error of a joint without a lost step, degrees."""
    full_step_deg = joint.motor.per_rev / joint.motor.steps_per_rev / joint.motor.gear_ratio
    return full_step_deg + 2 * count_deg + joint.model.backlash_deg
