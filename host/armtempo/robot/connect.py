"""Connect to a board by its port; other programs on this machine can then watch and stop it."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from armtempo.basics.arguments import checked
from armtempo.link.connect import open_board, patiently
from armtempo.link.traffic import Chunk, Sink
from armtempo.model.arm import Arm
from armtempo.ports import board_port
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
    ``"sim:FOLDER"`` one with its flash in FOLDER. None: ARMTEMPO_PORT or the project folder's
    ``armtempo.toml``, else the only board plugged in (reported to ``tell``), never a virtual board. ``arm``:
    moved by a virtual board's motors; None: ideal motors. ``log_traffic``: file for all bytes in both
    directions; ``sink`` is called with the same. ``any_program``: accept a board whose program differs from
    the installed one. ``tell`` is called with messages about the connection; default: the logger "armtempo".
    Until the board is closed, other programs on this machine can watch and stop it (``attach``). A port in
    use is retried for a few seconds, as many programs use it only briefly.

    Raises InputError if there is no such port, or if none is set and not exactly one board is plugged in;
    PortInUseError if another program has the port, LinkError if the board does not answer or runs another
    program.
    """
    moved = None if arm is None else Arm.of(arm)
    chosen = board_port.choose(port)
    if chosen.source in board_port.UNASKED:
        tell(f"port {chosen.value}: {chosen.source}")
    return patiently(
        lambda: connect_now(
            chosen.value, moved, log_traffic=log_traffic, sink=sink, any_program=any_program, tell=tell
        )
    )


def connect_now(
    port: str,
    arm: Arm | None = None,
    *,
    log_traffic: Path | str | None = None,
    sink: Sink | None = None,
    any_program: bool = False,
    tell: Callable[[str], object] = LOG.warning,
) -> Board:
    """As ``connect``, to a given port and without waiting; raises PortInUseError if another program has it."""
    stack = ExitStack()
    taps = _Taps(sink)
    log = Path(log_traffic) if log_traffic else None
    client = stack.enter_context(open_board(port, log, taps, arm, any_program, tell))
    client.session.tell = tell
    board = Board(client, port, stack)
    sharing = Sharing(client, board.state, board.stops, lambda: board.arm)
    stack.callback(sharing.close)
    try:
        sharing.open(port)
        taps.sinks.append(sharing.traffic)
    except OSError as error:
        tell(f"other programs cannot watch or stop this one: {error}")
    return board


class _Taps:
    """A sink that passes the traffic to several sinks."""

    def __init__(self, *sinks: Sink | None) -> None:
        self.sinks = [sink for sink in sinks if sink is not None]

    def __call__(self, chunk: Chunk, words: list[str]) -> None:
        """Pass a chunk on."""
        for sink in self.sinks:
            sink(chunk, words)
