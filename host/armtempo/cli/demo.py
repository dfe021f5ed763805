"""``armtempo demo``: the whole chain on the paper's feeding motion."""

from __future__ import annotations

from pathlib import Path

import click

import armtempo
from armtempo import pipeline
from armtempo.basics.errors import ArmtempoError, InputError, MissingPackageError
from armtempo.cli import options, resolve, results, sequences
from armtempo.cli.options import BoardOptions
from armtempo.cli.results import ProgressBar
from armtempo.cli.run import run_and_report
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.sequence import Sequence
from armtempo.ports.names import SIM
from armtempo.simulator import InjectedFault, LaunchOptions, launch

_NEXT = """\
report: {page}
        open it in a browser: {uri}
next:   armtempo new my_arm            a folder for your own arm and job, step by step
        armtempo panel --port sim      the arm in a browser (needs the extra 'panel')
        armtempo demo --pick-and-place a gripper and a part sensor
        armtempo --help                all commands"""


@click.command("demo")
@options.out
@click.option(
    "--port",
    default=SIM,
    show_default=True,
    metavar="PORT",
    help="Port of the board. Default: a virtual board.",
)
@click.option(
    "--pick-and-place",
    is_flag=True,
    help="Run a sequence with a gripper and a part sensor instead, on a virtual board only.",
)
@options.log_traffic
def demo(out: Path | None, port: str, pick_and_place: bool, log_traffic: Path | None) -> None:
    """Plan, replay and report the paper's feeding motion.

    Without --port a virtual board replays it faster than real time, even if a board is plugged in.
    """
    if pick_and_place:
        if port != SIM:
            raise InputError(f"--port {port}: --pick-and-place needs a virtual board", "leave --port out")
        _pick_and_place()
        return
    with ProgressBar("planning") as progress:
        plan = pipeline.plan(Arm.paper(), Job.paper(), progress)
    results.echo(f"arm: {resolve.describe_arm(plan.arm)}")
    for line in pipeline.summary(plan):
        results.echo(line)
    with resolve.board(BoardOptions(port, log_traffic), plan.arm) as board:
        run = run_and_report(board, plan, 1, resolve.runs(out))
    try:
        page = run.report()
        results.echo(_NEXT.format(page=page, uri=page.resolve().as_uri()))
    except MissingPackageError as error:
        results.show_error(
            ArmtempoError(error.problem, f"{error.hint}, then: armtempo report {run.path}"), "no report"
        )


def _pick_and_place() -> None:
    """The shipped sequence on a virtual board whose part sensor sees a part from the first motion on."""
    folder = Path(armtempo.__file__).parent / "data" / "pick_and_place"
    arm = Arm.load(folder / "arm.toml")
    with ProgressBar("planning") as progress:
        plan = armtempo.plan_sequence(arm, Sequence.load(folder / "sequence.toml", arm), progress)
    results.echo(f"arm: {resolve.describe_arm(arm)}")
    for line in sequences.lines(plan):
        results.echo(line)
    part = arm.inputs[arm.input("part")]
    lies_there = InjectedFault(
        "input", 0.1, 1, name=part.pin.removeprefix("P"), level=int(part.active == "high")
    )
    with (
        launch(LaunchOptions(arm=arm, faults=[lies_there])) as process,
        armtempo.connect(process.port, arm) as board,
    ):
        board.home(arm)
        sequences.run_and_report(board, plan, None)
