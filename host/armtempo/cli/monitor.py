"""``armtempo monitor``: the traffic in words."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import chosen, options

if TYPE_CHECKING:
    from armtempo.link.traffic import Chunk

_EVERY_S = 1.0


@click.command()
@click.argument("file", required=False, type=click.Path(path_type=Path))
@options.port
@options.log_traffic
def command(file: Path | None, port: str | None, log_traffic: Path | None) -> None:
    """Show decoded traffic.

    With FILE, what '--log-traffic FILE' recorded; without, what another armtempo program that has the port says
    and hears, else the board is asked once a second. Ctrl-C ends it; a motion under way goes on.
    """
    if file is not None:
        _show_file(file)
        return
    from armtempo.robot import shared_board

    name = chosen.port(port, others=True)
    shared = shared_board.find(name)
    if shared is not None:
        with shared:
            chosen.tell(f"port {name}: through {shared.program}")
            for message in shared.watch("traffic"):
                _print(message["time_s"], message["direction"], message["words"])
        chosen.tell(f"{shared.program} has given up {name}")
        return
    with chosen.board(name, log_traffic, any_program=True, sink=_show) as board:
        while True:
            board.status()
            board.client.session.poll(_EVERY_S)
            board.client.session.events.clear()


def _show_file(file: Path) -> None:
    from armtempo.link import traffic

    decoder = traffic.Decoder()
    for chunk in traffic.read_log(file):
        _show(chunk, decoder.feed(chunk.direction, chunk.data))


def _show(chunk: Chunk, words: list[str]) -> None:
    _print(chunk.time_s, chunk.direction, words)


def _print(time_s: float, direction: str, words: list[str]) -> None:
    for line in words:
        click.echo(f"{time_s:10.4f} {direction} {line}")
