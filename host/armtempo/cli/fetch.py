"""``armtempo fetch``: the samples of a run that had no host."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import chosen, options, results


@click.command()
@click.argument("what", required=False, shell_complete=options.files)
@options.out
@options.arm_of_file
@options.altered
@options.port
@options.log_traffic
@options.as_json
def command(
    what: str | None,
    out: Path | None,
    arm_path: Path | None,
    altered: bool,
    port: str | None,
    log_traffic: Path | None,
    as_json: bool,
) -> None:
    """Fetch the samples that the board keeps of its last run, such as one that its button started.

    WHAT: what was run: a trajectory file, or the name of a motion on the board; without it the motion that
    the button starts. A run under way is followed to its end. The samples go into a new run folder, once.
    """
    from armtempo.cli.live import repetition_line

    plan = chosen.load_plan(Path(what), arm_path, altered) if what and chosen.is_file(what) else None
    named = plan.arm if plan else chosen.named_arm(arm_path)
    with chosen.board(port, log_traffic, named) as board:
        board.configure(chosen.arm_of_board(board, named))
        run = board.fetch(plan or what, chosen.runs(out))
        lines = [f"{run.name}: {run.path}", repetition_line(run.entries[-1])]
        results.show(as_json, run.to_json(), lines)
