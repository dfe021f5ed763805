"""Where the arm of a board is."""

from __future__ import annotations

from pathlib import Path

from armtempo.basics.arguments import checked_as
from armtempo.basics.arrays import Array
from armtempo.model.arm import Arm
from armtempo.robot import arm_state, homing
from armtempo.robot.connection import Connection
from armtempo.robot.goto import Where, posture_deg
from armtempo.robot.stop_request import StopRequest


@checked_as("Board")
class ArmPosition:
    """``Board.position``: where the arm is, and how that becomes known."""

    def __init__(self, board: Connection) -> None:
        self._board = board

    def home(self, arm: Arm | Path | str, where: Where | None = None) -> None:
        """Declare that ``arm`` is at ``where`` (default: its home posture); nothing moves.

        Raises InputError for a posture that does not fit the arm, LinkError if the board is set up for another.
        """
        arm = Arm.of(arm)
        self._board.configure(arm)
        arm_state.home(self._board.client, arm, None if where is None else posture_deg(where, arm))

    def home_to_switches(self, arm: Arm | Path | str, stop: StopRequest | None = None) -> None:
        """Home the joints that have a switch of known angle: to it, off it, slowly to it again, to their home angle.

        Raises InputError if no joint has such a switch, LinkError if a switch does not trip.
        """
        arm = Arm.of(arm)
        self._board.configure(arm)
        with self._board.stoppable(stop) as wanted:
            self._board.start.moved = True
            homing.home_to_switches(self._board.client, arm, wanted)

    def posture_deg(self) -> Array:
        """Joint angles from the commanded steps, degrees (J,); raises LinkError if a position is unknown."""
        return arm_state.posture_deg(self._board.client, self._board.known_arm())
