"""``armtempo upload``: store a planned motion on the board."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import options
from armtempo.cli.progress import Progress


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
    from armtempo import pipeline
    from armtempo.robot import operate

    arm = options.load_arm(arm_path) if arm_path else None
    motion = pipeline.from_file(file, arm, name)
    with options.board(port, log_traffic) as board, Progress("uploading") as progress:
        operate.configure(board, motion.arm, replace=True)
        operate.store(board, motion.name, motion.data, progress)
        if as_default:
            board.set_default(motion.name)
    click.echo(f"{motion.name}: {len(motion.data)} bytes stored")
