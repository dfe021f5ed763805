"""``armtempo plan``: from a job to a trajectory file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from armtempo import pipeline
from armtempo.basics.atomic_file import check_not_input, check_replaceable, replace_text
from armtempo.basics.errors import InputError, MissingPackageError
from armtempo.cli import chosen, options, results, sequences
from armtempo.cli.results import ProgressBar
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.sequence import is_sequence
from armtempo.planning import checks, torque
from armtempo.planning.free.corridor_curve import unit_of
from armtempo.report import drawing, plots, text_summary
from armtempo.robot import engine_room


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
    help="Overrides the job's path: the spline through the via points, or free between them.",
)
@click.option(
    "--corridor-deg",
    type=click.FloatRange(0),
    metavar="DEG",
    help="Largest distance of a joint from the spline.",
)
@click.option(
    "--corridor-mm",
    type=click.FloatRange(0),
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
@click.option("--holds", metavar="NAME", help="Overrides the job's load: a load of the arm file.")
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
@click.option(
    "--corridor-curve", is_flag=True, help="Write the motion time in ever wider corridors instead of a plan."
)
@options.as_json
def plan(
    file: Path | None,
    job_path: Path | None,
    arm_path: Path | None,
    output: Path | None,
    force: bool,
    split: bool,
    corridor_curve: bool,
    use_torque: bool,
    as_json: bool,
    **changes: Any,
) -> None:
    """Plan a job and write its trajectory file, or plan a sequence.

    FILE: a sequence file, or a job file, as with --job.
    If neither an arm nor a job is set, it plans the demo's job for the paper's arm.
    """
    if file is not None and job_path is not None:
        raise InputError("FILE and --job are both given", "give one of them")
    if file is not None and is_sequence(file):
        flags = {"split": split, "corridor_curve": corridor_curve, "use_torque": use_torque}
        sequences.refuse_job_options({**flags, **changes})
        sequences.plan(file, arm_path, output, force, as_json)
        return
    job_path = file or job_path
    arm, job = chosen.arm_and_job(arm_path, job_path)
    job = _changed(job, changes)
    if use_torque and (split or corridor_curve):
        raise InputError(
            "--use-torque cannot be combined with --split or --corridor-curve",
            "lower acceleration_deg_s2 in the arm file instead",
        )
    target = output or Path(f"{job.name}.json")
    check_not_input(target, (job.source, arm.source))
    if corridor_curve:
        _write_curve(arm, job, target, force, as_json)
        return
    plans = _plans(arm, job, split, use_torque)
    parts = [target] if len(plans) == 1 else [_part(target, number) for number in range(1, len(plans) + 1)]
    made = dict(zip(parts, plans, strict=True))
    _save(made, force)
    values = {"plans": [_json(file, plan) for file, plan in made.items()]}
    results.show(as_json, values, [line for file, plan in made.items() for line in _lines(file, plan)])


def _changed(job: Job, changes: dict[str, Any]) -> Job:
    """The job with the options' values."""
    given = {name: value for name, value in changes.items() if value is not None}
    if "degree" in given:
        given["degree"] = int(given["degree"])
    return replace(job, **given)


def _plans(arm: Arm, job: Job, split: bool, use_torque: bool) -> list[Plan]:
    """The plan of the job, or the plans of its parts; checked to fit the board."""
    with ProgressBar("planning") as progress:
        if use_torque:
            plans = [torque.plan_by_torque(arm, job, progress)]
        else:
            plans = pipeline.split(arm, job, progress) if split else [pipeline.plan(arm, job, progress)]
    for plan in plans:
        checks.check_held(plan.trajectory, arm)
    return plans


def _part(target: Path, number: int) -> Path:
    """The file of one part of a motion that is split."""
    return target.with_stem(f"{target.stem}-{number}")


def _save(made: dict[Path, Plan], force: bool) -> None:
    """Write all files, or none if one of them may not be replaced."""

    for file, plan in made.items():
        plan.check_replaceable(file, force)
    for file, plan in made.items():
        plan.save(file, force)


def _lines(file: Path, plan: Plan) -> list[str]:
    rates = checks.rate_words(checks.step_rates(plan.arm, plan.extremes))
    room = engine_room.of_arm(plan.arm)
    return [f"arm: {chosen.describe_arm(plan.arm)}", *pipeline.summary(plan), rates, room, f"written: {file}"]


def _json(file: Path, plan: Plan) -> dict[str, Any]:
    return {"file": str(file), **text_summary.values(plan)}


def _write_curve(arm: Arm, job: Job, target: Path, force: bool, as_json: bool) -> None:
    """Write the table to the terminal and as CSV, and the figure if matplotlib is installed."""
    table, picture = (target.with_name(f"{target.stem}-corridor{suffix}") for suffix in (".csv", ".png"))
    for file in (table, picture):
        check_replaceable(file, "", force)  # checked before the work, which takes a while
    with ProgressBar("planning") as progress:
        points = pipeline.corridor_curve(arm, job, progress)
    unit = unit_of(job)
    replace_text(table, plots.corridor_csv(points, unit))
    written = [str(table)]
    try:
        drawing.save(plots.corridors(points, unit, job.name), picture)
        written.append(str(picture))
    except MissingPackageError as error:
        results.show_error(error, "no plot")
    curve = [{f"corridor_{unit}": point.corridor, "duration_s": point.total_s} for point in points]
    lines = [*plots.corridor_lines(points, unit), f"written: {', '.join(written)}"]
    results.show(as_json, {"files": written, "curve": curve}, lines)
