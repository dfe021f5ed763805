"""The tables [output.NAME] and [input.NAME] of an arm file."""

from __future__ import annotations

import re
from typing import Any

from armtempo_shared.limits import MAX_INPUTS, MAX_OUTPUTS

from armtempo.basics.errors import InputError
from armtempo.basics.text import is_number, on_one_line
from armtempo.basics.toml_table import Table
from armtempo.model.outputs import KINDS, PWM, SERVO, SWITCH, Input, Output

_NAME = re.compile(r"[A-Za-z0-9_-]{1,24}")
_PIN = re.compile(r"P[A-E](1[0-5]|[0-9])")
_PIN_WORDS = 'a pin of ports A to E, such as "PE9"'
_SERVO_HZ = 50.0
_FREQUENCY_HZ = (1.0, 100_000.0)
_SERVO_FREQUENCY_HZ = (40.0, 400.0)
_PULSE_US = (100.0, 5000.0)
_MAX_ANGLE_DEG = 3600.0


def outputs(top: Table) -> tuple[Output, ...]:
    """The outputs of a file; raises InputError, with file, key and value, for invalid ones."""
    return tuple(_output(name, table) for name, table in named(top, "output", MAX_OUTPUTS))


def inputs(top: Table) -> tuple[Input, ...]:
    """The inputs of a file; raises as ``outputs``."""
    return tuple(_input(name, table) for name, table in named(top, "input", MAX_INPUTS))


def named(top: Table, key: str, most: int | None = None) -> list[tuple[str, Table]]:
    """The tables [key.NAME] of a file, of which the board takes ``most``; raises as ``outputs``."""
    found = top.named_tables(key)
    if most is not None and len(found) > most:
        raise InputError(f"{top.file}: {len(found)} tables [{key}.NAME]", f"the board has space for {most}")
    for name, _ in found:
        check_name(f"{top.file}: {key}.{name}", name)
    return found


def check_name(where: str, name: str) -> None:
    """Raise InputError, which begins with ``where``, for a name that a table may not have."""
    if not _NAME.fullmatch(name):
        raise InputError(
            f"{on_one_line(where)}: the name is not allowed",
            "choose one of 1 to 24 letters, digits, '-' and '_'",
        )


def _output(name: str, table: Table) -> Output:
    kind = table.choice("kind", KINDS)
    settings: dict[str, Any] = {}
    if kind == SWITCH:
        settings["active"] = table.choice("active", ("low", "high"), "high")
    elif kind == PWM:
        settings["frequency_hz"] = table.number("frequency_hz", least=_FREQUENCY_HZ[0], most=_FREQUENCY_HZ[1])
    else:
        settings |= _servo(table)
    bare = Output(name, kind, pin(table), 0.0, **settings)
    states = _states(bare, table.table("states"))
    known = Output(name, kind, bare.pin, 0.0, states, **settings)
    safe = _safe(known, table)
    table.done()
    return Output(name, kind, bare.pin, safe, states, **settings)


def _servo(table: Table) -> dict[str, Any]:
    frequency_hz = table.number(
        "frequency_hz", _SERVO_HZ, least=_SERVO_FREQUENCY_HZ[0], most=_SERVO_FREQUENCY_HZ[1]
    )
    pulse_us = table.numbers("pulse_us", 2, (1000.0, 2000.0))
    most_us = min(_PULSE_US[1], 0.9e6 / frequency_hz)
    if not all(_PULSE_US[0] <= width <= most_us for width in pulse_us) or pulse_us[0] == pulse_us[1]:
        raise table.fail("pulse_us", f"two pulse widths from {_PULSE_US[0]:g} to {most_us:g} us that differ")
    angles_deg = table.numbers("angles_deg", 2)
    if not -_MAX_ANGLE_DEG <= angles_deg[0] < angles_deg[1] <= _MAX_ANGLE_DEG:
        raise table.fail("angles_deg", "two angles, the smaller first (exchange pulse_us for the other way)")
    return {"frequency_hz": frequency_hz, "pulse_us": pulse_us, "angles_deg": angles_deg}


def _states(output: Output, table: Table | None) -> tuple[tuple[str, float], ...]:
    if table is None:
        return ()
    found = []
    for name in table.rest():
        if not _NAME.fullmatch(name) or is_number(name):
            raise table.fail(name, "states with names of letters, digits, '-' and '_'")
        found.append((name, _checked(output, table, name, table.number(name))))
    return tuple(found)


def _safe(output: Output, table: Table) -> float:
    """The safe value; default 0, which must be within a servo's angles."""
    names = [name for name, _ in output.states]
    if not table.has("safe") and output.kind != SERVO:
        return 0.0
    if table.is_text("safe"):
        return output.number(table.choice("safe", names, allowed=f"a number or one of {', '.join(names)}"))
    return _checked(output, table, "safe", table.number("safe"))


def _checked(output: Output, table: Table, key: str, value: float) -> float:
    try:
        return output.number(value)
    except InputError:
        low, high = output.range
        raise table.fail(key, "0 or 1" if output.kind == SWITCH else f"{low:g} to {high:g}") from None


def _input(name: str, table: Table) -> Input:
    found = Input(
        name,
        pin(table),
        active=table.choice("active", ("low", "high"), Input.active),
        debounce_ms=table.integer("debounce_ms", Input.debounce_ms, least=0, most=10_000),
    )
    table.done()
    return found


def pin(table: Table, key: str = "pin", allowed: str = _PIN_WORDS) -> str:
    """The name of a pin, such as ``"PD0"``; whether the board has it is checked in ``pin_use``."""
    found = table.text(key)
    if not _PIN.fullmatch(found):
        raise table.fail(key, allowed)
    return found
