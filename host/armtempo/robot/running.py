"""Start, follow and stop what the board runs; change its speed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import TypeVar

from armtempo_shared import wire
from armtempo_shared.messages import ONCE_NAME, PERMILLE, RESUME, SLOWEST_PERMILLE

from armtempo.basics.arguments import checked
from armtempo.basics.errors import BoardError, InputError, LinkError, NoAnswerError, OtherBoardError
from armtempo.encoding.encoded_plan import MotionKey
from armtempo.link import Client
from armtempo.link.board_messages import SequenceState
from armtempo.link.follow import CHECK_S, Followed, Follower, RunEnd, where
from armtempo.link.refusal import refusal
from armtempo.link.session import RECONNECT_S, OnLoss
from armtempo.robot.stop_request import StopRequest

_Follower = TypeVar("_Follower", bound=Follower)

BRAKE_S = 5.0
"""A board that is not at rest after this time, nor _LATER_S after the announced time, is told to freeze."""
_LATER_S = 1.0
FREEZE_S = 2.0
"""Longest time that freezing takes."""
LOCK_S = 1.0
"""A request from another thread waits this long for its turn to talk to the board."""


_STORED = "tmp-move"
"""Name on the board of a move that is larger than its memory."""


@contextmanager
def on_board(client: Client, data: bytes) -> Iterator[MotionKey]:
    """Put a motion record on the board, to be run once: in its memory, or, if larger, stored until the context ends."""
    if len(data) <= client.info.once_bytes:
        yield MotionKey(ONCE_NAME, client.put_once(data))
        return
    client.upload(_STORED, data)
    try:
        yield MotionKey(_STORED, wire.record_crc(data))
    finally:
        with suppress(LinkError):  # do not hide the earlier error
            client.remove(_STORED)


def nothing(event: Followed) -> None:
    """What is done with samples and other events that nobody asked for."""


@contextmanager
def attended(client: Client, stop: StopRequest) -> Iterator[None]:
    """A context in which something is started, by ``Client.start``, and followed to its end, by ``follow``.

    If the cable is pulled, the board is waited for up to RECONNECT_S, or STOPPING_RECONNECT_S if the stop is wanted; a
    sequence goes on meanwhile. Raises Stopped if the stop was wanted before.
    """
    session = client.session
    with session.on_loss(OnLoss(stopping=lambda: stop.wanted)), stop.waking(session.wake):
        stop.check()
        session.events.clear()  # of earlier runs, such as one by the button
        yield


def follow(
    client: Client,
    stop: StopRequest,
    follower: _Follower,
    take: Callable[[Followed], object] = nothing,
) -> _Follower:
    """Follow what was started to its end; a stop request makes the board brake. Any error stops the board.

    ``take`` is called with its samples and other events. A board that falls silent is waited for like a pulled cable,
    see ``attended``. Raises LinkError if the board cannot be reached any more.
    """
    session = client.session
    brake = Brake(client, stop)
    while True:
        try:
            for event in follower.events(brake):
                take(event)
            return follower
        except OtherBoardError as error:
            raise LinkError(
                f"{error.problem}; what happened after the last sample is not known", f"{error.hint}"
            ) from error
        except NoAnswerError as error:  # silent although its port exists: treated like a pulled cable
            if not stop.wanted:  # otherwise the stop continues until it is abandoned
                if session.clock() - follower.heard_s > RECONNECT_S:
                    raise
                session.reconnect(error)
        except BaseException as error:
            _stop_after(client, error)
            raise


def _stop_after(client: Client, error: BaseException) -> None:
    """Stop a run because of ``error``, if the board can be reached."""
    if isinstance(error, BoardError) and error.code == wire.ERROR_CODES["no_session"]:
        raise LinkError(
            (
                "the board restarted during the motion: the arm's position is not known, nor what happened after "
                "the last sample"
            ),
            "find the cause, then 'armtempo home'",
        ) from error
    with client.session.on_loss(OnLoss(retry_s=0.0)), suppress(LinkError):  # do not hide the first error
        client.stop(now=isinstance(error, KeyboardInterrupt))


class Brake:
    """Called between two messages: sends a requested stop; freezes a board that does not come to rest."""

    def __init__(self, client: Client, stop: StopRequest, now: bool = False) -> None:
        self._client = client
        self._stop = stop
        self._steps = [(0.0, self._freeze if now else self._brake), *self._later(0.0 if now else BRAKE_S)]
        self._asked_s = 0.0

    def _later(self, brake_s: float) -> list[tuple[float, Callable[[], object]]]:
        return [(brake_s, self._freeze), (brake_s + FREEZE_S, _does_not_stop)]

    def _freeze(self) -> None:
        send_stop(self._client, now=True)

    def _brake(self) -> None:
        if send_stop(self._client):
            self._steps = self._later(max(BRAKE_S, self._client.status().rest_ms / 1000 + _LATER_S))

    def __call__(self) -> None:
        if not self._stop.wanted:
            return
        now_s = self._client.session.clock()
        self._asked_s = self._asked_s or now_s
        if self._steps and now_s - self._asked_s >= self._steps[0][0]:
            self._steps.pop(0)[1]()


def _does_not_stop() -> None:
    raise LinkError("the board was told to stop but still moves", "switch off the motors' power")


def send_stop(client: Client, now: bool = False) -> bool:
    """Tell the board to brake along the path, or to freeze; returns False if nothing moves."""
    try:
        client.stop(now)
        return True
    except BoardError as error:
        if error.code != wire.ERROR_CODES["not_moving"]:
            raise
        return False


def request_stop(client: Client, stops: Iterable[StopRequest], now: bool, by: str) -> bool:
    """Stop a motion from a thread other than the one that waits for it; returns whether something moved.

    ``stops``: the requests of this program's running calls. Raises NoAnswerError if the board is silent.
    """
    for request in [*stops]:
        request.ask(by)
    with client.session.in_a_hurry(LOCK_S, stops=True) as mine:
        if not mine:
            raise NoAnswerError(
                "the board does not answer the program that has its port",
                "a stop is sent as soon as it does; if that takes too long, switch off the motors' power",
            )
        return send_stop(client, now)


def stop(client: Client, now: bool) -> None:
    """Stop and wait until the arm is at rest; raises LinkError if that takes too long."""
    request = StopRequest()
    request.wanted = True
    brake = Brake(client, request, now)
    brake()
    while client.status().moving:
        brake()
        client.session.poll(CHECK_S)
        client.session.events.clear()


def fault_name(code: int) -> str:
    """Name of a fault code; "" for 0."""
    return wire.ERRORS.get(code, (f"code {code}",))[0] if code else ""


def raise_failure(client: Client, end: RunEnd | SequenceState) -> None:
    """Raise BoardError if a fault ended a run, or the board refused a motion of its sequence."""
    if isinstance(end, SequenceState):
        raise_sequence_failure(client, end)
    elif end.fault:
        said = "".join(f"; the board says: {text.strip()}" for text in readable(end.notices))
        raise refusal(f"a fault ended the motion{said}", end.fault, end.fault_joint)


def raise_sequence_failure(client: Client, end: SequenceState, program: bool = False) -> None:
    """Raise BoardError if a fault ended a sequence (or ``program``), or the board refused one of its motions."""
    what, place = ("program", f"in line {end.step}") if program else ("sequence", where(end))
    if end.ending == "fault" and program and end.code == wire.ERROR_CODES["underrun"]:
        raise BoardError(
            f"the program kept the board from its work {place} or after it, so that the steps ran out; the "
            "position is known",
            "let it call the cell while the arm moves, such as cell.sleep(0.001); then 'armtempo clear'",
            end.code,
        )
    if end.ending == "fault":
        raise refusal(f"a fault ended the {what} {place}", end.code, client.status().fault_joint)
    if end.ending == "refused":
        raise refusal(f"the {what} could not continue {place}", end.code)


def readable(notices: tuple[str, ...]) -> tuple[str, ...]:
    """The board's texts, with shortened names of a compiled program replaced by those of the source."""
    if not notices:
        return ()
    from armtempo.deploy.program_files import in_full  # imported here, because it reads the whole program

    return tuple(map(in_full, notices))


@checked
def permille(fraction: float) -> int:
    """A fraction of the planned speed, 0.01 to 1, in thousandths; raises InputError for another."""
    rate = round(fraction * PERMILLE)
    if not SLOWEST_PERMILLE <= rate <= PERMILLE:
        raise InputError(
            f"a speed of {fraction:g} times the planned one, {100 * fraction:g} %, is not allowed",
            f"give a fraction of {SLOWEST_PERMILLE / PERMILLE:g} to 1 (1 to 100 % on the command line); a faster "
            "motion needs a plan with higher limits",
        )
    return rate


def change_speed(client: Client, rate: int) -> None:
    """Set the speed of the running and of later motions to ``rate`` thousandths (0: pause, RESUME: end of the pause).

    Raises BoardError if nothing moves, or the board refuses.
    """
    client.speed(rate)
    if rate not in (0, RESUME):
        client.rate = rate
