"""Errors on the terminal: what is wrong on one line, what to do next on the line below."""

from __future__ import annotations

import click

from armtempo.basics.errors import ArmtempoError
from armtempo.formats.plain_text import visible


def show(error: ArmtempoError, who: str = "armtempo", as_json: bool = False) -> None:
    """Write an error to stderr, ``who`` before it; characters that would steer the terminal are spelt out.

    ``as_json``: as a document on stdout instead, with ``error``, ``hint`` and the ``exit_code``.
    """
    if as_json:
        import json

        click.echo(json.dumps({"error": error.problem, "hint": error.hint, "exit_code": error.exit_code}))
        return
    click.echo(f"{who}: {visible(error.problem)}", err=True)
    if error.hint:
        click.echo(f"hint: {visible(error.hint)}", err=True)
