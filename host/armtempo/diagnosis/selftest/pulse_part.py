"""Pulses and E-stop: captured edges compared with the motion's step times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from armtempo_shared import codes
from armtempo_shared.meanings import ERRORS

from armtempo.basics.arrays import Array
from armtempo.diagnosis.finding import Level
from armtempo.diagnosis.selftest.motion import TestMotion
from armtempo.diagnosis.selftest.prompt import Measured
from armtempo.diagnosis.selftest.result import Measurement, judged, left_out

PULSES, SAFETY, TURNS = "pulses", "safety", "cycles"
_RESOLUTION_US = 2.0
"""One sample per microsecond, half a sample between the two ports, and the rounding of a step time."""
_LONGEST_PASS_US = 4000
"""The capture keeps 4096 samples; after a longer pass some are lost."""
_SLOWEST_STOP_US = 30.0
STOPS = tuple(f"{pin} by {how}" for pin in ("E-stop", "limit switch") for how in ("software", "an edge"))
"""The stops of ``board: selftest/estop.py``."""
CYCLES_PER_US = 168
_SHORTED = "look for a short between the two pins, and take what is connected off one after the other"


def rises_us(measured: Measured) -> dict[str, Array]:
    """Times of the rising edges in microseconds, by the pin's name."""
    found: dict[str, Array] = {}
    words = np.frombuffer(measured.bulk, "<i4")
    begin = 0
    for port, count in zip(measured.values["ports"], measured.values["counts"], strict=True):
        edges = words[begin : begin + count]
        begin += len(edges)
        for line in range(16):
            mine = edges[(edges >> 1 & 15) == line]
            found[f"{port}{line}"] = (mine[mine & 1 == 1] >> 8).astype(float)
    return found


def errors_us(measured: Measured, motion: TestMotion) -> dict[str, Any]:
    """By pin the times of its steps, ms, and the delays of the captured ones, us; only pins with all steps."""
    found = rises_us(measured)
    wanted = {pin: 1e6 * steps for pin, steps in zip(measured.values["steps"], motion.steps_s, strict=True)}
    offset = _offset_us(found, wanted)
    return {
        pin: [(steps / 1000).round(3).tolist(), (found[pin] - offset - steps).round(2).tolist()]
        for pin, steps in wanted.items()
        if len(found[pin]) == len(steps)
    }


def judge(
    measured: Measured, motion: TestMotion, joints: Sequence[dict[str, Any]], forward: bool
) -> Iterator[Measurement]:
    """Lines about ``measured`` of ``board: selftest/pulses.py``, which ran ``motion``."""
    values = measured.values
    how = "forward together" if forward else "back alone"
    if values["fault"]:
        name, meaning, cure = ERRORS[values["fault"]]
        yield judged(PULSES, f"motion {how}", f"fault {name}: {meaning}", "no fault", False, cure)
    longest_us = values["longest_pass_cycles"] / CYCLES_PER_US
    if longest_us > _LONGEST_PASS_US:
        measured_words = f"a pass of the loop took {longest_us:.0f} us"
        yield judged(
            PULSES, f"capture {how}", measured_words, f"below {_LONGEST_PASS_US}", False, "run it again"
        )
        return
    found = rises_us(measured)
    wanted = {pin: 1e6 * steps for pin, steps in zip(values["steps"], motion.steps_s, strict=True)}
    offset = _offset_us(found, wanted)
    for number, (pin, steps) in enumerate(wanted.items()):
        yield _channel(joints[number]["channel"] + 1, pin, (found[pin] - offset, steps), found, wanted, how)
    levels = [int(forward) ^ joint["dir_inverted"] for joint in joints]
    yield judged(
        PULSES,
        f"DIR of the joints, {how}",
        str(values["directions"])[1:-1],
        str(levels)[1:-1],
        values["directions"] == levels,
        "look for a short at the DIR pins, see 'armtempo help hardware'",
    )


def _offset_us(found: dict[str, Array], wanted: dict[str, Array]) -> float:
    """Time from the start of the capture to the motion's time 0, by the median of the joints."""
    apart = [
        float(np.median(found[pin] - steps))
        for pin, steps in wanted.items()
        if len(found[pin]) == len(steps) > 0
    ]
    return float(np.median(apart)) if apart else 0.0


def _channel(
    channel: int,
    pin: str,
    times: tuple[Array, Array],
    found: dict[str, Array],
    wanted: dict[str, Array],
    how: str,
) -> Measurement:
    """The line about a joint's STEP pin."""
    rises, steps = times
    what = f"channel {channel}, STEP on P{pin}, {how}"
    expected = f"{len(steps)} steps, within {_RESOLUTION_US:g} us"
    if len(rises) == len(steps):
        worst = float(np.max(np.abs(rises - steps), initial=0.0))
        cure = "TIM2 or TIM5 is disturbed: use no timer, SPI, I2C or DAC next to the program"
        measured = f"{len(rises)} steps, the worst {worst:.1f} us off"
        return judged(PULSES, what, measured, expected, worst <= _RESOLUTION_US, cure)
    cure = f"take what is connected off P{pin}, look for a short; if it stays so, the pin or its DMA stream is broken"
    other = [
        name
        for name, its in wanted.items()
        if name != pin
        and len(rises) > 0
        and len(found[pin]) > len(steps)
        and len(its)
        and len(found[name])
        and np.isin(found[name], found[pin]).mean() > 0.9
    ]
    words = f"{len(rises)} steps"
    if other:
        words, cure = f"{words}, those of P{other[0]} among them", _SHORTED
    return judged(PULSES, what, words, expected, False, cure)


def judge_long(values: dict[str, Any], steps: int, duration_s: float) -> Measurement:
    """The line about a motion of ``steps`` of each joint: counted edges by port."""
    what = f"steps of a longer motion, {duration_s:g} s"
    if values["longest_pass_cycles"] / CYCLES_PER_US > _LONGEST_PASS_US:
        return left_out(PULSES, f"{what}: a pass of the loop took too long to capture all", "run it again")
    counted = {port: count / 2 for port, count in zip(values["ports"], values["counts"], strict=True)}
    due = {port: steps * sum(pin[0] == port for pin in values["steps"]) for port in values["ports"]}
    return judged(
        PULSES,
        what,
        ", ".join(f"{count:g} on port {port}" for port, count in counted.items()),
        ", ".join(f"{count} on port {port}" for port, count in due.items()),
        counted == due and not values["fault"],
        "look at the lines about the single channels",
    )


def judge_turns(values: dict[str, Any]) -> Iterator[Measurement]:
    """Lines on the loop while all joints move, and on the heap."""
    mean, longest = (values[name] / CYCLES_PER_US for name in ("pass_cycles", "longest_pass_cycles"))
    yield Measurement(
        TURNS,
        "a pass of the engine's loop with its capture, all joints moving",
        f"{mean:.0f} us, the longest {longest:.0f}",
    )
    stages = ", ".join(f"{name} {values['free'][name]}" for name in ("engine", "loaded", "moved"))
    yield Measurement("memory", "free heap next to engine and capture", f"{stages} bytes")


def judge_stops(values: dict[str, Any]) -> Iterator[Measurement]:
    """Lines about ``values`` of ``board: selftest/estop.py``."""
    for how in STOPS:
        if took := values["cycles"].get(how):
            yield _stops(how, took)
        else:
            yield Measurement(
                SAFETY, how, "left out: what is wired to its pin holds it", "", Level.NOTE,
                "press it in 'armtempo selftest --with-motors'",
            )  # fmt: skip
    wrong, count = values["wrong_faults"], sum(map(len, values["cycles"].values()))
    end = values["starved"]
    name, _, _ = ERRORS.get(end["fault"], ("none", "", ""))
    yield judged(
        SAFETY,
        "the interrupt that fills the rings held off",
        f"fault {name}, outputs {'low' if end['low'] else 'high'}, position {'known' if end['known'] else 'unknown'}",
        "internal or underrun, low, known",
        end["fault"] in (codes.INTERNAL, codes.UNDERRUN) and end["low"] and end["known"],
        "do not connect drivers; please report it with the output",
    )
    yield judged(
        SAFETY,
        "fault after each stop",
        f"{count - wrong} of {count} as is due",
        "estop or limit_switch each time",
        not wrong,
        "do not connect drivers; please report it with the output",
    )


def _stops(how: str, cycles: Sequence[int]) -> Measurement:
    took_us = np.array(cycles) / CYCLES_PER_US
    gone_on = int(np.sum(took_us < 0))
    return judged(
        SAFETY,
        f"{how} to frozen outputs, {len(took_us)} times",
        f"worst {took_us.max():.1f} us" + (f", {gone_on} times they went on" if gone_on else ""),
        f"below {_SLOWEST_STOP_US:g} us each time",
        not gone_on and float(took_us.max()) < _SLOWEST_STOP_US,
        "do not connect drivers: interrupts come late, or do not stop the pulses; please report it with the output",
    )
