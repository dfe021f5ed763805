"""``armtempo home``: declare where the arm stands."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import options, posture
from armtempo.errors import InputError


@click.command(context_settings={"ignore_unknown_options": True})  # so that -10,20,30 is a posture
@click.argument("where", required=False)
@click.option("--switches", is_flag=True, help="Move to the limit switches instead of taking WHERE on trust.")
@options.job
@options.arm
@options.port
@options.log_traffic
def command(
    where: str | None,
    switches: bool,
    job_path: Path | None,
    arm_path: Path | None,
    port: str,
    log_traffic: Path | None,
) -> None:
    """Declare where the arm stands.

    WHERE: angles such as '0,-60,40', a via point such as P0, or a trajectory file for its start. Without
    it: the home posture of the arm file. Nothing moves; afterwards motions may start. With --switches the
    joints that have a switch of known angle move: to it, off it, and slowly to it again.
    """
    if switches and where is not None:
        raise InputError(
            "WHERE and --switches exclude each other",
            "give WHERE where the arm stands, or --switches to drive to the limit switches",
        )
    arm = options.load_arm(arm_path)
    angles_deg = None if where is None else posture.parse(where, arm, job_path)
    with options.board(port, log_traffic, arm) as board:
        board.configure(arm, replace=arm_path is not None)
        if switches:
            board.home_to_switches(arm)
        else:
            board.home(arm, angles_deg)
        click.echo(posture.where_it_is(board))
