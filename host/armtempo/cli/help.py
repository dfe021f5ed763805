"""``armtempo help``: pages of the documentation."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import click

from armtempo.cli import results

TOPICS = {
    "first-hour": "host",
    "first-hour-board": "host",
    "first-power-on": "host",
    "day": "host",
    "files": "host",
    "arms": "host",
    "kinematics": "host",
    "planning": "host",
    "sequences": "host",
    "programs": "host",
    "sharing": "host",
    "virtual-board": "host",
    "recovery": "host",
    "hardware": "board",
    "firmware": "board",
}
"""Pages and the part of the project whose ``docs`` folder has them; a wheel has them in ``data/pages``."""


@click.command("help")
@click.argument("topic", metavar="[TOPIC]", required=False, type=click.Choice([*TOPICS]))
def show_page(topic: str | None) -> None:
    """Show a page of the documentation, or list them.

    TOPIC: a name of the list.
    """
    if topic is None:
        for name in TOPICS:
            title = page(name).partition("\n")[0].lstrip("# ")
            results.echo(f"{name:18}{title}")
        return
    click.echo_via_pager(page(topic))


def page(topic: str) -> str:
    """The text of a page, from the wheel or from the checkout."""
    package = Path(str(files("armtempo")))
    shipped = package / "data" / "pages" / f"{topic}.md"
    found = shipped if shipped.exists() else package.parents[1] / TOPICS[topic] / "docs" / f"{topic}.md"
    return found.read_text(encoding="utf-8")
