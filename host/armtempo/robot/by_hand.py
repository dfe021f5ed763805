"""Guiding the arm by hand: the motors' current is off, and the encoders give the position."""

from __future__ import annotations

import time
from types import TracebackType
from typing import Self

from armtempo_shared.meanings import BUTTON_NOTICE

from armtempo.basics.arrays import Array
from armtempo.basics.errors import BoardError, InputError, LinkError
from armtempo.link import Client
from armtempo.link.board_messages import Notice
from armtempo.model.arm import Arm
from armtempo.robot import arm_state

SETTLES_S = 0.3
"""Settling time after the current is switched on: motors turn to the next stable position, at most two full
steps away."""


class HandGuided:
    """A context in which the motors' current is off. At its end the position is set from the encoders.

    Someone must hold the arm: it sinks under its weight. Raises InputError for a driven joint without an
    encoder, LinkError if the position is unknown before.
    """

    def __init__(self, client: Client, arm: Arm) -> None:
        blind = [joint.name for joint in arm.driven if joint.encoder is None]
        if blind:
            raise InputError(
                f"{', '.join(blind)}: no encoder, so moves by hand cannot be measured",
                "teach with the keys instead: 'armtempo teach' without --by-hand",
            )
        arm_state.posture_deg(client, arm)
        self._client = client
        self._arm = arm

    def __enter__(self) -> Self:
        """Switch the current off; the position is unknown to the board until the end."""
        self._client.drivers(False)
        self.button_pressed()  # earlier presses do not count
        return self

    def button_pressed(self) -> bool:
        """Whether the board's button was pressed since the last call; it starts no motion meanwhile."""
        session, pressed = self._client.session, False
        while (event := session.poll(0.0)) is not None:
            pressed = pressed or (isinstance(event, Notice) and event.text.startswith(BUTTON_NOTICE))
        return pressed

    def angles_deg(self) -> Array:
        """Joint angles from the encoders, degrees (J,)."""
        return self._arm.transmission.angles_of_counts(self._client.status().positions.counts)

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Switch the current on and declare the position; raises LinkError if a joint is outside its range."""
        self._client.drivers(True)
        time.sleep(SETTLES_S)
        angles = self.angles_deg()
        try:
            self._client.home(self._arm.transmission.whole_steps(angles))
        except BoardError as error:
            if value is None:
                raise LinkError(
                    f"the arm was left beyond a range ({error.problem}), so its position is unknown",
                    "move it within its ranges by hand and run 'armtempo home'",
                ) from error
