"""``armtempo plan``: its options; ``plan_job`` does it, imported only then, as it takes long to import."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from armtempo.basics.errors import InputError
from armtempo.cli import options


def _refine(ctx: click.Context, param: click.Parameter, value: str | None) -> int | str | None:
    """A number of segments, or ``auto``."""
    if value is None or value == "auto":
        return value
    if not value.isdecimal() or not 1 <= int(value) <= 64:
        raise InputError(f"--refine: {value!r} is not allowed", "give auto or a whole number from 1 to 64")
    return int(value)


@click.command("plan")
@click.argument("file", type=options.PATH, required=False)
@options.job
@options.arm
@options.file(
    "-o",
    "--output",
    help="Trajectory file to write; default: the job's name with .json. An existing FILE is only replaced if it "
    "is an earlier plan of the same job for the same arm, by name.",
)
@options.force("any other FILE too")
@click.option(
    "--path",
    type=click.Choice(["through", "free"]),
    help="Overrides the job's path: free between the via points (default), or the spline through them.",
)
@click.option(
    "--corridor-deg",
    type=options.FiniteRange(0),
    metavar="DEG",
    help="Largest distance of a joint from the spline.",
)
@click.option(
    "--corridor-mm",
    type=options.FiniteRange(0),
    metavar="MM",
    help="Largest distance of the tool from the spline.",
)
@click.option("--timing", type=click.Choice(["per-joint", "shared"]), help="Overrides the job's timing.")
@click.option("--degree", type=click.Choice(["3", "5"]), help="Overrides the job's spline degree.")
@click.option(
    "--refine",
    callback=_refine,
    metavar="N|auto",
    help="Overrides the job's segments between via points: 1 to 64, or auto.",
)
@click.option(
    "--tool",
    metavar="NAME",
    callback=options.not_empty,
    help="Overrides the job's tool: a tool of the arm file.",
)
@click.option(
    "--holds",
    metavar="NAME",
    callback=options.not_empty,
    help="Overrides the job's load: a load of the arm file.",
)
@click.option(
    "--polish/--no-polish", default=None, help="Finish the search with a gradient solver; overrides the job."
)
@click.option("--optimiser", metavar="NAME", help="Overrides the job's search algorithm.")
@click.option("--population", type=click.IntRange(4), help="Overrides the job's population.")
@click.option("--iterations", type=click.IntRange(1), help="Overrides the job's iterations.")
@click.option("--starts", type=click.IntRange(1), help="Overrides the job's starts of the gradient solver.")
@click.option("--seed", type=click.IntRange(0), help="Overrides the job's seed.")
@click.option(
    "--use-torque", is_flag=True, help="Plan by the motors' torque instead of the acceleration limits."
)
@click.option("--split", is_flag=True, help="Cut a motion that is too long for the board at its stops.")
@click.option("-v", "--verbose", is_flag=True, help="Print the search, its bounds, and the board's part too.")
@options.as_json
def plan(
    file: Path | None,
    job_path: Path | None,
    arm_path: Path | None,
    output: Path | None,
    force: bool,
    split: bool,
    use_torque: bool,
    verbose: bool,
    as_json: bool,
    **changes: Any,
) -> None:
    """Plan a job or a sequence, and write its trajectory file.

    FILE: a sequence file, or a job file, as with --job.
    If neither an arm nor a job is set, it plans the demo's job for the paper's arm.
    """
    from armtempo.cli import plan_job

    if file is not None and job_path is not None:
        raise InputError("FILE and --job are both given", "give one of them")
    source = file or job_path
    order = plan_job.Order(
        source, file is not None, arm_path, output, force, split, use_torque, verbose, as_json
    )
    plan_job.run(order, changes)
