"""Opening a port, or a virtual board, and making sure that an armtempo board answers there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from armtempo.errors import InputError
from armtempo.link import diagnose, traffic
from armtempo.link.board import Board
from armtempo.link.ports import SIM
from armtempo.link.session import NoAnswer, Session
from armtempo.link.transport import SerialTransport, Transport


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


def greet(transport: Transport) -> Board:
    """A board that has answered ``hello``; LinkError, saying what is there instead, where none has."""
    board = Board(Session(transport))
    try:
        board.hello()
    except NoAnswer:
        raise diagnose.explain(transport, bytes(board.session.recent)) from None
    return board


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
