"""Options that several commands share, and the objects that they name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from armtempo.link.traffic import Sink
    from armtempo.model.arm import Arm
    from armtempo.model.job import Job
    from armtempo.model.plan import Plan
    from armtempo.robot.board import Board

FC = TypeVar("FC", bound=Callable[..., Any] | click.Command)

port = click.option(
    "--port",
    envvar="ARMTEMPO_PORT",
    default="sim",
    show_default=True,
    show_envvar=True,
    metavar="PORT",
    help="Serial device or URL of the board; 'sim' starts a virtual board for this command, 'sim:FOLDER' one "
    "that keeps its flash in FOLDER.",
)
log_traffic = click.option(
    "--log-traffic",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write every byte to and from the board to FILE ('armtempo monitor FILE' shows it).",
)


def _arm_option(text: str) -> Callable[[FC], FC]:
    return click.option(
        "--arm",
        "arm_path",
        envvar="ARMTEMPO_ARM",
        show_envvar=True,
        type=click.Path(path_type=Path),
        metavar="ARM",
        help=text,
    )


arm = _arm_option(
    "Arm file (TOML), or the name of an arm that ships, such as ar4; without it the paper's 1:5 arm."
)
arm_of_file = _arm_option(
    "Arm file (TOML) or name of an arm that ships, which a trajectory file must fit; without it the one in that "
    "file, else the paper's 1:5 arm."
)
job = click.option(
    "--job",
    "job_path",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Job file (TOML); without it the paper's feeding job.",
)
out = click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("runs"),
    show_default=True,
    metavar="FOLDER",
    help="Where run folders go; each run makes a new one.",
)

flash_port = click.option(
    "--port",
    envvar="ARMTEMPO_PORT",
    show_envvar=True,
    metavar="PORT",
    help="Where the board answers now; without it the board is in its bootloader, or an ST-LINK is connected.",
)
flash_tool = click.option(
    "--tool",
    type=click.Choice(["dfu-util", "st-flash"]),
    help="What flashes: over USB, or through an ST-LINK; without it the one that is installed.",
)


def flash(folder: Path, port: str | None, tool: str | None) -> None:
    """Put the firmware in ``folder`` on the board, and say what comes next."""
    from armtempo.cli.progress import ProgressBar
    from armtempo.deploy.firmware.flash import flash as put

    with ProgressBar("flashing") as progress:
        put(folder, port, tool, click.echo, progress)
    click.echo(f"flashed; the start files are next: armtempo deploy --port {port or 'PORT'}")


def load_arm(given: Path | None) -> Arm:
    """The arm of ``--arm``."""
    from armtempo.model import arm_file as reader

    return reader.load(arm_file(given))


def arm_file(given: Path | None) -> Path:
    """The file of ``--arm``, a path or the name of an arm that ships; which one ships is said aloud."""
    from armtempo.model import arm_file as reader
    from armtempo.model import shipped

    if given is None:
        return reader.default_path()
    found = shipped.find(given)
    if found.ships:
        click.echo(f"arm: {given}, as it ships with armtempo ({found.path})", err=True)
    return found.path


def load_job(path: Path | None, arm: Arm) -> Job:
    """The job of ``--job``."""
    from armtempo.model.job import Job

    return Job.load(path, arm) if path else Job.paper(arm)


def load_plan(what: str, arm_path: Path | None) -> Plan | None:
    """The plan of a trajectory file, which must fit ``--arm``; None where ``what`` names a motion on the board."""
    path = Path(what)
    return load_plan_file(path, arm_path) if path.suffix == ".json" or path.is_file() else None


def load_plan_file(path: Path, arm_path: Path | None) -> Plan:
    """The plan of a trajectory file, which must fit ``--arm``."""
    from armtempo import pipeline

    return pipeline.load(path, load_arm(arm_path) if arm_path else None)


def board(
    port: str,
    log_traffic: Path | None = None,
    arm: Arm | None = None,
    any_program: bool = False,
    sink: Sink | None = None,
) -> Board:
    """The board of ``--port``; a virtual one moves ``arm``; ``sink`` takes the traffic."""
    from armtempo.robot.board import connect

    return connect(
        port,
        arm,
        log_traffic=log_traffic,
        sink=sink,
        any_program=any_program,
        tell=lambda text: click.echo(text, err=True),
    )
