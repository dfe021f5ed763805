"""``armtempo panel``: the arm in a browser."""

from __future__ import annotations

import secrets
from contextlib import ExitStack
from pathlib import Path

import click

from armtempo.basics.errors import MissingPackageError
from armtempo.cli import chosen, options
from armtempo.cli.options import BoardOptions
from armtempo.ports.names import is_sim, sim_flash

_LOOPBACK = "127.0.0.1"


@click.command("panel")
@options.arm_of_board
@options.job
@options.port
@click.option(
    "--host",
    default=_LOOPBACK,
    show_default=True,
    help="Address to listen on; any other than the default requires the printed token.",
)
@click.option(
    "--web-port",
    type=click.IntRange(0, 65535),
    default=8088,
    show_default=True,
    metavar="PORT",
    help="TCP port to listen on; 0: any free port.",
)
@click.option("--show/--no-show", default=True, help="Open the page in the browser.")
def panel(
    arm_path: Path | None, job_path: Path | None, port: str | None, host: str, web_port: int, show: bool
) -> None:
    """Open the panel in a browser: see, move, teach, run and watch the arm.

    Ctrl-C ends the panel and brakes a motion. Closing a page while a button is held stops the arm. One page
    controls the arm, others watch; Stop works on all.
    """
    try:
        from armtempo.panel.desk import Desk
        from armtempo.panel.operator import Operator
        from armtempo.panel.server import Panel, listen
    except ModuleNotFoundError as error:
        raise MissingPackageError("the panel", str(error.name), "panel") from None
    from armtempo.simulator import LaunchOptions, launch

    arm = chosen.arm_or_paper(arm_path)
    job = chosen.job_file(job_path)
    name = chosen.port(port)
    token = "" if host == _LOOPBACK else secrets.token_urlsafe(16)
    with ExitStack() as stack:
        listening = stack.enter_context(listen(host, web_port))
        if is_sim(name):  # real time, as on a board
            wanted = LaunchOptions(sim_flash(name), virtual_time=False, arm=arm)
            name = stack.enter_context(launch(wanted)).port
        operator = Operator(
            lambda sink, tell: chosen.board(BoardOptions(name), arm, sink=sink, tell=tell),
            name,
            Desk(arm, Path(), job),
            chosen.runs(None),
        )
        stack.callback(operator.close)
        address = f"http://{host}:{listening.getsockname()[1]}/" + (f"?token={token}" if token else "")
        click.echo(address)
        if token:
            _qr_code(address)
        if show:
            click.launch(address)
        Panel(operator).serve(listening, token)


def _qr_code(address: str) -> None:
    """The address for a tablet's camera."""
    import segno

    segno.make(address).terminal(compact=True)
