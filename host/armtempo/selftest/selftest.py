"""The order of a self-test. Drivers stay off: where ENABLE is not at its inactive level, nothing is done."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

from armtempo.basics.errors import LinkError
from armtempo.basics.progress import Progress, stage, watched
from armtempo.link import Client
from armtempo.selftest import board_part, link_part
from armtempo.selftest.prompt import RESET, Prompt, at_prompt
from armtempo.selftest.result import Measurement, SelfTest, judged, left_out

DRIVERS = "drivers"
UNIQUE_ID_DIGITS = 24
_ARM_RECORD = "/flash/armtempo/arm.ata"
_BACK_S = 60.0
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
        found.add(link_part.judge(found.data[link_part.PART], found.simulated))
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
    try:
        found = _drivers(prompt)
        on = found["active"] is not None and found["output"] and found["level"] == found["active"]
    except LinkError as error:
        if "ImportError" not in error.problem:
            raise
        raise LinkError(
            "the board program on this board is files, which the self-test cannot use",
            "put MicroPython with the program in it on the board: 'armtempo flash'",
        ) from None
    if on:
        raise LinkError(
            "the drivers are on (ENABLE, PE12, is active), and the self-test would switch them off",
            "support the arm, then press the board's reset button, which switches them off, and run it again",
        )
    prompt.at_end = RESET


def _drivers(prompt: Prompt) -> dict[str, Any]:
    return prompt.measure("drivers", record=_ARM_RECORD).values


def _at_prompt(prompt: Prompt, found: SelfTest, work: Progress) -> None:
    prompt.enter(soft_reset=True)
    drivers = _drivers(prompt)
    found.data[DRIVERS] = drivers
    found.add(_driver_lines(drivers))
    stage("board")
    work(0.1, 1)
    identity = found.data[board_part.BOARD] = prompt.measure("identity").values
    found.add(board_part.judge(identity, found.board_id))
    stage("cycles")
    work(0.3, 1)
    cycles = found.data[board_part.CYCLES] = prompt.measure("cycles").values
    found.add(board_part.judge_cycles(cycles))
    stage("link")
    work(0.4, 1)
    found.data[link_part.PART] |= prompt.rates()


def _driver_lines(found: dict[str, Any]) -> Iterator[Measurement]:
    if found["active"] is None:
        yield left_out(
            DRIVERS,
            "no arm is configured, so the level that switches drivers off is unknown",
            "run 'armtempo configure' with your arm file, then the self-test again",
        )
        return
    level = "high" if found["level"] else "low"
    yield judged(
        DRIVERS,
        "ENABLE (PE12)",
        f"{level}, {'driven' if found['output'] else 'not driven'}",
        f"{'low' if found['active'] else 'high'}, driven",
        is_off(found),
        "take power from the drivers, look for a short at PE12",
    )


def is_off(found: dict[str, Any]) -> bool:
    """Whether ENABLE is driven to its inactive level, and is at it."""
    return bool(
        found["active"] is not None
        and found["output"]
        and found["driven"] == found["level"] == 1 - found["active"]
    )


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
