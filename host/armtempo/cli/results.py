"""Output of commands: results as lines or as one JSON document, errors, progress bars, and remarks, which ``--quiet``
suppresses.

The keys of the documents end with units (``_deg``, ``_s``, ``_mm``, ``_steps``, ``_bytes``); unknown values
are null.
"""

from __future__ import annotations

import json
import shutil
import sys
import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from typing import Any, Self

import click

from armtempo.basics.errors import ArmtempoError
from armtempo.basics.text import visible, wrapped

_DOCUMENT = "armtempo.document"
"""Key of click's context: a JSON document was printed."""
_PATIENCE_S = 1.0
_LEAST_COLUMNS = 40
"""Lines are not wrapped to less, however narrow the terminal: indented text would become a word a line."""
_BAR_COLUMNS = 24
"""Width of frame, percentage and remaining time; the note is cut so that no line wraps."""


def show(as_json: bool, values: Any, lines: Iterable[str]) -> None:
    """Print ``values`` as JSON, or ``lines``, on stdout."""
    if as_json:
        show_json(values)
        return
    for line in lines:
        echo(line)


def echo(text: str = "", err: bool = False) -> None:
    """Print text on stdout (``err``: stderr), wrapped to the terminal's width; to 80 columns if there is none.

    Not for what programs read.
    """
    click.echo(fitted(text), err=err)


def fitted(text: str, before: str = "") -> str:
    """The text, wrapped to be printed behind ``before``."""
    width = max(shutil.get_terminal_size().columns, _LEAST_COLUMNS)
    lines = [part for line in f"{before}{text}".split("\n") for part in wrapped(line, width)]
    return "\n".join(lines)[len(before) :]


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
    echo(f"{who}: {visible(error.problem)}", err=True)
    if error.hint:
        echo(f"hint: {visible(error.hint)}", err=True)


def is_quiet() -> bool:
    """Whether the command line began with ``armtempo --quiet``."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.find_root().params.get("quiet"))


def remark(text: str) -> None:
    """Print a remark on stderr, unless ``armtempo --quiet``."""
    if not is_quiet():
        echo(text, err=True)


def progress_printer(as_json: bool) -> Callable[[str], None]:
    """The function that prints progress: to stdout, or to stderr if stdout is for the document."""
    return remark if as_json else echo


class ProgressBar:
    """Call it with (done, whole); the bar appears after a second if work is left."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._start_s = time.monotonic()
        self._stack = ExitStack()
        self._bar: Any = None
        self._shown = 0
        self._stage = ""

    def stage(self, name: str) -> None:
        """Set the default note for the work from now on."""
        self._stage = name

    def __call__(self, done: float, whole: float, note: str = "") -> None:
        """Show the progress, with a note before the bar."""
        note = note or self._stage
        if self._bar is None and done < whole and self._wanted():
            self._bar = self._stack.enter_context(
                click.progressbar(length=1000, label=self._label, file=sys.stderr, width=0)
            )
        if self._bar is not None:
            width = max(shutil.get_terminal_size().columns - len(self._label) - _BAR_COLUMNS, 0)
            self._bar.label = f"{self._label} {note[:width]}".rstrip()
            now = int(1000 * done / whole)
            self._bar.update(now - self._shown)
            self._shown = now

    def _wanted(self) -> bool:
        return not is_quiet() and sys.stderr.isatty() and time.monotonic() - self._start_s >= _PATIENCE_S

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        self._stack.close()
