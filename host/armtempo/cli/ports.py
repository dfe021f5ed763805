"""``armtempo ports``: where a board may be."""

from __future__ import annotations

import click


@click.command()
def command() -> None:
    """List the serial ports, likely boards first."""
    from armtempo.link.ports import SIM, find_ports

    found = find_ports()
    for port in found:
        mark = "a MicroPython board" if port.board else ""
        click.echo(f"{port.device:<24}{port.description:<32}{mark}".rstrip())
    if not found:
        click.echo("no serial ports here; connect a board by its USB socket")
    click.echo(f"{SIM:<24}a virtual board, started for one command")
