"""A board whose port another program has, used through that program.

It imports little, so that a stop is sent quickly.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, Self

from armtempo_shared.messages import RESUME

from armtempo.basics.errors import InputError, LinkError
from armtempo.basics.kinds import is_text
from armtempo.link.board_messages import Levels
from armtempo.ports import claim, names
from armtempo.ports.caller import Caller
from armtempo.robot.board_state import BoardState

ANSWER_S = 8.0
"""Time-out of a request: the program that has the port answers earlier, even if the board is silent."""
REST_S = 10.0
"""Time allowed beyond the announced one for the board to come to rest after a stop."""
_LOOK_S = 0.05


class SharedBoard:
    """The board on a port that another program has, from ``attach``. Use it as a context, or close it.

    Every method raises NoAnswerError if that program does not answer, LinkError if it has closed the port,
    BoardError if the board refuses.
    """

    def __init__(self, caller: Caller) -> None:
        self._caller = caller
        self.program = caller.claim.who
        """The program that has the port."""

    def state(self) -> BoardState:
        """The board's state."""
        return BoardState.of_json(self._caller.ask("status", ANSWER_S)["status"])

    def stop(self, now: bool = False, by: str = "another program") -> bool:
        """Brake along the path (``now``: freeze the outputs); returns whether something moved. Does not wait for rest.

        The other program's running calls end. ``by``: who asks for the stop, for its messages.
        """
        return bool(self._caller.ask("stop", ANSWER_S, now=now, by=by)["moving"])

    def speed(self, fraction: float) -> None:
        """Set the speed as a fraction of the planned speed, 0.01 to 1, as ``Board.speed``; raises InputError
        otherwise."""
        from armtempo.robot.running import permille

        self._caller.ask("speed", ANSWER_S, rate=permille(fraction))

    def pause(self) -> None:
        """Bring the motion to rest on its path; ``resume`` continues it. Raises BoardError if nothing moves."""
        self._caller.ask("speed", ANSWER_S, rate=0)

    def resume(self) -> None:
        """Continue along the path at the speed before the pause; raises BoardError if nothing moves."""
        self._caller.ask("speed", ANSWER_S, rate=RESUME)

    def set_output(self, number: int, value: int) -> None:
        """Set an output of the arm record (from 0) to a value of 0 to 65535."""
        self._caller.ask("output", ANSWER_S, number=number, value=value)

    def levels(self) -> Levels:
        """The levels of the inputs, and the values of the outputs."""
        found = self._caller.ask("inputs", ANSWER_S)
        return Levels(found["inputs"], tuple(found["outputs"]))

    def wait_for_rest(self) -> BoardState:
        """Wait for rest; returns the state. Raises LinkError if it takes too long."""
        state = self.state()
        limit_s = time.monotonic() + REST_S + state.rest_s
        while state.moving:
            if time.monotonic() > limit_s:
                raise LinkError("the board was told to stop but still moves", "switch off the motors' power")
            time.sleep(_LOOK_S)
            state = self.state()
        return state

    def watch(self, *topics: str, timeout_s: float | None = None) -> Iterator[dict[str, Any]]:
        """Messages of the ``topics`` ("sample", "status", "event", "traffic"), until the other
        program closes the port, or for ``timeout_s`` without a message.

        Each is a dictionary with a "topic"; host/docs/sharing.md lists the other keys.
        """
        self._caller.subscribe(*topics)
        return self._caller.messages(timeout_s)

    def close(self) -> None:
        """Close the connection; the other program continues."""
        self._caller.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        self.close()


def find(port: str) -> SharedBoard | None:
    """The board on a port of a program that answers; None if there is no such program."""
    name = names.same_for_all(port)
    found = claim.find(name, port) if name else None
    if found is None:
        return None
    try:
        return SharedBoard(Caller(found))
    except LinkError:  # hanging or dead: opening the port reports it
        return None


def attach(port: str | None = None) -> SharedBoard:
    """Connect to a board whose port another program has, to watch or stop it.

    ``port``: as in ``connect``; default: the only port that is open. Raises LinkError if no program has it,
    or that program hangs.
    """
    from armtempo.ports import board_port

    if not (port is None or is_text(port)):
        raise InputError(f"attach: port is {port!r:.40}", "give the name of a port, or None")
    chosen = board_port.choose(port, others=True)
    found = find(chosen.value)
    if found is None:
        raise LinkError(
            f"no armtempo program that answers has port {chosen.value}", "open it with armtempo.connect"
        )
    return found
