"""What is done with a board: give it the arm, store a motion, home, replay, go to a posture."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from armtempo_shared import limits, wire

from armtempo.errors import BoardError, LinkError
from armtempo.link import Board
from armtempo.link.board import Progress
from armtempo.link.follow import CHECK_S, Follower, RunEnd
from armtempo.link.messages import Sample
from armtempo.link.refusal import refusal
from armtempo.link.session import RECONNECT_S, NoAnswer, OtherBoard
from armtempo.model.arm import Arm
from armtempo.planning import brake_time, point_to_point
from armtempo.records import encode
from armtempo.robot.stop_request import StopRequest
from armtempo.runs.run_folder import COMPLETE, FAULT, INTERRUPTED, RunFolder
from armtempo.splines.bspline import Array
from armtempo.splines.trajectory import Trajectory

Take = Callable[[Sample, float], None]
"""Gets each sample and the length of the motion in seconds."""

BRAKE_S = 5.0
"""Braking takes no longer than this; then the board is told to freeze."""
FREEZE_S = 2.0
"""Freezing takes no longer than this."""
TEMPORARY = "tmp-"
"""Names of motions that are removed after use begin so."""


@dataclass(frozen=True)
class Stored:
    """A motion on the board, known by name and checksum."""

    name: str
    crc: int


def configure(board: Board, arm: Arm, replace: bool) -> None:
    """Make sure the board has this arm's record; a new one makes all positions unknown.

    Raises LinkError where the board is set up for another arm and ``replace`` is false, BoardError where
    it is moving.
    """
    data = encode.arm_record(arm)
    assert board.info is not None  # greeted
    if board.info.arm_crc == wire.record_crc(data):
        return
    if board.info.arm_crc and not replace:
        raise LinkError(
            f"the board is set up for another arm than {arm.name!r} ({arm.source}); "
            "name its arm file with --arm"
        )
    board.upload(wire.ARM_RECORD_NAME, data)
    board.hello()


def motion_data(trajectory: Trajectory, arm: Arm) -> bytes:
    """The record of a motion that the board can brake anywhere."""
    limits_of = [joint.limits for joint in arm.driven if joint.limits is not None]
    return encode.motion_record(trajectory, arm, brake_time.brake_time_s(trajectory, limits_of))


def store(board: Board, name: str, data: bytes, progress: Progress | None = None) -> Stored:
    """Upload a motion record under ``name``, unless the board has just this one already."""
    stored = Stored(name, wire.record_crc(data))
    found = board.find(name)
    if found is None or found.crc != stored.crc:
        board.upload(name, data, progress)
    return stored


def replay(
    board: Board, motion: Stored, stop: StopRequest, take: Take = lambda *_: None, flags: int = 0
) -> RunEnd:
    """Start a stored motion and follow it to its end; a stop request makes the board brake.

    Whatever fails here stops the board. Raises BoardError where the board refuses to start, LinkError where it
    cannot be reached any more, KeyboardInterrupt where the stop request was there before.
    """
    board.session.hurried = lambda: stop.wanted
    if stop.wanted:
        raise KeyboardInterrupt
    run, duration_s = board.start(motion.name, motion.crc, flags)
    follower = Follower(board, run)
    braking = _Brake(board, stop)
    try:
        return _follow(board, follower, braking, take, duration_s)
    except OtherBoard as error:
        raise LinkError(f"{error}; what came after the last sample cannot be known") from error


def _follow(board: Board, follower: Follower, braking: _Brake, take: Take, duration_s: float) -> RunEnd:
    heard_s = board.session.clock()
    while follower.end is None:
        try:
            for sample in follower.samples(braking):
                heard_s = board.session.clock()
                take(sample, duration_s)
        except OtherBoard:
            raise
        except NoAnswer as error:  # silent, though its port is there: as if the cable were out
            if not board.session.hurried():  # else the stop goes on, until it is given up
                if board.session.clock() - heard_s > RECONNECT_S:
                    raise
                board.session.reconnect(error)
        except BaseException as error:
            _stop_after(board, error)
            raise
    return follower.end


def _stop_after(board: Board, error: BaseException) -> None:
    """Stop what is moving because of ``error``, as far as the board can be reached."""
    if isinstance(error, BoardError) and error.code == wire.ERROR_CODES["no_session"]:
        raise LinkError(
            "the board started anew during the motion: where the arm stands and what came after the last "
            "sample cannot be known; find the cause, then 'armtempo home'"
        ) from error
    board.session.reopen = None  # a cable that is out is not waited for
    with suppress(LinkError):  # the first error says more
        board.stop(now=isinstance(error, KeyboardInterrupt))


class _Brake:
    """Called between two messages: passes a stop request on; freezes a board that does not come to rest."""

    def __init__(self, board: Board, stop: StopRequest, now: bool = False) -> None:
        self._board = board
        self._stop = stop
        brake_s = 0.0 if now else BRAKE_S
        self._steps: list[tuple[float, Callable[[], None]]] = [
            (0.0, lambda: stop_moving(board, now)),
            (brake_s, lambda: stop_moving(board, now=True)),
            (brake_s + FREEZE_S, _does_not_stop),
        ]
        self._told_s = 0.0

    def __call__(self) -> None:
        if not self._stop.wanted:
            return
        now_s = self._board.session.clock()
        self._told_s = self._told_s or now_s
        if self._steps and now_s - self._told_s >= self._steps[0][0]:
            self._steps.pop(0)[1]()


def _does_not_stop() -> None:
    raise LinkError("the board was told to stop and does not; switch off the motors' power")


def stop_moving(board: Board, now: bool = False) -> None:
    """Brake along the path, or freeze; nothing happens where nothing moves."""
    try:
        board.stop(now)
    except BoardError as error:
        if error.code != wire.ERROR_CODES["not_moving"]:
            raise


def stop(board: Board, now: bool) -> None:
    """Stop and wait until the arm rests; LinkError where it does not come to rest."""
    request = StopRequest()
    request.wanted = True
    stopping = _Brake(board, request, now)
    stopping()
    while board.status().moving:
        stopping()
        board.session.poll(CHECK_S)
        board.session.events.clear()


def replay_recorded(
    board: Board, motion: Stored, folder: RunFolder, stop: StopRequest, watch: Take = lambda *_: None
) -> RunEnd:
    """One repetition into the run folder, however it ends; ``watch`` sees each sample too."""
    with folder.begin_repetition() as file:

        def take(sample: Sample, duration_s: float) -> None:
            file.append(sample)
            watch(sample, duration_s)

        end = replay(board, motion, stop, take)
        state = FAULT if end.fault else INTERRUPTED if stop.wanted else COMPLETE
        file.repetition.end(state, fault_name(end.fault), end.ticks, end.stand, end.lost)
        file.repetition.notices = _readable(end.notices)
    return end


def fault_name(code: int) -> str:
    """Name of a fault code; "" for 0."""
    return wire.ERRORS.get(code, (f"code {code}",))[0] if code else ""


def raise_fault(end: RunEnd) -> None:
    """Raise BoardError, with the sentence for the fault, where a run ended by one."""
    if end.fault:
        said = "".join(f"; the board says: {text.strip()}" for text in _readable(end.notices))
        raise refusal(f"the motion ended by a fault{said}", end.fault, end.fault_joint)


def _readable(notices: tuple[str, ...]) -> tuple[str, ...]:
    """Notices with the names of the source, where the board has the compiled program."""
    if not notices:
        return ()
    from armtempo.deploy.program import in_full  # reads the whole program: only where it is needed

    return tuple(map(in_full, notices))


def posture_deg(board: Board, arm: Arm) -> Array:
    """Where the joints stand by the steps commanded, degrees (J,); LinkError where that is unknown."""
    status = board.status()
    unknown = [joint.name for index, joint in enumerate(arm.driven) if not status.joint_known(index)]
    if unknown:
        raise LinkError(
            f"the position of {', '.join(unknown)} is unknown; bring the arm to its home posture and run "
            "'armtempo home'"
        )
    return np.array(status.stand.commanded_steps, dtype=float) / _steps_per_deg(arm)


def home(board: Board, arm: Arm, angles_deg: Array | None = None) -> None:
    """Declare that the arm stands at ``angles_deg`` (J,), or at the arm file's home posture."""
    posture = home_deg(arm) if angles_deg is None else point_to_point.posture(angles_deg, arm)
    board.home([round(steps) for steps in posture * _steps_per_deg(arm)])


def home_deg(arm: Arm) -> Array:
    """The arm file's home posture, degrees (J,)."""
    return np.array([joint.home_deg for joint in arm.driven])


def stands_at(board: Board, arm: Arm, target_deg: Array) -> bool:
    """Whether the arm stands within half a step of ``target_deg`` (J,)."""
    return bool(np.all(np.abs(posture_deg(board, arm) - target_deg) * _steps_per_deg(arm) <= 0.5))


def go_to(
    board: Board, arm: Arm, target_deg: Array, stop: StopRequest, progress: Progress | None = None
) -> None:
    """Move straight to a posture (J,) within the limits; nothing happens where the arm stands there.

    Raises BoardError where the board refuses or a fault ends the move.
    """
    if not stands_at(board, arm, target_deg):
        here = posture_deg(board, arm)
        move_once(
            board, arm, point_to_point.straight(TEMPORARY + "goto", here, target_deg, arm), stop, progress
        )


def move_once(
    board: Board, arm: Arm, trajectory: Trajectory, stop: StopRequest, progress: Progress | None = None
) -> None:
    """Run a motion that is not kept on the board; BoardError where a fault ends it."""
    motion = store(board, trajectory.name, motion_data(trajectory, arm))
    try:
        raise_fault(replay(board, motion, stop, shown(progress)))
    finally:
        with suppress(LinkError):  # an earlier error says more
            board.remove(motion.name)


def shown(progress: Progress | None) -> Take:
    """A watcher that shows how far the motion is."""

    def show(sample: Sample, duration_s: float) -> None:
        if progress is not None:
            progress(sample.ticks / limits.TICK_HZ, duration_s)

    return show


def _steps_per_deg(arm: Arm) -> Array:
    return np.array([encode.steps_per_deg(joint) for joint in arm.driven])
