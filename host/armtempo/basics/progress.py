"""How work that takes a while tells how far it is."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[float, float], object]
"""Called now and then with the work done and the whole of it, both in the same unit."""


def part(progress: Progress | None, number: int, parts: int) -> Progress | None:
    """The progress of part ``number`` (from 0) of work that has ``parts`` equal ones."""
    if progress is None:
        return None
    return lambda done, whole: progress(number + done / whole, parts)
