"""``armtempo configure``: set a board up for an arm."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, options


@click.command()
@options.arm
@options.port
@options.log_traffic
def command(arm_path: Path | None, port: str | None, log_traffic: Path | None) -> None:
    """Set the board up for an arm, also in the place of another one.

    The position is unknown afterwards, unless only limits differ: ranges, speeds, following errors, the link
    time-out. Motions that were stored for other figures of the arm are refused; upload them again.
    """
    from armtempo.robot import engine_room

    arm = chosen.load_arm(arm_path)
    with chosen.board(port, log_traffic, arm) as board:
        before = board.info.arm_crc
        board.configure(arm, replace=True)
        found = board.state()
        motions = len(board.list())
        room = engine_room.of_arm(arm, board.info)
    if found.arm_crc == before:
        click.echo(f"the board is set up for {chosen.words(arm)} already; nothing is changed")
        return
    click.echo(f"the board is set up for {chosen.words(arm)}")
    click.echo(room)
    if before and motions:
        click.echo(
            f"{motions} stored motions were made for the arm as it was; upload those that are still wanted"
        )
    if all(joint.known for joint in found.joints):
        click.echo("only limits differ from what the board had: it still knows where the arm stands")
    else:
        click.echo("the position is unknown: bring the arm to its home posture, then 'armtempo home'")
