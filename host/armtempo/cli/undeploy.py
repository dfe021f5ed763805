"""``armtempo undeploy``: take the board program off a board."""

from __future__ import annotations

import click

from armtempo.cli import chosen, options, results


@click.command()
@options.port
@options.as_json
def command(port: str | None, as_json: bool) -> None:
    """Take the board program off a board.

    Stored motions stay; a boot.py or main.py from before comes back.
    """
    from armtempo.deploy import undeploy

    name = chosen.port(port)
    undeploy(name, results.teller(as_json))
    if as_json:
        results.show_json({"port": name, "program": None})
