"""From the name of a port to a board in use, which other programs on this machine can look into and stop."""

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
    """The board on ``port``, which has answered; use it as a context, or ``close`` it.

    ``port``: a serial device or URL; ``"sim"`` starts a virtual board that lives until it is closed,
    ``"sim:FOLDER"`` one that keeps its flash in FOLDER. None: what ARMTEMPO_PORT or the project folder's
    ``armtempo.toml`` says, else the one board that is plugged in, which ``tell`` hears; a virtual one is never
    taken unasked. ``arm``: what a virtual board's motors move; None: ideal motors. ``log_traffic``: file that
    gets every byte both ways; ``sink`` takes the same. ``any_program``: also talk to a board whose program is
    not the one installed here. ``tell`` hears what happens to the connection while other calls wait; by default
    the logger "armtempo" does. Until the board is closed other programs on this machine can look in and stop it
    (``attach``). A port in use is tried again for a few seconds: many programs only ask something.

    Raises InputError if there is no such port, or none is named and not exactly one board is there;
    PortInUseError if another program keeps it, LinkError if it is silent or runs something else.
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
    """``connect`` to the port that is named, without waiting; PortInUseError if another program has it."""
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
        tell(f"no other program can look in or stop this one: {error}")
    return board


class _Taps:
    """Takes the traffic for several sinks."""

    def __init__(self, *sinks: Sink | None) -> None:
        self.sinks = [sink for sink in sinks if sink is not None]

    def __call__(self, chunk: Chunk, words: list[str]) -> None:
        """Hand a chunk on."""
        for sink in self.sinks:
            sink(chunk, words)
