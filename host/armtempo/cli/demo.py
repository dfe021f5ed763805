"""``armtempo demo``: the whole chain on the paper's feeding motion."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import options
from armtempo.cli.progress import Progress
from armtempo.cli.run import replay


@click.command()
@options.out
@options.port
@options.log_traffic
def command(out: Path, port: str, log_traffic: Path | None) -> None:
    """Plan, replay and report the paper's feeding motion.

    Without --port a virtual board replays it, faster than in real time.
    """
    from armtempo import pipeline
    from armtempo.errors import MissingPackageError
    from armtempo.model import arm as arms
    from armtempo.model import job as jobs
    from armtempo.planning import planner
    from armtempo.report import run_report, text_summary
    from armtempo.robot import operate

    arm = arms.load_arm(arms.default_path())
    with Progress("planning") as progress:
        plan = planner.plan(arm, jobs.load_job(jobs.default_path(), arm), progress)
    for line in text_summary.lines(plan):
        click.echo(line)
    motion = pipeline.planned(plan)
    with options.board(port, log_traffic, arm) as board:
        operate.configure(board, arm, replace=True)
        folder = replay(board, port, motion, 1, out)
    try:
        click.echo(f"report: {run_report.write(folder)}")
    except MissingPackageError as error:
        click.echo(f"no report: {error}, then: armtempo report {folder}", err=True)
