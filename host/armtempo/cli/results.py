"""What a command found: lines for people, or with ``--json`` one document for programs.

The keys of the documents carry units as names do (``_deg``, ``_s``, ``_mm``, ``_steps``, ``_bytes``); what is not
known is null.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import click

from armtempo.cli import chosen
from armtempo.cli.messages import DOCUMENT


def show(as_json: bool, values: Any, lines: Iterable[str]) -> None:
    """Print the one or the other on stdout."""
    if as_json:
        show_json(values)
        return
    for line in lines:
        click.echo(line)


def show_json(values: Any) -> None:
    """Print one document, on one line."""
    import json

    click.get_current_context().meta[DOCUMENT] = True
    click.echo(json.dumps(values, allow_nan=False))


def teller(as_json: bool) -> Callable[[str], None]:
    """What says how the work goes: on stdout, or on stderr where that is for the document."""
    return chosen.tell if as_json else click.echo
