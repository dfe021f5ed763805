"""The sequence of a self-test. If ENABLE is not at its inactive level, nothing is done."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from armtempo_shared import codes
from armtempo_shared.limits import MAX_MOTION_BYTES, MAX_STEP_RATE_SUM
from armtempo_shared.meanings import ERRORS

from armtempo.basics.errors import BoardError, LinkError
from armtempo.basics.progress import Progress, stage, watched
from armtempo.diagnosis.finding import Level
from armtempo.diagnosis.selftest import board_part, drivers_part, link_part, motion, pulse_part, rate_part
from armtempo.diagnosis.selftest.drivers_part import DRIVERS
from armtempo.diagnosis.selftest.prompt import (
    PARTS,
    RESET,
    WATCHDOG_RESET,
    Measured,
    PartError,
    Prompt,
    SilentError,
    at_prompt,
)
from armtempo.diagnosis.selftest.result import Measurement, SelfTest, judged
from armtempo.link import Client
from armtempo.link.board_messages import Hello
from armtempo.model import engine_pins

_FEATURE = "sequences"
"""A feature that only the program in the firmware has, as the modules that the parts import."""
UNIQUE_ID_DIGITS = 24
_ROOT = "/flash/armtempo"
_ARM_RECORD = f"{_ROOT}/arm.ata"
_BACK_S = 60.0
_SIMULATED_TURN_US = 1000
"""Duration of a pass of the loop on a virtual board, about that of the chip."""
_SEED = 5
_STOPS, _BATCH, _SIMULATED_STOPS = 1000, 50, 4
"""Numbers of stops, by E-stop and limit switch, software and edge, in turn. A batch is one call of the part."""
_WAITS_US = (22_000, 78_000)
"""Range of the random times of stops in ``motion.make``, which begins 20 ms after its start."""
_STARVED_S = 0.06
_LONG_S, _SIMULATED_LONG_S = 4.0, 0.3
_MOST_EDGES = 2000
"""Largest number of captured edges of a port."""
_LOOK_S = 0.3
SILENT = "silence"
"""Key in the data: the part in which the board became silent."""


def run(client: Client, progress: Progress | None = None) -> SelfTest:
    """Test the board of ``client``; afterwards it runs its program again, and positions are unknown.

    Raises LinkError, before anything is done, if a motion runs, a fault is pending, the drivers are on, or
    the program is not in the firmware; and LinkError, naming the part, if the board stops answering.
    """
    info = client.info
    found = SelfTest(info.board_id[:UNIQUE_ID_DIGITS], info.virtual, info.program_crc)
    with watched(progress) as work:
        _check_rest(client)
        stage("link")
        work(0, 1)
        found.data[link_part.PART] = link_part.trips(client)
        _leave(client, found, lambda prompt: _at_prompt(prompt, found, work))
        found.add([_same_memory(info.engine_bytes, client.info.engine_bytes), _largest_motion(client.info)])
        found.add(_watchdog(client, found))
        found.add(rate_part.judge_stated(found.data.get(rate_part.PART), client.info))
        work(1, 1)
    return found


def _same_memory(before: int, after: int) -> Measurement:
    return judged(
        board_part.MEMORY,
        "memory for motions, before and after",
        f"{before}, {after} bytes",
        "the same",
        before == after,
        "reset the board; if it is so each time, please report it",
    )


def _largest_motion(info: Hello) -> Measurement:
    """The line about the largest motion, which is read from the flash in pieces."""
    size = min(info.free_flash, MAX_MOTION_BYTES)
    is_full = size < MAX_MOTION_BYTES
    return Measurement(
        board_part.MEMORY, "largest motion that fits", f"{size} bytes", f"{MAX_MOTION_BYTES} bytes",
        Level.NOTE if is_full else Level.GOOD, "remove motions: 'armtempo remove'" if is_full else "",
    )  # fmt: skip


def _watchdog(client: Client, found: SelfTest) -> Iterator[Measurement]:
    """The line about the reset by the watchdog, after a complete self-test; its fault is cleared."""
    if SILENT in found.data:
        return
    fault = client.status().fault
    yield judged(
        pulse_part.SAFETY,
        "watchdog, not fed for 100 ms",
        "reset the board" if fault == codes.WATCHDOG else "did not reset the board",
        "resets the board",
        fault == codes.WATCHDOG,
        "do not connect drivers: a program that hangs would not end; please report it with the output",
    )
    with suppress(BoardError):  # an E-stop that is not wired keeps its own
        client.clear()


def _check_rest(client: Client) -> None:
    client.need(_FEATURE, "the self-test")
    status = client.status()
    if status.moving:
        raise LinkError("the board is moving", "wait for the end of the motion, or 'armtempo stop'")
    # An E-stop that is not wired; a self-test that hung
    if status.fault not in (
        0,
        codes.ESTOP,
        codes.WATCHDOG,
    ):
        name, _, _ = ERRORS.get(status.fault, (str(status.fault), "", ""))
        raise LinkError(f"the board has fault {name} pending", "remove its cause, then 'armtempo clear'")


def _leave(client: Client, found: SelfTest, work: Callable[[Prompt], None]) -> None:
    """Do ``work`` at the board's REPL, then wait for its program."""
    session = client.session
    with session.lock:
        client.leave()
        session.transport.close()
        try:
            with at_prompt(session.transport.name) as prompt:
                _check_drivers(prompt, found)
                work(prompt)
        finally:
            _back(client)


def _check_drivers(prompt: Prompt, found: SelfTest) -> None:
    """Raise LinkError, and let the program continue, unless ENABLE is inactive or the board has no arm.

    Afterwards the end of the REPL is a reset, which switches drivers off.
    """
    prompt.enter(soft_reset=False)
    drivers = _drivers(prompt)
    if drivers_part.is_on(drivers.values):
        raise LinkError(
            "the drivers are on (ENABLE, PE12, is active)",
            "support the arm, then press the board's reset button, which switches them off, and run the self-test "
            "again; if they are still on, look for a short at PE12",
        )
    prompt.at_end = RESET
    if 0 < drivers.noted <= len(PARTS):
        found.add([_hung(PARTS[drivers.noted - 1])])


def _hung(part: str) -> Measurement:
    return Measurement(
        board_part.BOARD, "the self-test before", f"the board hung in {part!r} and was reset", "", Level.NOTE,
        f"if it hangs in {part!r} again, please report it with the output",
    )  # fmt: skip


def _drivers(prompt: Prompt) -> Measured:
    return prompt.measure("drivers", record=_ARM_RECORD)


def _at_prompt(prompt: Prompt, found: SelfTest, work: Progress) -> None:
    """Run all parts, even after failures, until the board stops answering."""
    try:
        prompt.enter(soft_reset=True)
        drivers = found.data[DRIVERS] = _drivers(prompt).values
        found.add(drivers_part.judge(drivers))
        work(0.1, 1)
        if measured := _part(prompt, found, board_part.BOARD, "identity"):
            found.add(board_part.judge(measured.values, found.board_id))
        work(0.2, 1)
        if measured := _part(prompt, found, board_part.CYCLES, "cycles", motion=motion.evaluated().hex()):
            found.add(board_part.judge_cycles(measured.values))
        work(0.3, 1)
        stage(link_part.PART)
        found.data[link_part.PART] |= prompt.rates()
        found.add(link_part.judge(found.data[link_part.PART], found.simulated))
        if drivers_part.is_off(drivers) and _is_still(prompt, found):
            _move(prompt, found, work)
            # otherwise rates have no meaning
            if not any(line.part == pulse_part.PULSES for line in found.failed):
                _rates(prompt, found, work)
        prompt.at_end = WATCHDOG_RESET
    except SilentError as error:
        found.data[SILENT] = error.part
        found.add([_failed(error.part, error)])


def _part(prompt: Prompt, found: SelfTest, part: str, name: str, **arguments: Any) -> Measured | None:
    """Run ``name`` of the board's parts; returns its result, None (with a line of ``part``) after an exception."""
    stage(part)
    try:
        measured = prompt.measure(name, **arguments)
    except PartError as error:
        found.add([_failed(part, error)])
        return None
    found.data.setdefault(part, measured.values)
    return measured


def _failed(part: str, error: LinkError) -> Measurement:
    return judged(part, "the whole part", error.problem, "an answer", False, error.hint)


def _is_still(prompt: Prompt, found: SelfTest) -> bool:
    """Whether no encoder turns with the first steps; otherwise ENABLE is wired or configured wrong, and the
    test ends."""
    arguments = _arguments(motion.gentle(found.data[DRIVERS]["joints"]), found)
    measured = _part(prompt, found, "encoders", "encoders", **arguments)
    if measured is None:
        return False
    lines = list(drivers_part.judge_encoders(measured.values))
    found.add([*lines, _still_off(measured.values, found)])
    return lines[0].verdict is Level.GOOD


def _still_off(values: dict[str, Any], found: SelfTest) -> Measurement:
    """The line about ENABLE after a part that made steps."""
    return drivers_part.off_line("ENABLE after that", found.data[DRIVERS]["active"], values["enable"])


def _move(prompt: Prompt, found: SelfTest, work: Progress) -> None:
    """Run the parts that make steps, with the drivers off."""
    joints = found.data[DRIVERS]["joints"]
    for done, forward in ((0.4, True), (0.5, False)):
        work(done, 1)
        moved = motion.make(joints) if forward else motion.back_in_turn(joints)
        arguments = {**_arguments(moved, found), "rates": moved.rates, "most": _MOST_EDGES}
        if measured := _part(prompt, found, pulse_part.PULSES, "pulses", **arguments):
            found.add(pulse_part.judge(measured, moved, joints, forward))
            found.add([_still_off(measured.values, found)])
            if forward:
                found.data[pulse_part.PULSES]["error_us"] = pulse_part.errors_us(measured, moved)
                found.add(pulse_part.judge_turns(measured.values))
    _move_long(prompt, found)
    moved = motion.make(joints)
    arguments = {**_arguments(moved, found), "rates": moved.rates}
    motions = [arguments.pop("motion"), motion.at_rates(_own(joints), _STARVED_S).hex()]
    _stop(prompt, found, {**arguments, "motions": motions}, work)


def _move_long(prompt: Prompt, found: SelfTest) -> None:
    """Run a motion of some seconds, and count its edges."""
    duration_s = _SIMULATED_LONG_S if found.simulated else _LONG_S
    moved = motion.long(found.data[DRIVERS]["joints"], duration_s)
    arguments = {**_arguments(moved, found), "rates": moved.rates, "most": 0}
    if measured := _part(prompt, found, pulse_part.PULSES, "pulses", **arguments):
        found.add([pulse_part.judge_long(measured.values, motion.long_steps(duration_s), duration_s)])
        found.add([_still_off(measured.values, found)])


def _stop(prompt: Prompt, found: SelfTest, arguments: dict[str, Any], work: Progress) -> None:
    """Run stops at random times, in batches of some seconds."""
    count = _SIMULATED_STOPS if found.simulated else _STOPS
    waits_us = np.random.default_rng(_SEED).integers(*_WAITS_US, count).tolist()
    all_of: dict[str, Any] = {}
    for begin in range(0, count, _BATCH):
        work(0.6 + 0.1 * begin / count, 1)
        arguments["waits_us"] = waits_us[begin : begin + _BATCH]
        measured = _part(prompt, found, pulse_part.SAFETY, "estop", **arguments)
        if measured is None:
            return
        before = all_of
        all_of = dict(measured.values)
        if before:
            all_of["wrong_faults"] += before["wrong_faults"]
            all_of["cycles"] = {
                name: before["cycles"].get(name, []) + took for name, took in all_of["cycles"].items()
            }
    found.data[pulse_part.SAFETY] = all_of
    found.add(pulse_part.judge_stops(all_of))
    found.add([_still_off(all_of, found)])


def _own(joints: Sequence[dict[str, Any]]) -> list[int]:
    """The joints' highest rates that the board can make together, with the shortest rings."""
    rates = [joint["max_rate"] for joint in joints]
    return [round(rate * min(1.0, MAX_STEP_RATE_SUM / sum(rates)) / 1.1) for rate in rates]


def _rates(prompt: Prompt, found: SelfTest, work: Progress) -> None:
    """The highest step rate of the arm's first 1, 2, … joints; on a virtual board of one and of all joints.

    Then for each the steps in the middle of a motion at four fifths of it, and the shortest ramp of all joints.
    """
    joints = found.data[DRIVERS]["joints"]
    most = len(joints)
    trials = _Trials(prompt, found)
    counts = [count for count in rate_part.JOINTS if count <= most]
    highest: dict[int, int | None] = {}
    for number, count in enumerate(counts[:1] + counts[-1:] if found.simulated else counts):
        work(0.7 + 0.25 * number / len(counts), 1)
        highest[count] = rate_part.highest(lambda rate: trials.keeps_up([rate] * count), count)  # noqa: B023
        found.add(rate_part.judge(highest[count], count))
        if rate := round(rate_part.KEPT * (highest[count] or 0)):
            found.add(trials.watched(joints[:count], rate))
            if count == counts[-1]:
                found.add([trials.ramp(rate, count)])
    found.add([rate_part.judge_load(trials.longest_cycles)])
    states = rate_part.to_state(highest)
    found.data[rate_part.PART] = {"highest": highest, "states": states}
    if states and not found.failed_in(DRIVERS, pulse_part.SAFETY):
        arguments = {"root": _ROOT, "program_crc": found.program_crc, "rates": (*states, most)}
        _part(prompt, found, "keep", "keep", **arguments)


class _Trials:
    """Motions of the arm's first joints in the program's main loop."""

    def __init__(self, prompt: Prompt, found: SelfTest) -> None:
        self._prompt, self._found = prompt, found
        self._duration_s = rate_part.SIMULATED_DURATION_S if found.simulated else rate_part.DURATION_S
        self.longest_cycles = 0

    def keeps_up(self, rates: Sequence[int], duration_s: float = 0.0) -> bool | None:
        """Whether the joints reach these rates; None if it could not be tried."""
        values = self._tried(rates, duration_s or self._duration_s, "")
        if values is None or values["fault"]:
            return None if values is None else False
        self.longest_cycles = max(self.longest_cycles, values["longest_pass_cycles"])
        return True

    def watched(self, joints: Sequence[dict[str, Any]], rate: int) -> Iterator[Measurement]:
        """The steps on the pins in the middle of a motion, by port, as the heap has space for one capture."""
        for port in sorted({engine_pins.table()["STEP"][joint["channel"]][0][0] for joint in joints}):
            values = self._tried([rate] * len(joints), self._duration_s, port)
            if values is not None:
                yield rate_part.judge_steps(values, port, rate, len(joints))

    def ramp(self, rate: int, count: int) -> Measurement:
        """The shortest ramp to a rate."""
        shortest = rate_part.shortest_s(
            lambda size_s: self.keeps_up([rate] * count, size_s), self._duration_s
        )
        return rate_part.judge_ramp(shortest, rate, count)

    def _tried(self, rates: Sequence[int], duration_s: float, port: str) -> dict[str, Any] | None:
        arguments = {
            "record": _ARM_RECORD,
            "motion": motion.at_rates(rates, duration_s).hex(),
            "rates": [motion.limit(rate) for rate in rates],
            "frames": rate_part.frames(),
            "idle_us": _SIMULATED_TURN_US if self._found.simulated else 0,
            "watch": (port, rate_part.watch_us(duration_s)) if port else None,
        }
        measured = _part(self._prompt, self._found, rate_part.PART, "rates", **arguments)
        return None if measured is None else measured.values


def _arguments(moved: motion.TestMotion, found: SelfTest) -> dict[str, Any]:
    return {
        "record": _ARM_RECORD,
        "motion": moved.record.hex(),
        "start_steps": moved.start_steps,
        "idle_us": _SIMULATED_TURN_US if found.simulated else 0,
    }


def _back(client: Client) -> None:
    """Wait for the program after the reset; raises LinkError if it does not answer in time."""
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
