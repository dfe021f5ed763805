"""How much a command says beside what it was asked for."""

from __future__ import annotations

import click


def is_quiet() -> bool:
    """Whether the command line began with ``armtempo --quiet``."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.find_root().params.get("quiet"))
