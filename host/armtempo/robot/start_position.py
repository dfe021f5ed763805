"""The arm where a motion or sequence begins: a virtual arm is brought there, a real one has to be there."""

from __future__ import annotations

from dataclasses import dataclass

from armtempo.basics.arrays import Array
from armtempo.basics.errors import LinkError
from armtempo.link import Client
from armtempo.model.arm import Arm
from armtempo.ports.names import is_sim
from armtempo.robot import arm_state, goto
from armtempo.robot.stop_request import StopRequest


@dataclass
class StartPosition:
    """What is done about an arm's position before anything starts, on one board."""

    client: Client
    port: str
    moved: bool = False
    """Whether this arm has been moved or homed through this object, so that nothing is assumed of its position."""

    def home_virtual_arm(self, arm: Arm) -> None:
        """A virtual arm that has not moved yet is at home: nobody needs to look."""
        if is_sim(self.port) and not self.moved:
            arm_state.home_unknown(self.client, arm)
        self.moved = True

    def take(self, arm: Arm, start_deg: Array | None, name: str, advice: str, stop: StopRequest) -> None:
        """Move a virtual arm to ``start_deg``, degrees (J,); None: it may begin anywhere.

        LinkError with ``advice`` if a real arm is not there.
        """
        if is_sim(self.port):
            self.home_virtual_arm(arm)
            if start_deg is not None:
                goto.go_to(self.client, arm, start_deg, stop)
        elif start_deg is not None and not arm_state.is_at(self.client, arm, start_deg):
            raise LinkError(f"the arm is not at the start of {name}", advice)
