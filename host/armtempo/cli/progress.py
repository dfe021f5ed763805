"""Progress bars, only on a terminal and for work that takes longer than a second."""

from __future__ import annotations

import shutil
import sys
import time
from contextlib import ExitStack
from typing import Any, Self

import click

from armtempo.cli.results import is_quiet

_PATIENCE_S = 1.0
_BAR_COLUMNS = 24
"""Width of frame, percentage and remaining time; the note is cut so that no line wraps."""


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
            room = max(shutil.get_terminal_size().columns - len(self._label) - _BAR_COLUMNS, 0)
            self._bar.label = f"{self._label} {note[:room]}".rstrip()
            now = int(1000 * done / whole)
            self._bar.update(now - self._shown)
            self._shown = now

    def _wanted(self) -> bool:
        return not is_quiet() and sys.stderr.isatty() and time.monotonic() - self._start_s >= _PATIENCE_S

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        self._stack.close()
