"""An arm's outputs and inputs as the arm record has them: pins and timers by number, pulse widths in counts."""

from __future__ import annotations

from typing import Any

from armtempo.model import pin_use
from armtempo.model.arm import Arm
from armtempo.model.boards import TimerOutput, pin_number
from armtempo.model.outputs import SERVO, Output
from armtempo.model.pin_use import Period


def outputs(arm: Arm) -> list[dict[str, Any]]:
    """Rows of ``armrecord.OUTPUT``, of an arm without problems (``pin_use``)."""
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
