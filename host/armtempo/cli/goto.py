"""``armtempo goto``: move straight to a posture."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import options, posture
from armtempo.cli.progress import ProgressBar


@click.command(context_settings={"ignore_unknown_options": True})  # so that -10,20,30 is a posture
@click.argument("where")
@options.job
@options.arm
@options.port
@options.log_traffic
def command(
    where: str, job_path: Path | None, arm_path: Path | None, port: str, log_traffic: Path | None
) -> None:
    """Move straight to a posture.

    WHERE: angles such as '0,-60,40', a via point such as P0, or a trajectory file for its start. All
    joints move together, within their limits. The arm must be homed. Ctrl-C brakes.
    """
    from armtempo.robot.stop_request import Stopped

    arm = options.load_arm(arm_path)
    target_deg = posture.parse(where, arm, job_path)
    with options.board(port, log_traffic, arm) as board:
        board.configure(arm, replace=arm_path is not None)
        try:
            with ProgressBar("moving") as progress:
                board.goto(target_deg, progress)
        except Stopped:
            click.echo(posture.where_it_is(board))
            raise
        click.echo(posture.where_it_is(board))
