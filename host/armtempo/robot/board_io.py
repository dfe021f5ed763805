"""The outputs and inputs of a connected board."""

from __future__ import annotations

from armtempo.basics.arguments import checked_as
from armtempo.robot.connection import Connection
from armtempo.robot.outputs import BoardInput, BoardOutput


@checked_as("Board")
class BoardIO:
    """``Board.io``: the arm's outputs and inputs."""

    def __init__(self, board: Connection) -> None:
        self._board = board

    def output(self, name: str) -> BoardOutput:
        """An output of the arm by name; raises InputError if the arm has no such output or is not known."""
        return BoardOutput(self._board.client, self._board.configured_arm(), name)

    def input(self, name: str) -> BoardInput:
        """An input of the arm by name; raises as ``output``."""
        return BoardInput(self._board.client, self._board.configured_arm(), name)
