"""``armtempo report``: one page and its figures from a recorded run."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from armtempo import pipeline
from armtempo.basics.atomic_file import check_replaceable
from armtempo.basics.errors import InputError, RunFolderError
from armtempo.cli import options, resolve, results
from armtempo.report import run_reader, run_report, verdict
from armtempo.report.evaluation import Evaluation, evaluate


@click.command("report")
@click.argument("runs", nargs=-1, type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--out",
    type=options.FILE,
    help="Page to write when comparing; default: comparison.html next to the first run. An existing file is only "
    "replaced if it is such a page.",
)
@options.force("any other file too")
@options.as_json
def report(runs: tuple[Path, ...], out: Path | None, force: bool, as_json: bool) -> None:
    """Write report.html and its figures into a run folder.

    RUNS: run folders; default: the newest one. With two or more, one more page compares them, and names those that
    cannot be read.
    """
    runs = runs or _newest()
    if len(runs) == 1 and out is not None:
        raise InputError(
            "--out needs two or more runs", "leave it out: the page of one run is report.html in its folder"
        )
    if out is not None:
        check_replaceable(out, "", force or _is_comparison(out), "a page that compares runs is replaced")
    pages, found = [], []
    for folder in runs:
        try:
            run = evaluate(folder)
            pages.append(run_report.write_page(run))
            found.append(_values(run, folder, pages[-1]))
        except RunFolderError as error:
            if len(runs) == 1:
                raise
            results.show_error(error)
    compared = pipeline.compare(runs, out) if len(runs) > 1 else None
    values = {"runs": found, "comparison": str(compared) if compared else None}
    results.show(as_json, values, [f"wrote {page}" for page in (*pages, compared) if page])


def _newest() -> tuple[Path]:
    """The run that was written last. Raises InputError if there is none."""
    place = resolve.runs(None)
    found = run_reader.folders(place)
    if not found:
        raise InputError(f"no run in {place}", "give a run folder, or record one: 'armtempo run'")
    return (found[0],)


def _values(run: Evaluation, folder: Path, page: Path) -> dict[str, Any]:
    """The verdict (``good``, ``bad`` or ``open``) and the findings of a page."""
    result = verdict.of(run)
    findings = [asdict(finding) for finding in result.findings]
    return {"folder": str(folder), "page": str(page), "verdict": result.state, "findings": findings}


def _is_comparison(page: Path) -> bool:
    """Whether a file is a comparison page written by this command."""
    try:
        return "<title>Runs compared" in page.read_text(encoding="utf-8", errors="replace")[:4000]
    except OSError:
        return False
