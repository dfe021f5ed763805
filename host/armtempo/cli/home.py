"""``armtempo home``: declare where the arm stands."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.basics.errors import InputError
from armtempo.cli import chosen, options, posture


@click.command(context_settings={"ignore_unknown_options": True})  # so that -10,20,30 is a posture
@click.argument("where", default=posture.HOME, shell_complete=options.files)
@click.option("--switches", is_flag=True, help="Move to the limit switches instead of taking WHERE on trust.")
@options.job
@options.arm_of_board
@options.replace_arm
@options.altered
@options.port
@options.log_traffic
@options.as_json
def command(
    where: str,
    switches: bool,
    job_path: Path | None,
    arm_path: Path | None,
    replace_arm: bool,
    altered: bool,
    port: str | None,
    log_traffic: Path | None,
    as_json: bool,
) -> None:
    """Declare where the arm stands.

    WHERE: angles such as '0,-60,40', a posture of the arm file by its name, a via point of the job such as P0, or a
    trajectory file for its start. Without it: the home posture of the arm file. Nothing moves; afterwards motions may
    start. With --switches the joints that have a switch of known angle move: to it, off it, slowly to it again, and to
    their home angle; in the order of 'homing' in the arm file, else one after the other.
    """
    if switches and where != posture.HOME:
        raise InputError(
            "WHERE and --switches exclude each other",
            "give WHERE where the arm stands, or --switches to drive to the limit switches",
        )
    wanted = posture.NamedPosture.of(where, arm_path, altered)
    with chosen.board(port, log_traffic, wanted.arm) as board:
        arm = chosen.arm_of_board(board, wanted.arm)
        angles_deg = wanted.angles_deg(arm, job_path)
        board.configure(arm, replace=replace_arm)
        if switches:
            board.home_to_switches(arm)
        else:
            board.home(arm, angles_deg)
        posture.say_where_it_is(board, as_json)
