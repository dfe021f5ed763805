"""The board program: MicroPython for the STM32F407.

``main.py`` starts it; from the REPL ``armtempo_board.replay("feed")`` runs one stored trajectory.
"""


def replay(name: str = "") -> None:
    """Run a stored trajectory without a host; see ``standalone.py``."""
    from armtempo_board import standalone

    standalone.replay(name)
