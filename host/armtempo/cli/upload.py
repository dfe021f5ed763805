"""``armtempo upload``: store a planned motion on the board."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, options, results
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
@options.as_json
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
    as_json: bool,
) -> None:
    """Store a trajectory file, or a planned sequence with its motions, on the board.

    FILE: what 'armtempo plan' has written.
    """
    from armtempo.model.sequence_plan import is_sequence_plan
    from armtempo.records import encoded_motion

    if is_sequence_plan(file):
        plan = chosen.load_sequence_plan(file, arm_path, name)
        with chosen.board(port, log_traffic, plan.arm) as board:
            board.configure(plan.arm, replace=replace_arm)
            with ProgressBar("uploading") as progress:
                board.upload_sequence(plan, as_default, progress, force)
            virtual = board.info.virtual
        values = {"name": plan.name, "sequence": True, "motions": len(plan.legs), "virtual": virtual}
        results.show(as_json, values, [f"{plan.name}: sequence and {len(plan.legs)} motions stored"])
        return
    motion = encoded_motion.of_plan(chosen.load_plan(file, arm_path, altered), name)
    with chosen.board(port, log_traffic, motion.arm) as board:
        board.configure(motion.arm, replace=replace_arm)
        with ProgressBar("uploading") as progress:
            board.upload(motion, default=as_default, progress=progress, replace=force)
        virtual = board.info.virtual
        where = f" on {chosen.virtual_words(board.port)}" if virtual else ""
    values = {"name": motion.name, "sequence": False, "size_bytes": len(motion.data), "virtual": virtual}
    results.show(as_json, values, [f"{motion.name}: {len(motion.data)} bytes stored{where}"])
