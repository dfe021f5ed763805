"""``armtempo import``: a job file from a table of via points."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import chosen, options, results

if TYPE_CHECKING:
    from armtempo.model.via_table import ImportedPath


@click.command("import")
@click.argument("table", type=click.Path(dir_okay=False, path_type=Path))
@options.arm
@click.option("--name", help="Name of the job; without it the table's file name.")
@click.option("--radians", is_flag=True, help="The angles are in radians.")
@click.option(
    "--tolerance-deg",
    type=float,
    metavar="DEG",
    help="Leave out lines that the path keeps to within DEG without them. A table with a column time_s is a sampled "
    "motion, for which this is 0.1 unless given.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Job file to write; without it the job's name with .toml. An existing file of other content is kept.",
)
@options.force("an existing FILE of other content")
@options.as_json
def command(
    table: Path,
    arm_path: Path | None,
    name: str | None,
    radians: bool,
    tolerance_deg: float | None,
    output: Path | None,
    force: bool,
    as_json: bool,
) -> None:
    """Make a job file from the CSV file TABLE: a line a via point, a column a driven joint.

    Columns are separated by commas, semicolons or tabs. What 'armtempo export' wrote comes back as a job of few via
    points along the same path.
    """
    from armtempo.formats import toml_table
    from armtempo.formats.atomic_file import check_not_input, check_replaceable, replace_text
    from armtempo.model import via_table
    from armtempo.model.job import Job

    arm = chosen.load_arm(arm_path)
    title = name or table.stem
    target = output or Path(f"{title}.toml")
    check_not_input(target, (table, arm.source))
    found = via_table.via_from_csv(table, arm, radians, tolerance_deg)
    text = via_table.job_text(title, found)
    Job.of_table(toml_table.parse(text, str(table)), arm)
    check_replaceable(target, text, force)
    replace_text(target, text)
    values = {
        "file": str(target),
        "lines": found.lines,
        "via_points": len(found.via_deg),
        "thinned_to_deg": found.thinned_to_deg,
    }
    results.show(as_json, values, _lines(target, found))


def _lines(target: Path, found: ImportedPath) -> list[str]:
    written = f"written: {target}; plan it with: armtempo plan --job {target}"
    if found.thinned_to_deg is None:
        return [written]
    thinned = (
        f"{found.lines} lines thinned to {len(found.via_deg)} via points: a spline through them keeps to the table "
        f"within {found.thinned_to_deg:g} deg; the times are planned anew"
    )
    return [thinned, written]
