"""The beginning of ``armtempo stop``: sends the request before the rest of the command is imported.

Most of the time from the key press to the brake is the start of Python, so this module imports very little:
no ``typing``, ``socket`` or ``json`` before the request is sent (``python -m tests.benchmark.stop_latency``).
``line_socket`` does that for other callers, too. Other cases, such as a board that no other program has, are
left to the command.
"""

from __future__ import annotations

import os

from armtempo.ports import claim_file, names
from armtempo.ports.line_socket import LineSocket, request_line

TYPE_CHECKING = False  # as in "typing"
if TYPE_CHECKING:
    from collections.abc import Sequence

BY = "'armtempo stop'"
"""Who asks for the stop, for the other program's messages."""
ANSWER_S = 8.0
_HELLO_S = 2.0
_PROJECT_FILE = "armtempo.toml"


class StopAnswer:
    """The answer of the program that has the port. (A data class would take 10 ms to import.)"""

    def __init__(self, moved: bool, program: str) -> None:
        """``program``: its description."""
        self.moved = moved
        self.program = program


_answers: dict[tuple[str, bool], StopAnswer] = {}
"""Answers by the port's name and ``now``."""


def send(arguments: Sequence[str]) -> None:
    """Send a stop to the program that has the port, if the arguments after ``stop`` are simple."""
    now, port = "--now" in arguments, os.environ.get("ARMTEMPO_PORT", "")
    rest = [word for word in arguments if word not in ("--now", "--json")]
    if len(rest) == 2 and rest[0] == "--port":
        port = rest[1]
    elif len(rest) == 1 and rest[0].startswith("--port="):
        port = rest[0].removeprefix("--port=")
    elif rest:
        return
    try:
        claim = _claim(port or _port_of_project())
        if claim:
            _pass_on(claim, now)
    except (OSError, ValueError, KeyError, TypeError):
        return  # the command meets the same error and reports it


def take_answer(port: str, now: bool) -> StopAnswer | None:
    """The answer to ``send`` for this port; None if it did not ask."""
    return _answers.pop((names.same_for_all(port), now), None)


def _claim(port: str) -> list[str]:
    """The fields of the claim to a port (default: of the only claim); empty if there is none."""
    found = [fields for fields in map(claim_file.read, claim_file.paths()) if fields]
    if not port:
        found = [fields for fields in found if _lives(int(fields[4]))]
        return found[0] if len(found) == 1 else []
    name = names.same_for_all(port)
    return next((fields for fields in found if fields[0] == name), [])


def _lives(pid: int) -> bool:
    """Whether the process exists, if that can be determined."""
    if os.name == "posix":
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return False
    return True


def _port_of_project() -> str:
    """The port in the nearest ``armtempo.toml``, as a full path; "" if none is set."""
    place = os.getcwd()
    while not os.path.isfile(os.path.join(place, _PROJECT_FILE)):
        if place == os.path.dirname(place):
            return ""
        place = os.path.dirname(place)
    import tomllib

    with open(os.path.join(place, _PROJECT_FILE), "rb") as file:
        port = tomllib.load(file).get("port", "")
    if port.startswith(names.SIM + ":"):
        folder = os.path.expanduser(port.removeprefix(names.SIM + ":"))
        return f"{names.SIM}:{os.path.join(place, folder)}"
    return str(port)


def _pass_on(claim: list[str], now: bool) -> None:
    """Send the request, and keep the answer."""
    name, _, _, program, pid, number, address, token, version = claim
    hello = request_line(1, "hello", {"version": int(version), "token": token})
    stop = request_line(2, "stop", {"now": now, "by": BY})
    line = _second_answer(address, hello + stop)
    if line is None:
        from armtempo.ports import caller

        caller.remember_hanging(number)
        return
    import json  # the board is braking now

    answer = json.loads(line)
    if answer.get("ok"):
        _answers[name, now] = StopAnswer(answer["moving"], f"'{program}' (process {pid})")


def _second_answer(address: str, requests: bytes) -> bytes | None:
    """The line that answers the second request; None if the other program hangs."""
    try:
        connection = LineSocket(address, _HELLO_S)
    except TimeoutError:
        return None
    try:
        connection.send(requests, _HELLO_S)
        try:
            answered = connection.line(_HELLO_S)
        except TimeoutError:
            return None
        line = answered and connection.line(ANSWER_S)
    finally:
        connection.close()
    if line is None:
        raise OSError("the connection ended before the answer")
    return line
