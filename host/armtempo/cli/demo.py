"""``armtempo demo``: the whole chain on the paper's feeding motion."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, messages, options
from armtempo.cli.progress import ProgressBar
from armtempo.cli.run import run_and_tell
from armtempo.ports.names import SIM


@click.command()
@options.out
@click.option(
    "--port",
    default=SIM,
    show_default=True,
    metavar="PORT",
    help="Where to replay it: a virtual board, unless this option names another port.",
)
@options.log_traffic
def command(out: Path | None, port: str, log_traffic: Path | None) -> None:
    """Plan, replay and report the paper's feeding motion.

    Without --port a virtual board replays it, faster than in real time, whatever is plugged in.
    """
    from armtempo import pipeline
    from armtempo.errors import ArmtempoError, MissingPackageError
    from armtempo.model.arm import Arm
    from armtempo.model.job import Job

    with ProgressBar("planning") as progress:
        plan = pipeline.plan(Arm.paper(), Job.paper(), progress)
    click.echo(f"arm: {chosen.words(plan.arm)}")
    for line in pipeline.summary(plan):
        click.echo(line)
    with chosen.board(port, log_traffic, plan.arm) as board:
        run = run_and_tell(board, plan, 1, chosen.runs(out))
    try:
        click.echo(f"report: {pipeline.report(run)}")
    except MissingPackageError as error:
        messages.show(
            ArmtempoError(error.problem, f"{error.hint}, then: armtempo report {run.path}"), "no report"
        )
