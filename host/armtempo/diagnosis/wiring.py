"""Checks of channels and inputs of the board (pins: board/docs/hardware.md)."""

from __future__ import annotations

from collections import defaultdict

from armtempo.diagnosis.finding import Finding, error, note, warning
from armtempo.model import home_switches, pin_use
from armtempo.model.arm import Arm
from armtempo.model.parts import DrivenJoint, Joint
from armtempo.model.pin_use import problems as pin_problems

BUTTON_CHANNEL = 6
"""Its STEP pin is the pin of the button."""


def findings(arm: Arm) -> list[Finding]:
    """Findings about channels and pins used twice, and about contradicting switches."""
    found = _channels(arm)
    found += _levels(arm)
    found += [error(problem.where, problem.what, problem.next_step) for problem in pin_problems(arm)]
    found += [error(each.joint, each.what, each.next_step) for each in home_switches.problems(arm)]
    found += [finding for joint in arm.driven for finding in _switches(joint)]
    found += [_unused(joint) for joint in arm.joints if joint.motor is None and _has_switch(joint)]
    homed = [name for group in home_switches.order(arm) for name in group]
    found += [_not_homed(name) for group in arm.homing for name in group if name not in homed]
    if any(joint.motor and joint.motor.channel == BUTTON_CHANNEL for joint in arm.joints):
        text = "channel 6 takes the pin of the board's button, which starts nothing then"
        found.append(note("wiring", text, "use channels 1 to 5 if the button is to start motions"))
    if not arm.safety.estop_fitted:
        found.append(note("safety", "no E-stop is fitted", "wire one and set estop_fitted = true"))
    return found


def _channels(arm: Arm) -> list[Finding]:
    return [
        error(" and ".join(joints), f"share {key}.channel = {channel}", "give each its own channel")
        for key, channel, joints in pin_use.shared(arm.joints)
    ]


def _levels(arm: Arm) -> list[Finding]:
    """Findings about inputs with two trip levels."""
    levels: dict[int, set[str]] = defaultdict(set)
    for joint in arm.joints:
        for number in (joint.switches.low, joint.switches.high):
            if isinstance(number, int):
                levels[number].add(joint.switches.active)
    return [
        error(
            "switches",
            f"input {number} is set to trip both at low and at high level",
            "give its joints the same 'active'",
        )
        for number, active in levels.items()
        if len(active) > 1
    ]


def _switches(joint: DrivenJoint) -> list[Finding]:
    switches, (low, high) = joint.switches, joint.range_deg
    found = []
    for side, number, trip_deg in (
        ("low", switches.low, switches.low_deg),
        ("high", switches.high, switches.high_deg),
    ):
        if number is None and trip_deg is not None:
            text = f"{side}_{joint.unit.name} is given, but no input for that switch"
            found.append(
                warning(
                    joint.name,
                    text,
                    f"give {side} = 1, 2, 3 or a pin in its [switches], or leave {side}_{joint.unit.name} out",
                )
            )
        if number is not None and trip_deg is None:
            protects = "protects, but " if isinstance(number, int) else ""
            text = f"its {side} switch {protects}cannot home: its {joint.unit.what} is not known"
            found.append(note(joint.name, text, f"measure where it trips and give {side}_{joint.unit.name}"))
    for side, at_deg in joint.switches_within:
        text = f"its {side} switch trips at {at_deg:g} {joint.unit.name}, within its range of {low:g} to {high:g}"
        key = joint.unit.key("range_deg")
        found.append(
            warning(
                joint.name,
                text,
                f"narrow {key} to what the switch leaves, or correct the {joint.unit.what}",
            )
        )
    return found


def _has_switch(joint: Joint) -> bool:
    return joint.switches.low is not None or joint.switches.high is not None


def _unused(joint: Joint) -> Finding:
    text = "has switches but no motor: they are not checked"
    return warning(joint.name, text, "give it a motor, or leave its [switches] out")


def _not_homed(joint: str) -> Finding:
    text = (
        "is in 'homing', but has no motor, or no switch whose position is known: it is not homed by switches"
    )
    return warning(joint, text, "give it one, or take it out of homing")
