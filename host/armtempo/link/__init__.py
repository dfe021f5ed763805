"""The link: from the name of a port to a ``Client`` with one method for each command of the protocol.

``open_board`` opens a board; ``session`` has the protocol's timing; ``follow`` receives a run's samples.
"""

from armtempo.link.client import Client
from armtempo.link.connect import Opening, greet, open_board, patiently

__all__ = ["Client", "Opening", "greet", "open_board", "patiently"]
