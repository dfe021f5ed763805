"""The order of a self-test. Drivers stay off: where ENABLE is not at its inactive level, nothing is done."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from armtempo.basics.errors import LinkError
from armtempo.basics.progress import Progress, stage, watched
from armtempo.link import Client
from armtempo.selftest import board_part, link_part, motion, pulse_part, rate_part
from armtempo.selftest.prompt import RESET, Measured, PartError, Prompt, SilentError, at_prompt
from armtempo.selftest.result import Measurement, SelfTest, judged, left_out

DRIVERS = "drivers"
_FEATURE = "sequences"
"""Of the program in the firmware, with the modules that the parts import; as files it is without both."""
UNIQUE_ID_DIGITS = 24
_ARM_RECORD = "/flash/armtempo/arm.ata"
_BACK_S = 60.0
_SIMULATED_TURN_US = 1000
"""What a turn of the loop takes on a virtual board, about as on the chip."""
_SEED, _STOPS, _WAITS_US = 5, 50, (22_000, 120_000)
_SIMULATED_STOPS = 5
"""E-stops at random moments of the motion, which begins 20 ms after its start."""
_LOOK_S = 0.3


def run(client: Client, progress: Progress | None = None) -> SelfTest:
    """Test the board behind ``client``, which runs the program again afterwards; its positions are unknown then.

    Raises LinkError, with nothing done, where something moves, a fault is pending, the drivers are on, or the program
    is not a part of the firmware; LinkError also where the board falls silent in a part, which it names.
    """
    info = client.info
    found = SelfTest(info.board_id[:UNIQUE_ID_DIGITS], info.virtual, info.program_crc)
    with watched(progress) as work:
        _check_rest(client)
        stage("link")
        work(0, 1)
        found.data[link_part.PART] = link_part.trips(client)
        _leave(client, lambda prompt: _at_prompt(prompt, found, work))
        found.add([_same_room(info.engine_room, client.info.engine_room)])
        work(1, 1)
    return found


def _same_room(before: int, after: int) -> Measurement:
    return judged(
        board_part.MEMORY,
        "memory for motions, before and after",
        f"{before}, {after} bytes",
        "the same",
        before == after,
        "reset the board; where it is so each time, please report it",
    )


def _check_rest(client: Client) -> None:
    client.need(_FEATURE, "the self-test")
    status = client.status()
    if status.moving:
        raise LinkError("the board is moving", "wait for the end of the motion, or 'armtempo stop'")
    if status.fault:
        raise LinkError(
            f"the board has fault {status.fault} pending", "remove its cause, then 'armtempo clear'"
        )


def _leave(client: Client, work: Callable[[Prompt], None]) -> None:
    """Do ``work`` at the prompt of the board; then its program answers again."""
    session = client.session
    with session.turns:
        client.leave()
        session.transport.close()
        try:
            with at_prompt(session.transport.name) as prompt:
                _check_drivers(prompt)
                work(prompt)
        finally:
            _back(client)


def _check_drivers(prompt: Prompt) -> None:
    """LinkError, and the program goes on as it was, unless ENABLE is inactive or the board has no arm.

    From here on the end of the prompt is a reset, which switches drivers off that are on.
    """
    prompt.enter(soft_reset=False)
    found = _drivers(prompt)
    on = found["active"] is not None and found["output"] and found["level"] == found["active"]
    if on:
        raise LinkError(
            "the drivers are on (ENABLE, PE12, is active)",
            "support the arm, then press the board's reset button, which switches them off, and run the self-test "
            "again; if they are still on, look for a short at PE12",
        )
    prompt.at_end = RESET


def _drivers(prompt: Prompt) -> dict[str, Any]:
    return prompt.measure("drivers", record=_ARM_RECORD).values


def _at_prompt(prompt: Prompt, found: SelfTest, work: Progress) -> None:
    """All parts, each whatever became of the others, until the board falls silent in one."""
    try:
        prompt.enter(soft_reset=True)
        drivers = found.data[DRIVERS] = _drivers(prompt)
        found.add(_driver_lines(drivers))
        work(0.1, 1)
        if measured := _part(prompt, found, board_part.BOARD, "identity"):
            found.add(board_part.judge(measured.values, found.board_id))
        work(0.2, 1)
        if measured := _part(prompt, found, board_part.CYCLES, "cycles"):
            found.add(board_part.judge_cycles(measured.values))
        work(0.3, 1)
        stage(link_part.PART)
        found.data[link_part.PART] |= prompt.rates()
        found.add(link_part.judge(found.data[link_part.PART], found.simulated))
        if is_off(drivers):
            _move(prompt, found, work)
            if not found.data.get(pulse_part.PULSES, {}).get(
                "fault"
            ):  # else no motion would tell of its rate
                _rates(prompt, found, work)
    except SilentError as error:
        found.add([_failed(error.part, error)])


def _part(prompt: Prompt, found: SelfTest, part: str, *files: str, **arguments: Any) -> Measured | None:
    """What a part gave; None, with a line about it, where its code raised."""
    stage(part)
    try:
        measured = prompt.measure(*files, **arguments)
    except PartError as error:
        found.add([_failed(part, error)])
        return None
    found.data.setdefault(part, measured.values)
    return measured


def _failed(part: str, error: LinkError) -> Measurement:
    return judged(part, "the whole part", error.problem, "an answer", False, error.hint)


def _move(prompt: Prompt, found: SelfTest, work: Progress) -> None:
    """The parts that make steps, with the drivers off."""
    joints = found.data[DRIVERS]["joints"]
    for done, forward in ((0.4, True), (0.5, False)):
        work(done, 1)
        moved = motion.make(joints, forward)
        arguments = _arguments(moved, found)
        if measured := _part(prompt, found, pulse_part.PULSES, "engine", "pulses", **arguments):
            found.add(pulse_part.judge(measured, moved, joints, forward))
            found.add([_still_off(measured, found)])
            if forward:
                found.data[pulse_part.PULSES]["error_us"] = pulse_part.errors_us(measured, moved)
                found.add(pulse_part.judge_turns(measured.values))
    work(0.6, 1)
    count = _SIMULATED_STOPS if found.simulated else _STOPS
    waits_us = np.random.default_rng(_SEED).integers(*_WAITS_US, count).tolist()
    if measured := _part(prompt, found, pulse_part.SAFETY, "engine", "estop", waits_us=waits_us, **arguments):
        found.add(pulse_part.judge_stops(measured.values))
        found.add([_still_off(measured, found)])


def _rates(prompt: Prompt, found: SelfTest, work: Progress) -> None:
    """The highest step rate of the arm's first 1, 2, … joints; on a virtual board of all of them, once."""
    most = len(found.data[DRIVERS]["joints"])
    counts = [most] if found.simulated else [count for count in rate_part.JOINTS if count <= most]
    highest = found.data[rate_part.PART] = {}
    for number, count in enumerate(counts):
        work(0.7 + 0.25 * number / len(counts), 1)
        rate = rate_part.highest(lambda rate: _keeps_up(prompt, found, [rate] * count), count)  # noqa: B023
        highest[str(count)] = rate
        found.add(rate_part.judge(rate, count))


def _keeps_up(prompt: Prompt, found: SelfTest, rates: Sequence[int]) -> bool | None:
    """Whether so many joints make these rates; None where it could not be tried."""
    arguments = {
        "record": _ARM_RECORD,
        "motion": motion.at_rates(rates, rate_part.DURATION_S).hex(),
        "rates": [rate_part.limit(rate) for rate in rates],
        "idle_us": _SIMULATED_TURN_US if found.simulated else 0,
    }
    measured = _part(prompt, found, rate_part.PART, "engine", "rates", **arguments)
    return None if measured is None else not measured.values["fault"]


def _arguments(moved: motion.TestMotion, found: SelfTest) -> dict[str, Any]:
    return {
        "record": _ARM_RECORD,
        "motion": moved.record.hex(),
        "start_steps": moved.start_steps,
        "idle_us": _SIMULATED_TURN_US if found.simulated else 0,
    }


def _driver_lines(found: dict[str, Any]) -> Iterator[Measurement]:
    if found["active"] is None:
        yield left_out(
            DRIVERS,
            "no arm is configured, so the level that switches drivers off is unknown; no pulses were made",
            "run 'armtempo configure' with your arm file, then the self-test again",
        )
        return
    yield _off_line("ENABLE (PE12)", found["active"], (found["output"], found["driven"], found["level"]))


def _still_off(measured: Measured, found: SelfTest) -> Measurement:
    """After a part that made steps."""
    return _off_line("ENABLE after that", found.data[DRIVERS]["active"], measured.values["enable"])


def _off_line(what: str, active: int, state: Sequence[int]) -> Measurement:
    level = "high" if state[2] else "low"
    return judged(
        DRIVERS,
        what,
        f"{level}, {'driven' if state[0] else 'not driven'}",
        f"{'low' if active else 'high'}, driven",
        _off(active, state),
        "take power from the drivers, look for a short at PE12; no pulses were made",
    )


def is_off(found: dict[str, Any]) -> bool:
    """Whether ENABLE is driven to its inactive level, and is at it."""
    active = found["active"]
    return active is not None and _off(active, (found["output"], found["driven"], found["level"]))


def _off(active: int, state: Sequence[int]) -> bool:
    return bool(state[0] and state[1] == state[2] == 1 - active)


def _back(client: Client) -> None:
    """Greet the program, which starts again after the reset; LinkError where it does not answer in time."""
    limit_s = time.monotonic() + _BACK_S
    while True:
        time.sleep(_LOOK_S)
        try:
            client.session.open_again()
            client.hello()
            return
        except LinkError:
            with suppress(LinkError):
                client.session.transport.close()
            if time.monotonic() > limit_s:
                raise
