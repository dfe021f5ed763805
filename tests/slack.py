"""Figures of cost that a change may move a little: more than 5 % above what is stored fails."""

from __future__ import annotations

SLACK = 1.05


def hold(what: str, found: float, stored: float) -> None:
    """AssertionError if ``found`` is more than 5 % above ``stored``; prints the change, which ``pytest -rP`` shows."""
    if found != stored:
        print(
            f"{what}: {stored:g} is now {found:g}, {found / stored - 1:+.1%}"
            if stored
            else f"{what}: now {found:g}"
        )
    assert 0 < found <= SLACK * stored, f"{what} was {stored:g}, is {found:g}"
