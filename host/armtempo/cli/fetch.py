"""``armtempo fetch``: the samples of a run that had no host."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import options


@click.command()
@click.argument("what", required=False)
@options.out
@options.arm_of_file
@options.port
@options.log_traffic
def command(what: str | None, out: Path, arm_path: Path | None, port: str, log_traffic: Path | None) -> None:
    """Fetch the samples that the board keeps of its last run, such as one that its button started.

    WHAT is what was run: a trajectory file, or the name of a motion on the board; without it the motion that
    the button starts. A run under way is followed to its end. The samples go into a new run folder, once.
    """
    from armtempo.cli.live import repetition_line

    plan = options.load_plan(what, arm_path) if what else None
    arm = plan.arm if plan else options.load_arm(arm_path)
    with options.board(port, log_traffic, arm) as board:
        board.configure(arm, replace=False)
        run = board.fetch(plan or what, out)
        click.echo(f"{run.name}: {run.path}")
        click.echo(repetition_line(run.entries[-1]))
