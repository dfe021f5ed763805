"""``armtempo report``: one page and its figures from a recorded run."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import messages, options


@click.command()
@click.argument(
    "runs", nargs=-1, required=True, type=click.Path(exists=True, file_okay=False, path_type=Path)
)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Page to write when comparing; default: comparison.html beside the first run. An existing file is only "
    "replaced where it is such a page.",
)
@options.force("any other file too")
def command(runs: tuple[Path, ...], out: Path | None, force: bool) -> None:
    """Write report.html and its figures into the run folder RUNS, of a motion or a sequence.

    With two or more run folders, each gets its page, and one more page compares them. One that cannot be read
    is named there.
    """
    from armtempo import pipeline
    from armtempo.errors import InputError, RunFolderError
    from armtempo.formats.atomic_file import check_replaceable
    from armtempo.robot.run import Run
    from armtempo.runs.sequence_reader import SequenceRun, is_sequence_run

    if len(runs) == 1:
        if out is not None:
            raise InputError(
                "--out goes with two or more runs",
                "leave it out: the page of one run is report.html in its folder",
            )
        sequence = is_sequence_run(runs[0])
        click.echo(f"wrote {pipeline.report(SequenceRun.load(runs[0]) if sequence else Run.load(runs[0]))}")
        return
    if out is not None:
        check_replaceable(out, "", force or _is_comparison(out), "a page that compares runs is replaced")
    for run in runs:
        try:
            click.echo(f"wrote {pipeline.report(Run.load(run))}")
        except RunFolderError as error:
            messages.show(error)
    click.echo(f"wrote {pipeline.compare(runs, out)}")


def _is_comparison(page: Path) -> bool:
    """Whether a file is a page that this command wrote."""
    try:
        return "<title>Runs compared" in page.read_text(encoding="utf-8", errors="replace")[:4000]
    except OSError:
        return False
