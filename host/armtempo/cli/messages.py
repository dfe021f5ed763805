"""Errors on the terminal: what is wrong on one line, what to do next on the line below."""

from __future__ import annotations

import click

from armtempo.basics.errors import ArmtempoError
from armtempo.formats.plain_text import visible

DOCUMENT = "armtempo.document"
"""Key of click's context: a JSON document was printed."""


def show(error: ArmtempoError, who: str = "armtempo", as_json: bool = False) -> None:
    """Write an error to stderr, ``who`` before it; characters that would steer the terminal are spelt out.

    ``as_json``: as a document on stdout, with ``error``, ``hint`` and the ``exit_code``, unless one was printed there.
    """
    if as_json and DOCUMENT not in click.get_current_context().meta:
        import json

        click.echo(json.dumps({"error": error.problem, "hint": error.hint, "exit_code": error.exit_code}))
        return
    click.echo(f"{who}: {visible(error.problem)}", err=True)
    if error.hint:
        click.echo(f"hint: {visible(error.hint)}", err=True)
