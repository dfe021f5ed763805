"""The beginning of ``armtempo stop``: the request is on its way before the rest of the command is imported.

From the key press to the brake most time goes into starting Python; click alone takes longer than the request
(``python -m tests.benchmark.stop_latency``). What this cannot do, such as a board that no other program has, the
command does as ever.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import NamedTuple

from armtempo.errors import ArmtempoError
from armtempo.ports import names
from armtempo.share import claim
from armtempo.share.caller import Caller

BY = "'armtempo stop'"
"""Who asked for the stop, as the other program says it."""
ANSWER_S = 8.0


class StopAnswer(NamedTuple):
    """What the program that has the port answered."""

    moved: bool
    program: str
    """Who it is."""


_answers: dict[tuple[str, bool], StopAnswer] = {}
"""By port and ``now``."""


def send(arguments: Sequence[str]) -> None:
    """Pass a stop on to the program that has the port, where the arguments behind ``stop`` are plain ones."""
    now, port = "--now" in arguments, os.environ.get("ARMTEMPO_PORT", "")
    rest = [word for word in arguments if word not in ("--now", "--json")]
    if len(rest) == 2 and rest[0] == "--port":
        port = rest[1]
    elif len(rest) == 1 and rest[0].startswith("--port="):
        port = rest[0].removeprefix("--port=")
    elif rest:
        return
    try:
        _pass_on(port or _likely(), now)
    except (ArmtempoError, OSError):
        return  # the command meets the same, and says so


def take_answer(port: str, now: bool) -> StopAnswer | None:
    """What ``send`` was answered for this port; None where it has not asked."""
    return _answers.pop((port, now), None)


def _pass_on(port: str, now: bool) -> None:
    name = names.same_for_all(port)
    found = claim.find(name, port) if name else None
    if found is not None:
        with Caller(found) as caller:
            moved = bool(caller.ask("stop", ANSWER_S, now=now, by=BY)["moving"])
            _answers[port, now] = StopAnswer(moved, found.who)


def _likely() -> str:
    """The port that is meant where none is named."""
    from armtempo.project import board_port

    return board_port.choose(others=True).value
