"""Opening a port, or a virtual board, and making sure that an armtempo board answers there."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from armtempo_shared import wire
from armtempo_shared.messages import SYNC

from armtempo.basics.errors import (
    BoardError,
    DisturbedError,
    LinkError,
    NoAnswerError,
    NoProgramError,
    PortError,
    PortInUseError,
)
from armtempo.link import traffic
from armtempo.link.client import Client
from armtempo.link.program_version import IN_LIBRARY, UPDATE, own_crc
from armtempo.link.session import Session
from armtempo.link.transport import SerialTransport, Transport
from armtempo.model.arm import Arm
from armtempo.ports import claim as claims
from armtempo.ports import names
from armtempo.ports.caller import Ownership, ownership
from armtempo.ports.claim import PortClaim

_Found = TypeVar("_Found")
_NOISY_TRIES = 10
"""Attempts at ``hello`` if parts of frames arrive."""
_LOOK_S = 0.05
LOOK_S = 0.4
_REPL_SIGNS = (b">>>", b"raw REPL")
"""Bytes that identify a REPL; not the firmware's name, which is also in the answer to ``hello``."""
_FRAME_SIGNS = (bytes((SYNC,)), bytes((wire.EVENT["ok"][1], wire.COMMAND["hello"][1])))
"""A frame's first byte, or the beginning of an answer to ``hello``."""
_ECHO = b"#armtempo?"
_NUDGE = b"\r\x02\r" + _ECHO + b"\r"
"""Ends a line, leaves a raw REPL, and writes a comment, which a prompt echoes even in an unfinished line; the
board program ignores these bytes."""
_ASK = b"print('armtempo','is','here')if'armtempo'in open('/flash/main.py').read()else 0\r"
_ASK_PARTS = (
    "import os;print('armtempo','in','parts')if[n for n in os.listdir('/flash/lib')if n in"
    f"{IN_LIBRARY!r}]else 0\r"
).encode()
_IN_PARTS = b"armtempo in parts"
_HERE = b"armtempo is here"
"""The prompt's answer if the program is in the flash; differs from the echo of the question."""


def patiently(attempt: Callable[[], _Found]) -> _Found:
    """Call ``attempt`` again while another program has the port, as many programs use it only briefly.

    Raises PortInUseError after PATIENCE_S, and any other error of ``attempt``.
    """
    limit_s = time.monotonic() + claims.PATIENCE_S
    while True:
        try:
            return attempt()
        except PortInUseError:
            if time.monotonic() > limit_s:
                raise
            time.sleep(_LOOK_S)


@dataclass(frozen=True)
class Opening:
    """How to open a board's port."""

    log_traffic: Path | None = None
    """File for the traffic log."""
    sink: traffic.Sink | None = None
    """Called with the traffic too."""
    any_program: bool = False
    """Accept a board whose program differs from the installed one."""
    take_moving: bool = False
    """Take the port over from a program that hangs even while the board moves: for a stop."""
    start_deg: Sequence[float] | None = None
    """Where the arm of a virtual board stands, degrees (J,); None: at home."""
    tell: Callable[[str], object] = lambda text: None
    """Called with messages about the connection."""


@contextmanager
def open_board(port: str, how: Opening = Opening(), arm: Arm | None = None) -> Iterator[Client]:
    """Open the board on ``port``; a sim port starts a virtual board that lives as long as the context.

    ``arm``: moved by a virtual board's motors. Raises InputError if there is no such port, PortInUseError if
    another program has it (see ``patiently``), LinkError if the board does not answer or runs another program.
    The port is taken over from a program that hangs.
    """
    hanging = _check_owner(port, how.tell)
    with ExitStack() as stack:
        if hanging is not None:
            device = hanging.device
        else:
            device = stack.enter_context(_virtual_port(port, arm, how)) if names.is_sim(port) else port
        sinks = [] if how.sink is None else [how.sink]
        if how.log_traffic is not None:
            sinks.append(stack.enter_context(traffic.LogFile(how.log_traffic)))

        def open_transport() -> Transport:
            transport: Transport = SerialTransport(device, exclusive=hanging is None)
            for taken_by in sinks:
                transport = traffic.LoggedTransport(transport, taken_by)
            return transport

        transport = stack.enter_context(closing(open_transport()))
        session = Session(transport, reopen=open_transport, comes_back=not names.is_sim(port), tell=how.tell)
        stack.callback(lambda: session.transport.close())
        board = greet(session)
        if hanging is not None:
            _take_over(hanging, board, how)
        if not how.any_program:
            _check_program(board)
        yield board


def _check_owner(port: str, tell: Callable[[str], object]) -> PortClaim | None:
    """The claim of a program that has the port and hangs; raises PortInUseError if it answers."""
    name = names.same_for_all(port)
    claim = claims.find(name, port) if name else None
    if claim is None:
        return None
    state = ownership(claim)
    if state is Ownership.ALIVE:
        raise PortInUseError(
            f"port {port} is in use by {claim.who}",
            "wait for its end, or stop it with 'armtempo stop'; 'armtempo status' and 'watch' work meanwhile",
        )
    if state is Ownership.DEAD:
        tell(f"{claim.who} has ended without closing {port}; a motion that it started may still run")
        claim.remove()
        return None
    if not claims.LOCAL_SOCKETS:  # Windows opens a port only once
        raise PortError(
            f"{claim.who} has port {port} and does not answer", "end that process, then try again"
        )
    return claim


def _take_over(hanging: PortClaim, board: Client, how: Opening) -> None:
    """Say that the port is taken over; raises PortInUseError while the board moves, unless that does not matter."""
    if board.status().moving and not how.take_moving:
        raise PortInUseError(
            f"{hanging.who} has port {hanging.port} and does not answer, and the arm moves",
            f"stop it with 'armtempo stop'; to go on without that program, end process {hanging.pid} first",
        )
    how.tell(f"{hanging.who} has port {hanging.port} and does not answer; taking the port over")


def _check_program(board: Client) -> None:
    if board.info.program_crc != own_crc():
        raise LinkError(
            (
                f"the board on {board.session.transport.name} runs version {board.info.program_crc:08x} of the board "
                f"program, installed here is {own_crc():08x}"
            ),
            f"update it: {UPDATE}",
        )


def greet(session: Session, session_number: int | None = None) -> Client:
    """Exchange ``hello``; raises LinkError with a diagnosis if no board answers."""
    board = Client(session, session_number)
    for _ in range(_NOISY_TRIES):
        try:
            board.hello()
            return board
        except NoAnswerError:
            reason = explain(session.transport, bytes(session.recent))
            if not isinstance(reason, DisturbedError):
                break
    raise reason


@contextmanager
def _virtual_port(port: str, arm: Arm | None, how: Opening) -> Iterator[str]:
    """A virtual board's port; if its program fails, link errors end with the last line of its log."""
    from armtempo.simulator import LaunchOptions, launch

    with launch(LaunchOptions(names.sim_flash(port), arm=arm, start_deg=how.start_deg)) as board:
        try:
            yield board.port
        except LinkError as error:
            words = board.log().strip().splitlines()[-1:]
            if isinstance(error, BoardError) or not words:
                raise
            raise LinkError(
                f"{error.problem}; the virtual board says: {words[0]}", f"{error.hint}"
            ) from error


def explain(transport: Transport, heard: bytes) -> LinkError:
    """The error for what the port sends: nothing, a REPL, parts of frames, or something else; ``heard``:
    bytes received before."""
    transport.write(_NUDGE)
    heard += _listen(transport)
    where = f"the board on {transport.name}"
    if _ECHO in heard or any(sign in heard for sign in _REPL_SIGNS):
        transport.write(_ASK)
        if _HERE in _listen(transport):
            return NoProgramError(
                f"{where} runs MicroPython but not the armtempo program, which is on it: mpremote or an IDE ended it",
                f"press the board's reset button, or: mpremote connect {transport.name} reset; if it does "
                "not start then: 'armtempo deploy'",
            )
        transport.write(_ASK_PARTS)
        if _IN_PARTS in _listen(transport):
            return NoProgramError(
                f"{where} runs MicroPython but not the armtempo program: its deployment was interrupted",
                "'armtempo deploy' completes it",
            )
        return NoProgramError(
            f"{where} runs MicroPython but not the armtempo program",
            "'armtempo flash' installs the firmware with it; then run 'armtempo deploy'",
        )
    if any(sign in heard for sign in _FRAME_SIGNS):
        return DisturbedError(
            f"{where} is mostly unreadable: only parts of armtempo's messages arrive",
            "check cable and plugs",
        )
    if heard:
        return LinkError(
            f"something other than armtempo answers on {transport.name} (it says {_excerpt(heard)})",
            "choose another port: 'armtempo ports' lists them",
        )
    return LinkError(
        f"{where} does not answer within 2 s",
        (
            "check the cable, that the board is powered, and that this is its port ('armtempo ports'); reset a "
            "board that hangs by its button"
        ),
    )


def _listen(transport: Transport) -> bytes:
    heard = b""
    for _ in range(4):
        heard += transport.read(LOOK_S / 4)
    return heard


def _excerpt(heard: bytes) -> str:
    return repr(heard[:40])[1:]
