"""``armtempo upload``: store a planned motion on the board."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, options
from armtempo.cli.progress import ProgressBar


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--name", metavar="NAME", help="Name on the board; without it the job's name.")
@click.option("--default", "as_default", is_flag=True, help="Let the board's button start it.")
@options.force("another motion that the board keeps under this name")
@options.arm_of_file
@options.replace_arm
@options.altered
@options.port
@options.log_traffic
def command(
    file: Path,
    name: str | None,
    as_default: bool,
    force: bool,
    arm_path: Path | None,
    replace_arm: bool,
    altered: bool,
    port: str | None,
    log_traffic: Path | None,
) -> None:
    """Store a trajectory file on the board."""
    from armtempo.records import encoded_motion

    motion = encoded_motion.of_plan(chosen.load_plan(file, arm_path, altered), name)
    with chosen.board(port, log_traffic, motion.arm) as board:
        board.configure(motion.arm, replace=replace_arm)
        with ProgressBar("uploading") as progress:
            board.upload(motion, default=as_default, progress=progress, replace=force)
        where = f" on {chosen.virtual_words(board.port)}" if board.info.virtual else ""
    click.echo(f"{motion.name}: {len(motion.data)} bytes stored{where}")
