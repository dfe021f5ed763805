"""Errors on the terminal: what is wrong on one line, what to do next on the line below."""

from __future__ import annotations

import click

from armtempo.basics.errors import ArmtempoError
from armtempo.formats.plain_text import visible


def show(error: ArmtempoError, who: str = "armtempo") -> None:
    """Write an error to stderr, ``who`` before it; characters that would steer the terminal are spelt out."""
    click.echo(f"{who}: {visible(error.problem)}", err=True)
    if error.hint:
        click.echo(f"hint: {visible(error.hint)}", err=True)
