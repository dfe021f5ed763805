"""``armtempo status``: who is on the port and what it is doing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.basics.errors import InputError
from armtempo.cli import chosen, options, results, state

if TYPE_CHECKING:
    from armtempo.model.arm import Arm
    from armtempo.robot.board_state import BoardState


@click.command()
@options.arm_of_board
@options.port
@options.log_traffic
@options.as_json
def command(arm_path: Path | None, port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """Show the board, its state, and where the joints stand.

    Also while another armtempo program has the port.
    """
    name = chosen.port(port, others=True)
    found = _named(chosen.board_state(name, log_traffic), arm_path)
    if as_json:
        results.show_json(found.to_json())
        return
    for line in state.lines(found):
        click.echo(line)


def _named(found: BoardState, arm_path: Path | None) -> BoardState:
    """In degrees, where the arm that is named, or the one that ships, is what the board is set up for."""
    from armtempo.model.arm import Arm

    named: Arm | None = None
    try:
        named = chosen.named_arm(arm_path)
    except InputError as error:  # the board is worth looking at all the same
        chosen.tell(f"armtempo: {error}")
    if named is not None and found.arm_crc and not found.arm and not found.named(named).arm:
        chosen.tell(
            f"the board is set up for another arm than {chosen.words(named)}; see 'armtempo configure'"
        )
    return found.named(named).named(Arm.paper())
