"""The board program: MicroPython for the STM32F407.

``main.py`` starts it; from the REPL ``armtempo_board.replay("feed")`` runs one stored trajectory.
"""


def replay(name: str = "") -> None:
    """Run a stored trajectory without a host; see ``standalone.py``."""
    from armtempo_board import standalone

    standalone.replay(name)


def forget() -> None:
    """Let the next collection have the modules that only set-up or the start of a motion needs.

    They are imported inside of functions, never at the head of a module, and never while a motion runs.
    """
    import sys

    import armtempo_shared

    here = sys.modules[__name__]
    passing = ((here, ("registers", "check", "rates")), (armtempo_shared, ("armrecord", "table", "program")))
    for package, names in passing:
        for name in names:
            sys.modules.pop(package.__name__ + "." + name, None)
            if hasattr(package, name):
                delattr(package, name)
