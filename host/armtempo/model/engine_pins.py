"""Pins and timers that the engine uses for an arm, from the board program's table ``hardware/pins.py``."""

from __future__ import annotations

import ast
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

from armtempo.model.parts import Joint, Safety

_SINGLE = {"ENABLE of the drivers": "ENABLE", "the button": "BUTTON", "the E-stop": "ESTOP"}
ENGINE_TIMERS = {2: "the step pulses", 5: "the step pulses", 6: "the step pulses"}


class ChannelUser(Protocol):
    """The part of an arm that is needed here."""

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Joints; those with a motor have channels."""

    @property
    def safety(self) -> Safety:
        """Safety: whether there is an E-stop."""


@cache
def table() -> dict[str, Any]:
    """The constants of the board program's table by name, read without executing it."""
    spec = find_spec("armtempo_board")
    if spec is None or not spec.submodule_search_locations:
        raise FileNotFoundError("the package armtempo_board is not installed")
    source = Path(spec.submodule_search_locations[0], "hardware", "pins.py").read_text(encoding="utf-8")
    found = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            try:
                found[node.targets[0].id] = ast.literal_eval(node.value)
            except ValueError:
                continue
    return found


def taken_pins(arm: ChannelUser) -> dict[str, str]:
    """Pins (``"PE12"``) that the program uses for this arm, and their use."""
    pins = table()
    found = {pins["ENABLE"]: "ENABLE of the drivers", pins["BUTTON"]: "the button"}
    found.update(dict.fromkeys(pins["LEDS"], "a LED of the board"))
    if arm.safety.estop_fitted:
        found[pins["ESTOP"]] = "the E-stop"
    for joint in arm.joints:
        if joint.motor is None:
            continue
        channel = joint.motor.channel
        found[pins["STEP"][channel - 1][0]] = f"STEP of channel {channel}"
        found[pins["DIR"][channel - 1]] = f"DIR of channel {channel}"
        if joint.encoder is not None:
            for pin in pins["ENCODER"][joint.encoder.channel - 1][1:3]:
                found[pin] = f"encoder {joint.encoder.channel}"
        for switch in (joint.switches.low, joint.switches.high):
            if isinstance(switch, int):
                found[pins["LIMIT"][switch - 1]] = f"limit switch {switch}"
    return {f"P{pin}": use for pin, use in found.items()}


def uses(pin: str) -> list[str]:
    """All uses of a pin (``"PE12"``) in the program, for any arm."""
    pins, name = table(), pin.removeprefix("P")
    found = [words for words, key in _SINGLE.items() if pins[key] == name]
    found += ["a LED of the board"] * (name in pins["LEDS"])
    for number, step in enumerate(pins["STEP"], 1):
        found += [f"STEP of channel {number}"] * (name == step[0])
    found += [f"DIR of channel {number}" for number, other in enumerate(pins["DIR"], 1) if other == name]
    found += [f"encoder {number}" for number, row in enumerate(pins["ENCODER"], 1) if name in row[1:3]]
    return found + [
        f"limit switch {number}" for number, other in enumerate(pins["LIMIT"], 1) if other == name
    ]


def taken_timers(arm: ChannelUser) -> dict[int, str]:
    """Timers that the program uses for this arm, and their use."""
    found = dict(ENGINE_TIMERS)
    for joint in arm.joints:
        if joint.motor is not None and joint.encoder is not None:
            found[table()["ENCODER"][joint.encoder.channel - 1][0]] = f"encoder {joint.encoder.channel}"
    return found
