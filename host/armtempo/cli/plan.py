"""``armtempo plan``: from a job to a trajectory file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from armtempo.cli import chosen, options
from armtempo.cli.progress import ProgressBar


@click.command()
@options.job
@options.arm
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Trajectory file to write; without it the job's name with .json. An existing FILE is only replaced where "
    "it is an earlier plan of the same job for the same arm, by their names.",
)
@options.force("any other FILE too")
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
def command(
    job_path: Path | None, arm_path: Path | None, output: Path | None, force: bool, **changes: Any
) -> None:
    """Plan a job and write its trajectory file.

    Where neither an arm nor a job is named, this plans the demo's job for the arm that ships with armtempo.
    """
    from dataclasses import replace

    from armtempo import pipeline
    from armtempo.errors import PlanError
    from armtempo.formats.atomic_file import check_not_input
    from armtempo.planning import checks

    arm, job = chosen.arm_and_job(arm_path, job_path)
    given = {name: value for name, value in changes.items() if value is not None}
    if "degree" in given:
        given["degree"] = int(given["degree"])
    job = replace(job, **given)
    target = output or Path(f"{job.name}.json")
    check_not_input(target, (job.source, arm.source))
    with ProgressBar("planning") as progress:
        plan = pipeline.plan(arm, job, progress)
    plan.save(target, force)
    click.echo(f"arm: {chosen.words(arm)}")
    for line in pipeline.summary(plan):
        click.echo(line)
    click.echo(f"written: {target}")
    try:
        checks.check_held(plan.trajectory, arm)
    except PlanError as error:
        click.echo(f"not for a board as it is: {error}", err=True)
