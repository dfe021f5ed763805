"""The beginning of ``armtempo stop``: the request is on its way before the rest of the command is imported.

From the key press to the brake most time goes into starting Python, so this imports next to nothing: no ``typing``, no
``socket``, no ``json`` before the request is sent (``python -m tests.benchmark.stop_latency``). What it cannot
do, such as a board that no other program has, the command does as ever.
"""

from __future__ import annotations

import os

from armtempo.ports import claim_file, names

TYPE_CHECKING = False  # as "typing" has it
if TYPE_CHECKING:
    from collections.abc import Sequence

BY = "'armtempo stop'"
"""Who asked for the stop, as the other program says it."""
ANSWER_S = 8.0
_HELLO_S = 2.0
_PROJECT_FILE = "armtempo.toml"


class StopAnswer:
    """What the program that has the port answered. (A data class would take 10 ms to import.)"""

    def __init__(self, moved: bool, program: str) -> None:
        """``program``: who it is, in words."""
        self.moved = moved
        self.program = program


_answers: dict[tuple[str, bool], StopAnswer] = {}
"""By the port's name and ``now``."""


def send(arguments: Sequence[str]) -> None:
    """Pass a stop on to the program that has the port, if the arguments after ``stop`` are plain ones."""
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
        return  # the command meets the same, and says so


def take_answer(port: str, now: bool) -> StopAnswer | None:
    """What ``send`` was answered for this port; None if it has not asked."""
    return _answers.pop((names.same_for_all(port), now), None)


def _claim(port: str) -> list[str]:
    """The fields of the claim to a port; where none is named, of the only claim there is; else nothing."""
    found = [fields for fields in map(claim_file.read, claim_file.paths()) if fields]
    if not port:
        found = [fields for fields in found if _lives(int(fields[4]))]
        return found[0] if len(found) == 1 else []
    name = names.same_for_all(port)
    return next((fields for fields in found if fields[0] == name), [])


def _lives(pid: int) -> bool:
    """Whether there is such a process, as far as that can be told."""
    if os.name == "posix":
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return False
    return True


def _port_of_project() -> str:
    """The port of the nearest ``armtempo.toml``, by its full path; "" if there is none, or it names none."""
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
    """Ask, and keep the answer."""
    name, _, _, program, pid, number, address, token, version = claim
    said = f'{{"id":1,"request":"hello","version":{version},"token":"{token}"}}\n'
    asked = f'{{"id":2,"request":"stop","now":{"true" if now else "false"},"by":"{BY}"}}\n'
    lines = _answers_of(address, said + asked)
    if not lines:
        from armtempo.ports import caller

        caller.remember_hanging(number)
        return
    import json  # it brakes by now

    answer = json.loads(lines[1])
    if answer.get("ok"):
        _answers[name, now] = StopAnswer(answer["moving"], f"'{program}' (process {pid})")


def _answers_of(address: str, requests: str) -> list[bytes]:
    """The two lines that come back; none where nothing comes, because the other program hangs."""
    import _socket  # of every CPython; "socket" around it takes several ms to import

    local = address.isdecimal()
    connection = _socket.socket(_socket.AF_INET if local else _socket.AF_UNIX, _socket.SOCK_STREAM)
    connection.settimeout(_HELLO_S)
    data = b""
    try:
        connection.connect(("127.0.0.1", int(address)) if local else address)
        connection.sendall(requests.encode())
        while data.count(b"\n") < 2:
            piece = connection.recv(4096)
            if not piece:
                raise OSError("the connection ended before the answer")
            data += piece
            connection.settimeout(ANSWER_S)
    except TimeoutError:
        if data:
            raise
    finally:
        connection.close()
    return data.splitlines()
