"""``armtempo import``: a job file from a table of via points."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, options


@click.command("import")
@click.argument("table", type=click.Path(dir_okay=False, path_type=Path))
@options.arm
@click.option("--name", help="Name of the job; without it the table's file name.")
@click.option("--radians", is_flag=True, help="The angles are in radians.")
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Job file to write; without it the job's name with .toml. An existing file of other content is kept.",
)
@options.force("an existing FILE of other content")
def command(
    table: Path, arm_path: Path | None, name: str | None, radians: bool, output: Path | None, force: bool
) -> None:
    """Make a job file from the CSV file TABLE: a line a via point, a column a driven joint."""
    from armtempo.formats import toml_table
    from armtempo.formats.atomic_file import check_not_input, check_replaceable, replace_text
    from armtempo.model import exchange, job_file

    arm = chosen.load_arm(arm_path)
    title = name or table.stem
    target = output or Path(f"{title}.toml")
    check_not_input(target, (table, arm.source))
    text = exchange.job_text(title, exchange.via_from_csv(table, arm, radians))
    job_file.of_table(toml_table.parse(text, str(table)), arm)
    check_replaceable(target, text, force)
    replace_text(target, text)
    click.echo(f"written: {target}; plan it with: armtempo plan --job {target}")
