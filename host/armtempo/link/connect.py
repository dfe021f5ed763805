"""Opening a port, or a virtual board, and making sure that an armtempo board answers there."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from armtempo_shared.messages import SYNC

from armtempo.errors import InputError
from armtempo.link import diagnose, traffic
from armtempo.link.board import Board
from armtempo.link.ports import SIM
from armtempo.link.session import NoAnswer, Session
from armtempo.link.transport import SerialTransport, Transport

_NOISY_TRIES = 10
"""Where something arrives that may be pieces of frames, ``hello`` is tried so often."""


@contextmanager
def open_board(
    port: str, log_traffic: Path | None = None, sink: traffic.Sink | None = None
) -> Iterator[Board]:
    """The board on ``port``, greeted; ``"sim"`` starts a virtual one that lives as long as the context.

    ``log_traffic``: file for the traffic log; ``sink`` takes the traffic as well. Raises InputError where
    there is no such port, LinkError where it is in use, silent or runs something else.
    """
    with ExitStack() as stack:
        device = _virtual_port(stack) if port == SIM else port
        transport = _logged(stack, SerialTransport(device), log_traffic, sink)
        stack.callback(transport.close)
        yield greet(transport)


def greet(
    transport: Transport, session_number: int | None = None, clock: Callable[[], float] = time.monotonic
) -> Board:
    """A board that has answered ``hello``; LinkError, saying what is there instead, where none has."""
    board = Board(Session(transport, clock), session_number)
    for _ in range(_NOISY_TRIES):
        try:
            board.hello()
            return board
        except NoAnswer:
            if SYNC not in board.session.recent:
                break
    raise diagnose.explain(transport, bytes(board.session.recent))


def _virtual_port(stack: ExitStack) -> str:
    from armtempo import virtual

    return str(stack.enter_context(virtual.launch()).port)


def _logged(
    stack: ExitStack, transport: Transport, path: Path | None, sink: traffic.Sink | None
) -> Transport:
    if path is not None:
        try:
            file = stack.enter_context(path.open("w", encoding="utf-8"))
        except OSError as error:
            transport.close()
            raise InputError(f"{path}: the traffic log cannot be written: {error.strerror}") from error
        transport = traffic.LoggedTransport(transport, traffic.writer(file))
    return transport if sink is None else traffic.LoggedTransport(transport, sink)
