"""``armtempo completion``: the Tab key completes commands and options in a shell."""

from __future__ import annotations

import click

SHELLS = ("bash", "zsh", "fish")


@click.command()
@click.argument("shell", type=click.Choice(SHELLS))
def command(shell: str) -> None:
    """Print a script that lets SHELL complete commands and options.

    \b
    bash: armtempo completion bash >> ~/.bashrc
    zsh:  armtempo completion zsh >> ~/.zshrc
    fish: armtempo completion fish > ~/.config/fish/completions/armtempo.fish
    """
    from click.shell_completion import get_completion_class

    from armtempo.cli import main

    maker = get_completion_class(shell)
    assert maker is not None  # click brings these three
    click.echo(maker(main, {}, "armtempo", "_ARMTEMPO_COMPLETE").source())
