"""Output of commands: results as lines or as one JSON document, errors, and remarks, which ``--quiet``
suppresses.

The keys of the documents end with units (``_deg``, ``_s``, ``_mm``, ``_steps``, ``_bytes``); unknown values
are null.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from typing import Any

import click

from armtempo.basics.errors import ArmtempoError
from armtempo.basics.text import visible

_DOCUMENT = "armtempo.document"
"""Key of click's context: a JSON document was printed."""


def show(as_json: bool, values: Any, lines: Iterable[str]) -> None:
    """Print ``values`` as JSON, or ``lines``, on stdout."""
    if as_json:
        show_json(values)
        return
    for line in lines:
        click.echo(line)


def show_json(values: Any) -> None:
    """Print one document, on one line."""
    click.get_current_context().meta[_DOCUMENT] = True
    click.echo(json.dumps(values, allow_nan=False))


def show_error(error: ArmtempoError, who: str = "armtempo", as_json: bool = False) -> None:
    """Write an error to stderr, after ``who``, and its hint on the next line.

    Control characters are escaped. ``as_json``: print a document with ``error``, ``hint`` and ``exit_code``
    on stdout instead, unless a document was printed before.
    """
    if as_json and _DOCUMENT not in click.get_current_context().meta:
        click.echo(json.dumps({"error": error.problem, "hint": error.hint, "exit_code": error.exit_code}))
        return
    click.echo(f"{who}: {visible(error.problem)}", err=True)
    if error.hint:
        click.echo(f"hint: {visible(error.hint)}", err=True)


def is_quiet() -> bool:
    """Whether the command line began with ``armtempo --quiet``."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.find_root().params.get("quiet"))


def remark(text: str) -> None:
    """Print a remark on stderr, unless ``armtempo --quiet``."""
    if not is_quiet():
        click.echo(text, err=True)


def teller(as_json: bool) -> Callable[[str], None]:
    """The function that prints progress: to stdout, or to stderr if stdout is for the document."""
    return remark if as_json else click.echo
