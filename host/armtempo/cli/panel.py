"""``armtempo panel``: the arm in a browser."""

from __future__ import annotations

import secrets
from contextlib import ExitStack
from ipaddress import ip_address
from pathlib import Path
from tempfile import TemporaryDirectory

import click

from armtempo.basics.errors import MissingPackageError
from armtempo.cli import options, resolve
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
    help="Address to listen on; 0.0.0.0: on all of this machine's.",
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
    """Open the panel in a browser: move, teach, plan and run.

    Ctrl-C ends the panel and brakes a motion. Closing a page while a button is held stops the arm. One page
    controls the arm, others watch; Stop works on all. The printed addresses hold a token, without which nobody
    is served.
    """
    try:
        from armtempo.panel.job_editor import JobEditor
        from armtempo.panel.panel_board import PanelBoard
        from armtempo.panel.server import Panel, listen, reachable, url
    except ModuleNotFoundError as error:
        raise MissingPackageError("the panel", str(error.name), "panel") from None
    from armtempo.simulator import LaunchOptions, launch

    arm = resolve.arm_or_paper(arm_path)
    job = resolve.job_file(job_path)
    name = resolve.port(port)
    token = secrets.token_urlsafe(16)
    with ExitStack() as stack:
        listening = stack.enter_context(listen(host, web_port))
        if is_sim(name):  # real time, as on a board
            wanted = LaunchOptions(sim_flash(name), virtual_time=False, arm=arm)
            name = stack.enter_context(launch(wanted)).port
        operator = PanelBoard(
            lambda sink, tell: resolve.board(BoardOptions(name), arm, sink=sink, tell=tell),
            name,
            JobEditor(arm, Path(), job),
            resolve.runs(None),
        )
        stack.callback(operator.close)
        bound, web_port = listening.getsockname()[:2]
        addresses = [url(address, web_port, token) for address in reachable(bound)]
        for address in addresses:
            click.echo(address)
        if not ip_address(bound).is_loopback:
            _qr_code(addresses[0])
        if show:
            click.launch(str(_way_in(stack, addresses[-1])))
        Panel(operator).serve(listening, token)


def _way_in(stack: ExitStack, address: str) -> Path:
    """A file of this user's alone that leads to the address: the arguments of a browser can be read by everybody."""
    folder = stack.enter_context(TemporaryDirectory(prefix="armtempo-", ignore_cleanup_errors=True))
    file = Path(folder) / "panel.html"
    file.write_text(
        f'<!DOCTYPE html><meta http-equiv="refresh" content="0; url={address}">', encoding="utf-8"
    )
    return file


def _qr_code(address: str) -> None:
    """The address for a tablet's camera."""
    import segno

    segno.make(address).terminal(compact=True)
