"""``armtempo ports``: where a board may be."""

from __future__ import annotations

import click


@click.command()
def command() -> None:
    """List the serial ports, likely boards first."""
    from armtempo.ports.listing import find_ports
    from armtempo.ports.names import SIM

    found = find_ports()
    width = max([24, *(1 + len(port.device) for port in found)])
    for port in found:
        mark = "a MicroPython board" if port.board else ""
        click.echo(f"{port.device:<{width}}{port.description:<31} {mark}".rstrip())
    if not found:
        click.echo("no serial ports here; connect a board by its USB socket")
    click.echo(f"{SIM:<{width}}a virtual board, started for one command")
