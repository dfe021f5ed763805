"""``armtempo input``: read the arm's inputs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from armtempo.cli import chosen, options, results

if TYPE_CHECKING:
    from armtempo.model.outputs import Input


@click.command()
@click.argument("name", required=False)
@options.arm_of_board
@options.port
@options.log_traffic
@options.as_json
def command(
    name: str | None, arm_path: Path | None, port: str | None, log_traffic: Path | None, as_json: bool
) -> None:
    """Read the inputs of the arm.

    NAME: an [input.NAME] of the arm file; without it all of them. Also while a motion runs, and while another armtempo
    program has the port.
    """
    from armtempo.cli import wired

    with wired.board(port, arm_path, log_traffic) as board:
        if name is not None:
            board.arm.input(name)
        levels = board.levels()
        found = [
            (entry, levels.active(number))
            for number, entry in enumerate(board.arm.inputs)
            if name in (None, entry.name)
        ]
    if as_json:
        values = [_values(*entry) for entry in found]
        results.show_json(values if name is None else values[0])
        return
    if not found:
        chosen.tell(f"arm {chosen.words(board.arm)} has no inputs: write [input.NAME] tables in its file")
    for line in _lines(found):
        click.echo(line)


def _values(entry: Input, active: bool) -> dict[str, Any]:
    return {"name": entry.name, "pin": entry.pin, "active": active}


def _lines(found: list[tuple[Input, bool]]) -> list[str]:
    return [
        f"{entry.name:<12} {entry.pin:<4} {'active' if active else 'inactive'}" for entry, active in found
    ]
