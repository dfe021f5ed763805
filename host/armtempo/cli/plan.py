"""``armtempo plan``: from a job to a trajectory file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from armtempo.cli import messages, options
from armtempo.cli.progress import ProgressBar


@click.command()
@options.job
@options.arm
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Trajectory file to write; without it the job's name with .json.",
)
@click.option("--timing", type=click.Choice(["per-joint", "shared"]), help="Instead of the job's timing.")
@click.option("--degree", type=click.Choice(["3", "5"]), help="Instead of the job's spline degree.")
@click.option(
    "--refine", type=click.IntRange(1, 64), help="Instead of the job's time segments per path segment."
)
@click.option(
    "--polish/--no-polish", default=None, help="Finish the search with a gradient solver, or do not."
)
@click.option("--optimiser", metavar="NAME", help="Instead of the job's search algorithm.")
@click.option("--population", type=click.IntRange(4), help="Instead of the job's population.")
@click.option("--iterations", type=click.IntRange(1), help="Instead of the job's iterations.")
@click.option("--seed", type=click.IntRange(0), help="Instead of the job's seed.")
def command(job_path: Path | None, arm_path: Path | None, output: Path | None, **changes: Any) -> None:
    """Plan a job and write its trajectory file."""
    from dataclasses import replace

    from armtempo import pipeline
    from armtempo.errors import PlanError
    from armtempo.planning import checks

    arm = options.load_arm(arm_path)
    job = options.load_job(job_path, arm)
    given = {name: value for name, value in changes.items() if value is not None}
    if "degree" in given:
        given["degree"] = int(given["degree"])
    job = replace(job, **given)
    with ProgressBar("planning") as progress:
        plan = pipeline.plan(arm, job, progress)
    target = output or Path(f"{job.name}.json")
    plan.save(target)
    for line in pipeline.summary(plan):
        click.echo(line)
    click.echo(f"written: {target}")
    try:
        checks.check_held(plan.trajectory, arm)
    except PlanError as error:
        messages.show(error, "not for a board as it is")
