"""The link: from a port's name to a ``Board`` with one method a command.

``open_board`` is all that others need; ``session`` holds the protocol's timing, ``follow`` a run's samples.
"""

from armtempo.link.board import Board
from armtempo.link.connect import greet, open_board

__all__ = ["Board", "greet", "open_board"]
