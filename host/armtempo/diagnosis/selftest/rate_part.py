"""The highest step rates of the board, and those that it states afterwards."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from armtempo_shared import wire
from armtempo_shared.limits import MAX_STEP_RATE, MAX_STEP_RATE_SUM

from armtempo.diagnosis.finding import Level
from armtempo.diagnosis.selftest.pulse_part import CYCLES_PER_US
from armtempo.diagnosis.selftest.result import Measurement, judged
from armtempo.link.board_messages import Hello

PART = "rates"
JOINTS = (1, 2, 3, 6)
DURATION_S = 0.4
SIMULATED_DURATION_S = 0.05
_LEAD_US, WATCHED_US = 20_000, 4096
"""Time from start to the motion's time 0 (``engine.LEAD_TICKS``); length of a capture."""
_RESOLUTION_US = 1.5
_SLOWER = 0.03
"""Tolerance of the time between steps: a capture ends with a pass of the loop."""
KEPT = 0.8
"""Fraction of the measured rate that the board states, at most the default rate."""
_ROUNDS = 5
_SHORTEST_S = 0.01
"""A shorter motion is not halved again."""


def frames() -> list[str]:
    """``hello``, then two commands as during a motion, in hex."""
    said = (("hello", (wire.PROTOCOL_VERSION, 1)), ("status", ()), ("samples", (0, 0)))
    return [
        wire.frame(sequence, wire.COMMAND[name][1], wire.encode(wire.COMMAND[name], values)).hex()
        for sequence, (name, values) in enumerate(said)
    ]


def stated(count: int) -> int:
    """Default rate of each of ``count`` joints."""
    return min(MAX_STEP_RATE, MAX_STEP_RATE_SUM // count)


def highest(keeps_up: Callable[[int], bool | None], count: int) -> int | None:
    """The highest rate by bisection, to about 3 %, up to the default with its margin; None if one was not tried."""
    good, bad = 0, round(stated(count) / KEPT)
    answer = keeps_up(bad)
    if answer:
        return bad
    for _ in range(_ROUNDS):
        if answer is None:
            return None
        middle = (good + bad) // 2
        answer = keeps_up(middle)
        good, bad = (middle, bad) if answer else (good, middle)
    return None if answer is None else good


def shortest_s(keeps_up: Callable[[float], bool | None], duration_s: float) -> tuple[float, bool]:
    """The shortest successful motion of repeatedly halved ``duration_s``; and whether it is the shortest tried."""
    while duration_s > _SHORTEST_S:
        if not keeps_up(duration_s / 2):
            return duration_s, False
        duration_s /= 2
    return duration_s, True


def to_state(found: Mapping[int, int | None]) -> tuple[int, int] | None:
    """Rates to state, steps/s, of one joint and of all, from the rates by number of joints; None if one is missing."""
    rates = {count: KEPT * rate for count, rate in found.items() if rate is not None}
    if len(rates) != len(found) or 1 not in rates:
        return None
    together = min(count * rate for count, rate in rates.items())
    return min(round(rates[1]), MAX_STEP_RATE), min(round(together), MAX_STEP_RATE_SUM)


def judge(rate: int | None, count: int) -> Iterator[Measurement]:
    """The line about the rate of ``count`` joints; a lower rate is not an error."""
    if rate is None:
        return
    expected = stated(count)
    is_enough = round(KEPT * rate) >= expected
    yield Measurement(
        PART,
        f"highest step rate without an underrun, {_joints(count)}",
        f"{rate} steps/s",
        f"{round(expected / KEPT)}: what is stated, {expected}, and a quarter",
        Level.GOOD if is_enough else Level.ERROR if rate < expected else Level.NOTE,
        "" if is_enough else "lower max_speed or microsteps until 'armtempo run' is not refused as too fast",
    )


def judge_ramp(found: tuple[float, bool], rate: int, count: int) -> Measurement:
    """The line about ``shortest_s``; a motion accelerates in its first half."""
    duration_s, is_least = found
    return Measurement(
        PART,
        f"shortest ramp from rest to {rate} steps/s, {_joints(count)}",
        f"{500 * duration_s:.3g} ms{', the shortest that was tried' if is_least else ''}",
    )


def watch_us(duration_s: float) -> int:
    """Start of a capture of the middle of a motion."""
    return int(_LEAD_US + 5e5 * duration_s + WATCHED_US / 2)


def judge_steps(values: Mapping[str, Any], port: str, rate: int, count: int) -> Measurement:
    """The line about the steps on a port's pins in the middle of a motion of ``count`` joints at ``rate``."""
    apart_us = 1e6 / rate
    said = [
        f"P{pin} {steps}, {least} to {most} us apart" for pin, (steps, least, most) in values["steps"].items()
    ]
    is_good = not values["fault"] and all(
        steps >= (1 - _SLOWER) * (WATCHED_US / apart_us - 1)
        and least >= apart_us - _RESOLUTION_US
        and most <= apart_us * (1 + _SLOWER) + _RESOLUTION_US
        for steps, least, most in values["steps"].values()
    )
    return judged(
        PART,
        f"steps on port {port} in 4 ms at the rate to state, {_joints(count)}",
        "; ".join(said) + (f"; fault {values['fault']}" if values["fault"] else ""),
        f"{WATCHED_US / apart_us:.0f}, {apart_us:.1f} us apart",
        is_good,
        "look at the lines about pulses; if nothing is wrong there, please report it with the output",
    )


def judge_load(longest_cycles: int) -> Measurement:
    """The line about the longest pass of the loop in all successful motions."""
    took = f"{longest_cycles / CYCLES_PER_US:.0f} us"
    return Measurement(PART, "worst pass of the program's loop under load, with commands and samples", took)


def _joints(count: int) -> str:
    return "1 joint" if count == 1 else f"{count} joints, each"


def judge_stated(found: Mapping[str, Any] | None, info: Hello) -> Iterator[Measurement]:
    """The line about the rates that the board states after its restart, compared with the measured ones."""
    if found is None or found["states"] is None:
        return
    one, together = found["states"]
    yield judged(
        PART,
        "what the board states from now on",
        f"{info.max_rate} steps/s one joint, {info.max_rate_sum} all together, "
        f"{'measured' if info.rates_measured else 'estimated'}",
        f"{one}, {together}, measured",
        (info.max_rate, info.max_rate_sum, info.rates_measured) == (one, together, True),
        "correct what is wrong above, then run the self-test again",
    )
