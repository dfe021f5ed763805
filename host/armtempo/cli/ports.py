"""``armtempo ports``: where a board may be."""

from __future__ import annotations

import click

from armtempo.cli import options, results


@click.command()
@options.as_json
def command(as_json: bool) -> None:
    """List the serial ports, likely boards first."""
    from armtempo.ports.listing import find_ports
    from armtempo.ports.names import SIM

    found = find_ports()
    if as_json:
        entries = [
            {"port": port.device, "description": port.description, "board": port.board} for port in found
        ]
        results.show_json({"ports": entries})
        return
    width = max([24, *(1 + len(port.device) for port in found)])
    for port in found:
        mark = "a MicroPython board" if port.board else ""
        click.echo(f"{port.device:<{width}}{port.description:<31} {mark}".rstrip())
    if not found:
        click.echo(
            "no serial ports here; connect a board by its USB socket; one without MicroPython: armtempo flash"
        )
    click.echo(f"{SIM:<{width}}a virtual board, started for one command")
