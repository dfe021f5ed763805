"""``armtempo bench``: Table 4 and Fig. 6 of the paper, repeated."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from armtempo.basics.errors import INTERRUPTED, InputError, MissingPackageError
from armtempo.cli import chosen, messages, options, results
from armtempo.cli.progress import ProgressBar

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from armtempo.research.bench.cases import Case, Problem
    from armtempo.research.bench.result_store import ResultStore
    from armtempo.research.bench.result_table import Row


def _names(ctx: click.Context, parameter: click.Parameter, value: str) -> list[str]:
    """Algorithms, separated by commas."""
    from armtempo.model.job import OPTIMISERS

    names = [name.strip().lower() for name in value.split(",")]
    for name in names:
        if name not in OPTIMISERS:
            raise InputError(
                f"--algorithms: {name!r} is not known",
                f"give some of {', '.join(sorted(OPTIMISERS))}, separated by commas",
            )
    return names


def _sizes(ctx: click.Context, parameter: click.Parameter, value: str) -> list[int]:
    """Populations, separated by commas."""
    from armtempo.model.job import POPULATION

    try:
        sizes = [int(size) for size in value.split(",")]
    except ValueError:
        raise InputError(
            f"--populations: {value!r} is not a list of whole numbers",
            "write whole numbers separated by commas, such as 20,50",
        ) from None
    least, most = POPULATION
    if min(sizes) < least or max(sizes) > most:
        raise InputError(
            f"--populations: {value} goes beyond what a search takes",
            f"give populations from {least} to {most}",
        )
    return sizes


@click.command()
@options.job
@options.arm
@click.option("--joint", type=click.IntRange(1), default=1, show_default=True, help="Driven joint to time.")
@click.option(
    "--algorithms", default="ga,iaga,pso,hpso,cs,acs", show_default=True, metavar="LIST", callback=_names
)
@click.option("--populations", default="10,50,100,500", show_default=True, metavar="LIST", callback=_sizes)
@click.option(
    "--seeds", type=click.IntRange(1), default=10, show_default=True, help="Runs of each, seeds 1 to N."
)
@click.option("--iterations", type=click.IntRange(1), default=500, show_default=True)
@click.option(
    "--fitness",
    type=click.Choice(["stretched", "penalised"]),
    default="stretched",
    show_default=True,
    help="'stretched' as the planner uses it, 'penalised' as in Eq. (21).",
)
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("bench"),
    show_default=True,
    metavar="FOLDER",
    help="Where the results go; runs that are there already are not repeated.",
)
@click.option("--workers", type=click.IntRange(1), help="Processes; without it one for each core.")
@click.option("--scheduler", metavar="ADDRESS", help="Use the workers of this Dask scheduler instead.")
@click.option("--plot/--no-plot", default=True, help="Draw convergence.png (needs matplotlib), or do not.")
@options.as_json
@click.pass_context
def command(
    ctx: click.Context, /, out: Path, workers: int | None, scheduler: str | None, plot: bool, **given: Any
) -> None:
    """Compare the search algorithms as the paper does in Table 4 and Fig. 6."""
    from armtempo.model.arm import Arm
    from armtempo.model.job import Job
    from armtempo.research.bench import cases, result_table, worker_pool
    from armtempo.research.bench.result_store import ResultStore

    arm, job = chosen.arm_and_job(given["arm_path"], given["job_path"])
    problem = cases.problem_of(arm, job, given["joint"], given["fitness"], given["iterations"])
    wanted = cases.cases(given["algorithms"], given["populations"], range(1, given["seeds"] + 1))
    store = ResultStore(out, problem)
    place = worker_pool.cluster(scheduler) if scheduler else worker_pool.local(workers)
    try:
        _run(problem, wanted, store, place)
    except KeyboardInterrupt:
        kept = ResultStore(out, problem).runs
        done = sum(case in kept for case in wanted)
        click.echo(
            f"armtempo: interrupted; {done} of {len(wanted)} runs are kept in {store.path}, "
            "and the same command goes on from there",
            err=True,
        )
        ctx.exit(INTERRUPTED)
    with_paper = given["joint"] == 1 and (arm.source, job.source) == (Arm.paper().source, Job.paper().source)
    found = result_table.rows((store.runs[case] for case in wanted), problem.iterations)
    written = _write(out, found, with_paper, plot)
    values = {"folder": str(out), "files": written, "rows": [_values(row) for row in found]}
    lines = [*result_table.text(found, with_paper), f"written to {out}: {', '.join(written)}"]
    results.show(given["as_json"], values, lines)


def _values(row: Row) -> dict[str, Any]:
    """Motion times of the searches' best solutions, and what they cost."""
    return {
        "algorithm": row.algorithm,
        "population": row.population,
        "seeds": row.seeds,
        "best_s": float(row.best_s),
        "median_s": float(row.median_s),
        "worst_s": float(row.worst_s),
        "evaluations": row.evaluations,
        "computing_s": float(row.seconds),
    }


def _run(
    problem: Problem, wanted: Sequence[Case], store: ResultStore, place: AbstractContextManager[Executor]
) -> None:
    """The runs that are still missing."""
    from armtempo.research.bench import cases

    todo = [case for case in wanted if case not in store.runs]
    if not todo:
        return
    with ProgressBar("searching") as progress, place as executor:
        for number, run in enumerate(cases.execute(problem, todo, executor), 1):
            store.add(run)
            progress(number, len(todo))


def _write(out: Path, found: Sequence[Row], with_paper: bool, plot: bool) -> list[str]:
    """Table and curves to files; gives their names."""
    from armtempo.formats.atomic_file import replace_text
    from armtempo.research.bench import result_table

    replace_text(out / "table.csv", result_table.table_csv(found, with_paper))
    replace_text(out / "convergence.csv", result_table.curves_csv(found))
    written = ["table.csv", "convergence.csv"]
    if plot:
        written += _plot(out / "convergence.png", found)
    return written


def _plot(path: Path, found: Sequence[Row]) -> list[str]:
    """Draws the curves; without matplotlib it says so, and the tables stand."""
    from armtempo.report import drawing
    from armtempo.research.bench import result_plot

    try:
        drawing.save(result_plot.convergence(found), path)
    except MissingPackageError as error:
        messages.show(error, "no plot")
        return []
    return [path.name]
