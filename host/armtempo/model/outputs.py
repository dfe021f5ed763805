"""Outputs and inputs of an arm: their description in the file, and their values on the board."""

from __future__ import annotations

import math
from dataclasses import dataclass

from armtempo_shared.limits import FULL_OUTPUT

from armtempo.basics.arguments import checked, checked_fields
from armtempo.basics.errors import InputError
from armtempo.basics.text import did_you_mean

SWITCH, PWM, SERVO = "switch", "pwm", "servo"
KINDS = (SWITCH, PWM, SERVO)
_RANGES = {SWITCH: (0.0, 1.0), PWM: (0.0, 1.0)}
_UNITS = {SWITCH: "", PWM: "duty", SERVO: "deg"}


@checked
@checked_fields
@dataclass(frozen=True)
class Output:
    """A pin that is on or off, a pulse width (duty 0 to 1), or a hobby servo (degrees)."""

    name: str
    kind: str
    """``"switch"``, ``"pwm"`` or ``"servo"``."""
    pin: str
    """``"PE9"``."""
    safe: float
    """Value at power-up, at a fault or an E-stop, and when the board's program ends."""
    states: tuple[tuple[str, float], ...] = ()
    """Values by name."""
    active: str = "high"
    """For a switch: level of the pin when it is on."""
    frequency_hz: float = 0.0
    """Frequency of the pulses; 0 for a switch."""
    pulse_us: tuple[float, float] = (0.0, 0.0)
    """For a servo: pulse widths at the ends of ``angles_deg``."""
    angles_deg: tuple[float, float] = (0.0, 0.0)

    @property
    def range(self) -> tuple[float, float]:
        """Its least and largest value: 0 and 1, or a servo's angles in degrees."""
        return _RANGES.get(self.kind, self.angles_deg)

    @property
    def unit(self) -> str:
        """``""``, ``"duty"`` or ``"deg"``."""
        return _UNITS[self.kind]

    def number(self, value: float | str) -> float:
        """The number of a value or of a state's name, in the output's unit.

        Raises InputError for an unknown state, or a value outside the output's range.
        """
        if isinstance(value, str):
            value = self._state(value)
        low, high = self.range
        if not (math.isfinite(value) and low <= value <= high):
            raise InputError(
                f"output {self.name!r} cannot take {value:g}{self._in_unit()}: its range is {low:g} to {high:g}",
                f"give a value within it{self._or_state()}",
            )
        if self.kind == SWITCH and value not in (0.0, 1.0):
            raise InputError(
                f"output {self.name!r} is on or off, it cannot take {value:g}",
                f"give 0 or 1{self._or_state()}",
            )
        return float(value)

    def raw(self, value: float | str) -> int:
        """The board's value: 0 to 65535 for the whole range. Raises InputError as ``number``."""
        low, high = self.range
        return round((self.number(value) - low) / (high - low) * FULL_OUTPUT)

    def value(self, raw: int) -> float:
        """The value of ``raw`` in the output's unit."""
        low, high = self.range
        return low + (high - low) * raw / FULL_OUTPUT

    def state(self, raw: int) -> str:
        """The name of the state with the value ``raw``; "" if there is none."""
        return next((name for name, value in self.states if self.raw(value) == raw), "")

    def describe(self, raw: int) -> str:
        """Describe the value ``raw``: ``open (20 deg)``."""
        number = f"{self.value(raw):.4g} {self.unit}".rstrip()
        if self.kind == SWITCH:
            number = "on" if raw else "off"
        state = self.state(raw)
        return f"{state} ({number})" if state else number

    def _state(self, name: str) -> float:
        states = dict(self.states)
        if name in states:
            return states[name]
        if self.kind == SWITCH and name in ("on", "off"):
            return float(name == "on")
        try:
            return float(name)
        except ValueError:
            raise InputError(
                f"output {self.name!r} has no state {name!r}{did_you_mean(name, list(states))}",
                f"give {'one of ' + ', '.join(states) + ', or ' if states else ''}a number",
            ) from None

    def _in_unit(self) -> str:
        return f" {self.unit}" if self.unit else ""

    def _or_state(self) -> str:
        return f", or a state: {', '.join(name for name, _ in self.states)}" if self.states else ""


@checked_fields
@dataclass(frozen=True)
class Input:
    """A pin that is active or not."""

    name: str
    pin: str
    active: str = "low"
    """Level at which it is active: ``"low"`` (with a pull-up) or ``"high"`` (with a pull-down)."""
    debounce_ms: int = 10
    """Time for which a level must be stable."""
