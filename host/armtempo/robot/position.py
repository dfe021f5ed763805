"""Where the arm of a board is."""

from __future__ import annotations

import logging
from pathlib import Path

from armtempo.basics.arguments import checked_as
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.planning.jog.jog_motion import number_of_joint
from armtempo.robot import arm_state, homing
from armtempo.robot.connection import Connection
from armtempo.robot.goto import Where, posture_deg
from armtempo.robot.homing import HomingProgress
from armtempo.robot.stop_request import StopRequest
from armtempo.robot.store import withdraw_old_default

LOG = logging.getLogger("armtempo")


@checked_as("Board")
class ArmPosition:
    """``Board.position``: where the arm is, and how that becomes known."""

    def __init__(self, board: Connection) -> None:
        self._board = board

    def home(self, arm: Arm | Path | str, where: Where | None = None, joint: int | str | None = None) -> None:
        """Declare that ``arm`` is at ``where`` (default: its home posture); nothing moves.

        ``joint``: number (from 1) or name of the only joint, with those that are coupled with it, that is declared to
        be at its home angle. A default that is old is taken from the board's button, with a warning to the logger
        "armtempo". Raises InputError for a posture that does not fit the arm, a joint that it does not have,
        or a posture and a joint, LinkError if the board is set up for another arm.
        """
        arm = Arm.of(arm)
        if joint is not None and where is not None:
            raise InputError("a posture and a joint exclude each other", "give one of them")
        number = None if joint is None else number_of_joint(arm, joint)
        self._board.configure(arm)
        if number is None:
            arm_state.home(self._board.client, arm, None if where is None else posture_deg(where, arm))
        else:
            arm_state.home_joint(self._board.client, arm, number)
        self._check_default(arm)

    def home_to_switches(
        self,
        arm: Arm | Path | str,
        stop: StopRequest | None = None,
        joint: int | str | None = None,
        progress: HomingProgress | None = None,
    ) -> None:
        """Home the joints that have a switch of known angle: to it, off it, slowly to it again, to their home angle.

        ``joint``: number (from 1) or name of the only one, with those that are coupled with it. ``progress``: called
        with what happens, by joint, how many joints are at home, and how many are homed. An old default as in ``home``.
        Raises InputError if no joint has such a switch, LinkError if a switch does not trip.
        """
        arm = Arm.of(arm)
        number = None if joint is None else number_of_joint(arm, joint)
        self._board.configure(arm)
        with self._board.stoppable(stop) as wanted:
            self._board.start.moved = True
            homing.home_to_switches(self._board.client, arm, wanted, number, progress or homing.silent)
        self._check_default(arm)

    def _check_default(self, arm: Arm) -> None:
        """After homing the button would start the default: warn of one that is old, and take it away."""
        if old := withdraw_old_default(self._board.client, arm):
            LOG.warning(old)

    def posture_deg(self) -> Array:
        """Joint angles from the commanded steps, degrees (J,); raises LinkError if a position is unknown."""
        return arm_state.posture_deg(self._board.client, self._board.known_arm())
