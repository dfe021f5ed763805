"""Connect to a board by its port; other programs on this machine can then watch and stop it."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from armtempo.basics.arguments import checked
from armtempo.link.connect import Opening, open_board, patiently
from armtempo.link.traffic import Chunk, Sink
from armtempo.model.arm import Arm
from armtempo.ports import board_port
from armtempo.robot import kept_position
from armtempo.robot.board import Board
from armtempo.robot.sharing import Sharing

LOG = logging.getLogger("armtempo")


@checked
def connect(
    port: str | None = None,
    arm: Arm | Path | str | None = None,
    *,
    log_traffic: Path | str | None = None,
    sink: Sink | None = None,
    any_program: bool = False,
    tell: Callable[[str], object] = LOG.warning,
) -> Board:
    """Connect to the board on ``port``; use the result as a context, or ``close`` it.

    ``port``: a serial device or URL; ``"sim"`` starts a virtual board that ends when it is closed,
    ``"sim:FOLDER"`` one with its flash in FOLDER, and its arm where it was closed. None: ARMTEMPO_PORT or the
    project folder's ``armtempo.toml``, else the only board plugged in (reported to ``tell``), never a virtual
    board. ``arm``: moved by a virtual board's motors; None: ideal motors. ``log_traffic``: file for all bytes
    in both directions; ``sink`` is called with the same. ``any_program``: accept a board whose program differs
    from the installed one. ``tell`` is called with messages about the connection; default: the logger
    "armtempo". Until the board is closed, other programs on this machine can watch and stop it (``attach``). A
    port in use is retried for a few seconds, as many programs use it only briefly, and taken over from a
    program that hangs, unless the arm moves.

    Raises InputError if there is no such port, or if none is set and not exactly one board is plugged in;
    PortInUseError if another program has the port, LinkError if the board does not answer or runs another
    program.
    """
    log = Path(log_traffic) if log_traffic else None
    moved = None if arm is None else Arm.of(arm)
    found = chosen(port, tell)
    return patiently(lambda: connect_now(found, moved, Opening(log, sink, any_program, tell=tell)))


def chosen(port: str | None, tell: Callable[[str], object]) -> str:
    """The port to open, as in ``connect``; tells which if it was not asked for."""
    found = board_port.choose(port)
    if found.source in board_port.UNASKED:
        tell(f"port {found.value}: {found.source}")
    return found.value


def connect_now(port: str, arm: Arm | None, how: Opening) -> Board:
    """As ``connect``, to a given port and without waiting; raises PortInUseError if another program has it."""
    stack = ExitStack()
    taps = _Taps(how.sink)
    kept = kept_position.read(port)
    how = replace(how, sink=taps, start_deg=kept.angles_deg(arm) if kept else None)
    client = stack.enter_context(open_board(port, how, arm))
    kept_position.take(client, port, kept)
    board = Board(client, port, stack)
    sharing = Sharing(client, board.state, board.stops, lambda: board.arm)
    stack.callback(sharing.close)
    try:
        sharing.open(port)
        taps.sinks.append(sharing.traffic)
    except OSError as error:
        how.tell(
            f"no other program can watch or stop this one, not even 'armtempo stop' ({error.strerror}): stop it here"
        )
    return board


class _Taps:
    """A sink that passes the traffic to several sinks."""

    def __init__(self, *sinks: Sink | None) -> None:
        self.sinks = [sink for sink in sinks if sink is not None]

    def __call__(self, chunk: Chunk, words: list[str]) -> None:
        """Pass a chunk on."""
        for sink in self.sinks:
            sink(chunk, words)
