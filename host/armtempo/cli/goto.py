"""``armtempo goto``: move straight to a posture."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.basics.errors import InputError
from armtempo.cli import chosen, options, posture
from armtempo.cli.progress import ProgressBar


@click.command(context_settings={"ignore_unknown_options": True})  # so that -10,20,30 is a posture
@click.argument("where", nargs=-1, required=True, shell_complete=options.files)
@options.job
@options.arm_of_board
@options.replace_arm
@options.altered
@options.port
@options.log_traffic
@options.as_json
def command(
    where: tuple[str, ...],
    job_path: Path | None,
    arm_path: Path | None,
    replace_arm: bool,
    altered: bool,
    port: str | None,
    log_traffic: Path | None,
    as_json: bool,
) -> None:
    """Move straight to a posture.

    WHERE: 'home' or another posture of the arm file, angles such as '0,-60,40', a via point of the job such as P0,
    or a trajectory file or a planned sequence for its start. All joints move together, within their limits. The arm
    must be homed. Ctrl-C brakes, and so does 'armtempo stop' in another terminal.
    """
    from armtempo.robot.stop_request import Stopped

    if len(where) > 1:
        raise InputError(
            f"{len(where)} values for one posture",
            f"write them as one, with commas: armtempo goto {','.join(where)}",
        )
    wanted = posture.NamedPosture.of(where[0], arm_path, altered)
    with chosen.board(port, log_traffic, wanted.arm) as board:
        arm = chosen.arm_of_board(board, wanted.arm)
        target_deg = wanted.angles_deg(arm, job_path)
        board.configure(arm, replace=replace_arm)
        try:
            with ProgressBar("moving") as progress:
                board.goto(target_deg, progress)
        except Stopped:
            posture.say_where_it_is(board, as_json)
            raise
        posture.say_where_it_is(board, as_json)
