"""``armtempo monitor``: the traffic in words."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import chosen, options, results

if TYPE_CHECKING:
    from armtempo.link.traffic import Chunk

_EVERY_S = 1.0
Say = Callable[[float, str, list[str]], None]


@click.command()
@click.argument("file", required=False, type=click.Path(path_type=Path))
@options.port
@options.log_traffic
@options.as_json
def command(file: Path | None, port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """Show decoded traffic.

    FILE: what '--log-traffic FILE' recorded; without it, what another armtempo program that has the port says
    and hears, else the board is asked once a second. Ctrl-C ends it; a motion under way goes on.
    With --json each line is a document.
    """
    say = _print_json if as_json else _print
    if file is not None:
        _show_file(file, say)
        return
    from armtempo.robot.shared_board import SharedBoard

    name = chosen.port(port, others=True)
    with chosen.shared_or_own(name, log_traffic, any_program=True, sink=partial(_show, say)) as board:
        if isinstance(board, SharedBoard):
            for message in board.watch("traffic"):
                say(message["time_s"], message["direction"], message["words"])
            chosen.tell(f"{board.program} has given up {name}")
            return
        while True:
            board.status()
            board.client.session.poll(_EVERY_S)
            board.client.session.events.clear()


def _show_file(file: Path, say: Say) -> None:
    from armtempo.link import traffic

    decoder = traffic.Decoder()
    for chunk in traffic.read_log(file):
        _show(say, chunk, decoder.feed(chunk.direction, chunk.data))


def _show(say: Say, chunk: Chunk, words: list[str]) -> None:
    say(chunk.time_s, chunk.direction, words)


def _print(time_s: float, direction: str, words: list[str]) -> None:
    for line in words:
        click.echo(f"{time_s:10.4f} {direction} {line}")


def _print_json(time_s: float, direction: str, words: list[str]) -> None:
    results.show_json({"time_s": time_s, "direction": direction, "words": words})
