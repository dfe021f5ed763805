"""``armtempo help`` and ``completion``: pages of the documentation, and shell completion."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import click
from click.shell_completion import get_completion_class

from armtempo.cli import main, results

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


SHELLS = ("bash", "zsh", "fish")


@click.command("completion")
@click.argument("shell", type=click.Choice(SHELLS))
def completion(shell: str) -> None:
    """Print a completion script for SHELL.

    \b
    bash: armtempo completion bash >> ~/.bashrc
    zsh:  armtempo completion zsh >> ~/.zshrc
    fish: armtempo completion fish > ~/.config/fish/completions/armtempo.fish
    """
    maker = get_completion_class(shell)
    assert maker is not None  # click defines these three
    click.echo(maker(main, {}, "armtempo", "_ARMTEMPO_COMPLETE").source())
