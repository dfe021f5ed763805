"""Planning a job or a sequence for ``armtempo plan``: from files to a trajectory file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from armtempo import pipeline
from armtempo.basics.atomic_file import check_not_input
from armtempo.basics.errors import InputError
from armtempo.cli import resolve, results, sequences
from armtempo.cli.results import ProgressBar
from armtempo.encoding import engine_heap
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.sequence import is_sequence
from armtempo.planning import board_limits, torque
from armtempo.report import text_summary


class Order(NamedTuple):
    """What the command line asks for."""

    source: Path | None
    """A job or, if ``any_kind``, a sequence."""
    any_kind: bool
    arm: Path | None
    output: Path | None
    force: bool
    split: bool
    use_torque: bool
    verbose: bool
    as_json: bool


def run(order: Order, changes: dict[str, Any]) -> None:
    """Plan, write the trajectory file and print the outcome; ``changes``: the job's settings by option, or None."""
    if order.any_kind and order.source is not None and is_sequence(order.source):
        own = {"split": order.split, "use_torque": order.use_torque, "verbose": order.verbose}
        sequences.refuse_job_options({**own, **changes})
        sequences.plan(order.source, order.arm, order.output, order.force, order.as_json)
        return
    arm, job = resolve.arm_and_job(order.arm, order.source)
    job = _changed(job, changes)
    if order.use_torque and order.split:
        raise InputError(
            "--use-torque cannot be combined with --split",
            "lower acceleration_deg_s2 in the arm file instead",
        )
    target = order.output or Path(f"{job.name}.json")
    check_not_input(target, (job.source, arm.source))
    plans = _plans(arm, job, order.split, order.use_torque)
    parts = [target] if len(plans) == 1 else [_part(target, number) for number in range(1, len(plans) + 1)]
    made = dict(zip(parts, plans, strict=True))
    _save(made, order.force)
    values = {"plans": [_json(file, plan) for file, plan in made.items()]}
    lines = [line for file, plan in made.items() for line in _lines(file, plan, order.verbose)]
    results.show(order.as_json, values, lines)


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
        board_limits.check_held(plan.trajectory, arm)
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


def _lines(file: Path, plan: Plan, verbose: bool) -> list[str]:
    summary = [f"arm: {resolve.describe_arm(plan.arm)}", *pipeline.summary(plan, verbose)]
    return [*summary, *([engine_heap.of_arm(plan.arm)] if verbose else ()), f"written: {file}"]


def _json(file: Path, plan: Plan) -> dict[str, Any]:
    return {"file": str(file), **text_summary.values(plan)}
