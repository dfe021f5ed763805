"""``armtempo upload``: store a planned motion on the board."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import options
from armtempo.cli.progress import ProgressBar


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--name", metavar="NAME", help="Name on the board; without it the job's name.")
@click.option("--default", "as_default", is_flag=True, help="Let the board's button start it.")
@options.arm_of_file
@options.port
@options.log_traffic
def command(
    file: Path, name: str | None, as_default: bool, arm_path: Path | None, port: str, log_traffic: Path | None
) -> None:
    """Store a trajectory file on the board."""
    from armtempo.records import encoded_motion

    motion = encoded_motion.of_plan(options.load_plan_file(file, arm_path), name)
    with options.board(port, log_traffic) as board, ProgressBar("uploading") as progress:
        board.upload(motion, default=as_default, progress=progress)
    click.echo(f"{motion.name}: {len(motion.data)} bytes stored")
