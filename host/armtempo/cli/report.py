"""``armtempo report``: one page and its figures from a recorded run."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from armtempo import pipeline
from armtempo.basics.atomic_file import check_replaceable
from armtempo.basics.errors import InputError, RunFolderError
from armtempo.cli import options, results
from armtempo.report import evaluation, verdict
from armtempo.report.run import Run


@click.command("report")
@click.argument(
    "runs", nargs=-1, required=True, type=click.Path(exists=True, file_okay=False, path_type=Path)
)
@click.option(
    "--out",
    type=options.FILE,
    help="Page to write when comparing; default: comparison.html next to the first run. An existing file is only "
    "replaced if it is such a page.",
)
@options.force("any other file too")
@options.as_json
def report(runs: tuple[Path, ...], out: Path | None, force: bool, as_json: bool) -> None:
    """Write report.html and its figures into a run folder, of a motion or a sequence.

    RUNS: run folders. With two or more, one more page compares them, and names those that cannot be read.
    """
    if len(runs) == 1:
        if out is not None:
            raise InputError(
                "--out needs two or more runs",
                "leave it out: the page of one run is report.html in its folder",
            )
        page = pipeline.report(Run.load(runs[0]))
        values = {"runs": [_values(runs[0], page)], "comparison": None} if as_json else None
        results.show(as_json, values, [f"wrote {page}"])
        return
    if out is not None:
        check_replaceable(out, "", force or _is_comparison(out), "a page that compares runs is replaced")
    pages: dict[Path, Path] = {}
    for run in runs:
        try:
            pages[run] = pipeline.report(Run.load(run))
        except RunFolderError as error:
            results.show_error(error)
    compared = pipeline.compare(runs, out)
    found = [_values(run, page) for run, page in pages.items()] if as_json else []
    results.show(
        as_json,
        {"runs": found, "comparison": str(compared)},
        [f"wrote {page}" for page in (*pages.values(), compared)],
    )


def _values(run: Path, page: Path) -> dict[str, Any]:
    """The verdict (``good``, ``bad`` or ``open``) and the findings of a page."""
    result = verdict.of(evaluation.evaluate(run))
    findings = [asdict(finding) for finding in result.findings]
    return {"folder": str(run), "page": str(page), "verdict": result.state, "findings": findings}


def _is_comparison(page: Path) -> bool:
    """Whether a file is a comparison page written by this command."""
    try:
        return "<title>Runs compared" in page.read_text(encoding="utf-8", errors="replace")[:4000]
    except OSError:
        return False
