"""A board whose port another program has: what can be done through that program.

Nothing heavy is imported here: a stop has no time to lose.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from types import TracebackType
from typing import Any, Self

from armtempo_shared.messages import RESUME

from armtempo.basics.errors import InputError, LinkError
from armtempo.link.board_messages import Levels
from armtempo.ports import claim, names
from armtempo.ports.caller import Caller
from armtempo.robot.board_state import BoardState

ANSWER_S = 8.0
"""The program that has the port answers a request within this time, even where the board is silent, or it hangs."""
REST_S = 10.0
"""A board that was told to stop rests so long after the time that it says, at the latest."""
_LOOK_S = 0.05


class SharedBoard:
    """The board on a port that another program has; ``attach`` gives one. Used as a context, or closed.

    Every method raises NoAnswerError if that program does not answer, LinkError if it has given up the
    port, BoardError if the board refuses.
    """

    def __init__(self, caller: Caller) -> None:
        self._caller = caller
        self.program = caller.claim.who
        """Who has the port."""

    def state(self) -> BoardState:
        """What the board says now."""
        return BoardState.of_json(self._caller.ask("status", ANSWER_S)["status"])

    def stop(self, now: bool = False, by: str = "another program") -> bool:
        """Brake along the path, or freeze where ``now``; whether something moved. Does not wait for the rest.

        What the other program has under way ends; ``by``: who asked for it, as that program says.
        """
        return bool(self._caller.ask("stop", ANSWER_S, now=now, by=by)["moving"])

    def speed(self, fraction: float) -> None:
        """Run at a fraction of the planned speed, 0.01 to 1, as ``Board.speed``; InputError for another one."""
        from armtempo.robot.speed import permille

        self._caller.ask("speed", ANSWER_S, rate=permille(fraction))

    def pause(self) -> None:
        """Let what moves come to rest on its path, to continue with ``resume``; BoardError if nothing moves."""
        self._caller.ask("speed", ANSWER_S, rate=0)

    def resume(self) -> None:
        """Continue along the path at the speed before the pause; BoardError if nothing moves."""
        self._caller.ask("speed", ANSWER_S, rate=RESUME)

    def set_output(self, number: int, value: int) -> None:
        """Set an output of the arm record (from 0) to a value of 0 to 65535."""
        self._caller.ask("output", ANSWER_S, number=number, value=value)

    def levels(self) -> Levels:
        """What the inputs of the arm record are now, and what its outputs are set to."""
        found = self._caller.ask("inputs", ANSWER_S)
        return Levels(found["inputs"], tuple(found["outputs"]))

    def wait_for_rest(self) -> BoardState:
        """The state in which the board comes to rest; LinkError if it does not in time."""
        state = self.state()
        limit_s = time.monotonic() + REST_S + state.rest_s
        while state.moving:
            if time.monotonic() > limit_s:
                raise LinkError("the board was told to stop and does not", "switch off the motors' power")
            time.sleep(_LOOK_S)
            state = self.state()
        return state

    def watch(self, *topics: str, timeout_s: float | None = None) -> Iterator[dict[str, Any]]:
        """Messages of some ``topics`` as they come ("sample", "status", "event", "traffic"), until the other
        program gives up the port, or until none has come for ``timeout_s``.

        Each is a dictionary with a "topic"; host/docs/sharing.md lists what else.
        """
        self._caller.subscribe(*topics)
        return self._caller.messages(timeout_s)

    def close(self) -> None:
        """Hang up; the other program continues."""
        self._caller.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def find(port: str) -> SharedBoard | None:
    """The board on a port that another program has and answers for; None if there is no such program."""
    name = names.same_for_all(port)
    found = claim.find(name, port) if name else None
    if found is None:
        return None
    try:
        return SharedBoard(Caller(found))
    except LinkError:  # it hangs or has died: opening the port reports it
        return None


def attach(port: str | None = None) -> SharedBoard:
    """The board on a port that another program has, to look in or stop it.

    ``port``: as for ``connect``; where none is named, also the only one that is open. Raises LinkError if no
    program has it, or the one that has it hangs.
    """
    from armtempo.ports import board_port

    if not (port is None or (isinstance(port, str) and port.isprintable())):
        raise InputError(f"attach: port is {port!r:.40}", "give the name of a port, or None")
    chosen = board_port.choose(port, others=True)
    found = find(chosen.value)
    if found is None:
        raise LinkError(
            f"no armtempo program that answers has port {chosen.value}", "open it with armtempo.connect"
        )
    return found
