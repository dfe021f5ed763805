"""Options that several commands share, and what they open."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from armtempo.link import Board
    from armtempo.link.traffic import Sink
    from armtempo.model.arm import Arm

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


def load_arm(path: Path | None) -> Arm:
    """The arm of ``--arm``."""
    from armtempo.model import arm as arms

    return arms.load_arm(arm_file(path))


def arm_file(path: Path | None) -> Path:
    """The file of ``--arm``: a path, or the name of an arm that ships, which is said aloud."""
    from armtempo.model import arm as arms
    from armtempo.model import shipped

    if path is None:
        return arms.default_path()
    file, ships = shipped.find(path)
    if ships:
        click.echo(f"arm: {path}, as it ships with armtempo ({file})", err=True)
    return file


@contextmanager
def board(
    port: str,
    log_traffic: Path | None = None,
    arm: Arm | None = None,
    any_program: bool = False,
    sink: Sink | None = None,
) -> Iterator[Board]:
    """The board of ``--port``, greeted; a virtual one moves ``arm``; ``sink`` takes the traffic."""
    from armtempo.link import open_board

    with open_board(port, log_traffic, sink, arm, any_program) as found:
        found.session.tell = lambda text: click.echo(text, err=True)
        yield found
