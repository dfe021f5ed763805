"""Forgets the modules that only set-up or the start of a motion needs; whoever needs one again imports it anew.

They are imported inside of functions, never at the head of a module, and never while a motion runs.
"""

import sys

import armtempo_shared

import armtempo_board

_PASSING = (
    (armtempo_board, ("registers", "check", "rates")),
    (armtempo_shared, ("armrecord", "table", "program")),
)


def forget() -> None:
    """Let the next collection have their memory."""
    for package, names in _PASSING:
        for name in names:
            sys.modules.pop(package.__name__ + "." + name, None)
            if hasattr(package, name):
                delattr(package, name)
