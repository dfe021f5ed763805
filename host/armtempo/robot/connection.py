"""What the roles of one board share: its client, the arm that it is set up for, the stop requests of running calls."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from armtempo.basics.arguments import checked_as
from armtempo.basics.errors import InputError
from armtempo.encoding import made_with
from armtempo.encoding.encode import arm_record
from armtempo.link import Client
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.robot import arm_state, stop_request
from armtempo.robot.goto import StartPosition
from armtempo.robot.stop_request import StopRequest


@checked_as("Board")
class Connection:
    """An open board, for its roles."""

    def __init__(self, client: Client, port: str) -> None:
        self.client = client
        self.port = port
        self.arm: Arm | None = None
        self.stops: list[StopRequest] = []
        self.start = StartPosition(client, port)

    def configure(self, arm: Arm | Path | str, replace: bool = False) -> None:
        """Set the board up for ``arm``: an object, its file, or the name of a shipped arm.

        ``replace``: replace another arm's record. All positions are unknown afterwards, unless only limits
        differ; stored motions of the other record are refused. Raises LinkError if the board has another
        record and ``replace`` is false, InputError if a value of the arm does not fit the board.
        """
        arm = Arm.of(arm)
        arm_state.configure(self.client, arm, replace)
        self.arm = arm

    def configure_for(self, arm: Arm, plan: Plan | None) -> None:
        """Set the board up for the arm of a motion or sequence, as ``configure``.

        Raises InputError if something that its ``plan`` was made with has changed since.
        """
        if plan is None or self.arm is None or arm_record(self.arm) != arm_record(arm):
            self.configure(arm)
            return
        made_with.check_surroundings(f"plan {plan.name!r}", plan, self.arm)
        self.configure(self.arm)  # it may have postures and frames that the plan's arm has not

    @contextmanager
    def stoppable(self, given: StopRequest | None) -> Iterator[StopRequest]:
        """As ``stoppable``; other programs can request this stop too."""
        with stop_request.stoppable(given) as wanted:
            self.stops.append(wanted)
            try:
                yield wanted
            finally:
                self.stops.remove(wanted)

    def known_arm(self) -> Arm:
        """The arm; raises InputError if none is set."""
        if self.arm is None:
            raise InputError("no arm is set", "set it with home(arm) or configure(arm)")
        return self.arm

    def configured_arm(self) -> Arm:
        """The arm, for which the board is set up now."""
        arm = self.known_arm()
        self.configure(arm)
        return arm
