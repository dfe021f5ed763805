"""``armtempo demo``: the whole chain on the paper's feeding motion."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import messages, options
from armtempo.cli.progress import ProgressBar
from armtempo.cli.run import run_and_tell


@click.command()
@options.out
@options.port
@options.log_traffic
def command(out: Path, port: str, log_traffic: Path | None) -> None:
    """Plan, replay and report the paper's feeding motion.

    Without --port a virtual board replays it, faster than in real time.
    """
    from armtempo import pipeline
    from armtempo.errors import ArmtempoError, MissingPackageError
    from armtempo.model.arm import Arm
    from armtempo.model.job import Job

    with ProgressBar("planning") as progress:
        plan = pipeline.plan(Arm.paper(), Job.paper(), progress)
    for line in pipeline.summary(plan):
        click.echo(line)
    with options.board(port, log_traffic, plan.arm) as board:
        run = run_and_tell(board, plan, 1, out)
    try:
        click.echo(f"report: {pipeline.report(run)}")
    except MissingPackageError as error:
        messages.show(
            ArmtempoError(error.problem, f"{error.hint}, then: armtempo report {run.path}"), "no report"
        )
