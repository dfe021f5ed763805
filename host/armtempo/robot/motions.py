"""What moves the arm of a board: moves, jogs, runs, stops, the speed."""

from __future__ import annotations

import math
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, cast

from armtempo_shared.messages import RESUME

from armtempo.basics.arguments import checked_as
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.basics.progress import Progress
from armtempo.encoding import encoded_plan, made_with
from armtempo.encoding.encoded_plan import Encoded
from armtempo.link.board_messages import SequenceState
from armtempo.link.follow import MotionFollower, RunEnd, SequenceFollower, SequenceWatcher
from armtempo.model.plan import Plan
from armtempo.model.tool_pose import Pose
from armtempo.planning.jog.jog_motion import SPEED, by_of_joint, move_of, number_of_joint
from armtempo.report.run_folder import RunFolder
from armtempo.robot import arm_state, goto, jog, recording, running
from armtempo.robot.by_hand import HandGuided
from armtempo.robot.connection import Connection
from armtempo.robot.goto import Where, posture_deg
from armtempo.robot.jog import HeldJog
from armtempo.robot.recording import Watcher
from armtempo.robot.running import change_speed, permille
from armtempo.robot.stop_request import StopRequest
from armtempo.robot.store import store, stored_name

if TYPE_CHECKING:
    from armtempo.report.run import Run

MOST_REPETITIONS = 99
"""Their files are numbered with two digits."""


@checked_as("Board")
class Motions:
    """``Board.motions``: what moves the arm, and what it recorded."""

    def __init__(self, board: Connection) -> None:
        self._board = board
        self.last_jog_ends = ""
        """Why the last jog ended early; "" if it did not."""
        self._last_folder: Path | None = None
        self._last_sequence: Path | None = None

    def goto(
        self,
        where: Where | Pose,
        progress: Progress | None = None,
        stop: StopRequest | None = None,
        speed: float = 1.0,
        line: bool = False,
    ) -> None:
        """Move straight to a posture, all joints together within their limits; ``progress`` counts seconds.

        ``where``: a posture, a pose of the tool (its posture nearest to the present one), or a plan, sequence or
        its file (the start). ``speed``: fraction of the fastest
        move, 0.01 to 1. ``line``: move the tool in a straight line. Raises LinkError if the position is
        unknown, InputError for a posture that does not fit the arm, PlanError if the arm cannot follow the
        line.
        """
        permille(speed)  # raises InputError for an invalid speed
        arm = self._board.known_arm()
        target_deg = None if isinstance(where, Pose) else posture_deg(where, arm)
        with self._board.stoppable(stop) as wanted:
            self._board.start.home_virtual_arm(arm)
            if isinstance(where, Pose):
                from armtempo.planning import (
                    via_points,  # here, because a posture needs no inverse kinematics
                )

                target_deg = via_points.nearest(arm, where, self._posture_deg().tolist())
            assert target_deg is not None
            goto.go_to(self._board.client, arm, target_deg, wanted, progress, goto.MovePace(speed, line))

    def jog(
        self,
        joint: int | str | None = None,
        by_deg: float | None = None,
        axis: str | None = None,
        by_mm: float | None = None,
        speed: float = SPEED,
        stop: StopRequest | None = None,
    ) -> Array:
        """Move a joint or the tool: ``joint=2, by_deg=-5``, ``axis="z", by_mm=10``, or ``axis="z", by_deg=5``.

        A sliding joint: ``joint="lift", by_mm=10``. ``joint``: number (from 1) or name; ``axis``: "x", "y", "z" of
        the base, "tool-x", … of the tool or "tray-x", … of a frame of the arm: the tool moves along it by ``by_mm``,
        or turns about it by ``by_deg``; ``speed``: fraction of the speed limits, 0.01 to 1. The jog ends early at the
        end of a range, or if the tool cannot continue along the line (``last_jog_ends`` says why). Returns the
        posture in degrees and mm, (J,). Raises LinkError if the position is unknown, InputError if no motion in that
        direction is possible.
        """
        arm = self._board.known_arm()
        move = move_of(arm, joint, axis, by_deg, by_mm)
        with self._board.stoppable(stop) as wanted:
            self._board.start.home_virtual_arm(arm)
            self.last_jog_ends = jog.step(self._board.client, arm, move, speed, wanted).ends
        return self._posture_deg()

    def jog_to(
        self,
        joint: int | str,
        angle_deg: float | None = None,
        speed: float = SPEED,
        stop: StopRequest | None = None,
        *,
        position_mm: float | None = None,
    ) -> Array:
        """Move a joint to an angle, or a sliding one to ``position_mm``; nothing moves if it is there. The rest as in
        ``jog``."""
        arm = self._board.known_arm()
        moved = arm.driven[number_of_joint(arm, joint)]
        to, other = (position_mm, angle_deg) if moved.slides else (angle_deg, position_mm)
        if to is None or other is not None:
            raise InputError(
                f"{moved.name} moves to a position in {moved.unit.word}",
                f"give {'position_mm' if moved.slides else 'angle_deg'} alone",
            )
        self._board.start.home_virtual_arm(arm)
        distance = jog.distance_deg(self._posture_deg(), arm, joint, to)
        if distance:
            by_deg, by_mm = by_of_joint(arm, joint, distance)
            return self.jog(joint, by_deg, by_mm=by_mm, speed=speed, stop=stop)
        self.last_jog_ends = ""
        return self._posture_deg()

    def held_jog(
        self,
        joint: int | str | None = None,
        axis: str | None = None,
        direction: int = 1,
        turn: bool = False,
        speed: float = SPEED,
    ) -> HeldJog:
        """A jog towards the end of the range that continues only while its ``hold`` is called; use it in ``with``.

        ``direction``: 1 or -1; ``turn``: about ``axis`` instead of along it; the rest as in ``jog``. If the
        calls stop, the board brakes. Leaving the context brakes and waits for rest.
        """
        arm = self._board.known_arm()
        by = math.copysign(math.inf, direction)
        by_deg, by_mm = (by, None) if turn else (None, by)
        if joint is not None:
            by_deg, by_mm = by_of_joint(arm, joint, by)
        move = move_of(arm, joint, axis, by_deg, by_mm)
        self._board.start.home_virtual_arm(arm)
        return HeldJog(self._board.client, arm, jog.plan(self._board.client, arm, move, speed))

    def by_hand(self) -> HandGuided:
        """A context without motor current: move the arm by hand, and read the encoders with ``angles_deg()``.

        Hold the arm before: it sinks.

        Raises InputError for a driven joint without an encoder, LinkError if the position is unknown.
        """
        return HandGuided(self._board.client, self._board.known_arm())

    def run(
        self,
        motion: Plan | Encoded | Path | str,
        repeat: int = 1,
        out: Path | str = "runs",
        progress: Progress | None = None,
        watcher: Watcher | None = None,
        stop: StopRequest | None = None,
    ) -> Run:
        """Replay a motion ``repeat`` times, 1 to 99, or run a sequence, and record it in a new run folder in ``out``.

        ``motion``: a plan, its file (FILE.json), or the name of a motion or sequence on the board, which is refused
        if what it was planned with has changed since; a sequence takes neither ``repeat`` nor ``progress``. The arm
        must be homed and at the start; the arm of a virtual board is moved there. Between repetitions it returns
        along the same path. The speed is that of the last ``speed`` call. ``progress`` counts seconds of motion;
        ``watcher`` is called with folder, samples and repetitions. If the run ends early, it raises, and
        ``last_run`` holds the recording.
        Raises LinkError if the arm is not homed or not at the start, the board has another motion of this name
        (``upload`` can replace it), or is set up for another arm.
        """
        if not 1 <= repeat <= MOST_REPETITIONS:
            raise InputError(f"repeat: {repeat} is not in the range 1<=x<={MOST_REPETITIONS}", "change it")
        encoded = self._encoded(motion)
        if encoded.is_sequence and (repeat != 1 or progress is not None):
            raise InputError(
                "run: a sequence takes no repeat or progress", "leave them out; its steps repeat it"
            )
        seen = recording.ProgressWatcher(progress, repeat, watcher or Watcher())
        self._run(encoded, repeat, Path(out), seen, stop)
        return _load(cast(Path, self._last_folder))

    def run_sequence(
        self,
        sequence: Plan | Encoded | str,
        watcher: SequenceWatcher = lambda _: None,
        stop: StopRequest | None = None,
        replace: bool = False,
        out: Path | str | None = None,
    ) -> SequenceState:
        """Run a planned sequence, or the stored sequence of that name; returns its last state.

        Its rows and samples are recorded in a new run folder in ``out``; None: not recorded. ``watcher`` is
        called with each new state. The arm must be homed and at the start of the sequence, otherwise
        LinkError or BoardError; the arm of a virtual board is moved there. If a wait for an input times out,
        the sequence ends as ``timed_out`` or raises BoardError, as its step says. After Stopped,
        ``client.sequence()`` has the last state.
        """
        encoded = self._encoded(sequence)
        if not encoded.is_sequence:
            raise InputError(f"{encoded.name!r} is a motion, not a sequence", "run it with 'run'")
        seen = recording.StateWatcher(watcher)
        return cast(
            SequenceState, self._run(encoded, 1, None if out is None else Path(out), seen, stop, replace)
        )

    def _run(
        self,
        encoded: Encoded,
        repeat: int,
        out: Path | None,
        watcher: Watcher,
        stop: StopRequest | None,
        replace: bool = False,
    ) -> RunEnd | SequenceState:
        """Store and run it so often, backwards in between; returns how the last time ended.

        ``out``: recorded in a new run folder there; None: not recorded. Raises BoardError at a fault.
        """
        client, key = self._board.client, encoded.key
        self._board.configure_for(encoded.arm, encoded.plan)
        if encoded.plan is None:
            made_with.check_stored(encoded.name, encoded.data, encoded.arm)
        with self._board.stoppable(stop) as wanted:
            store(client, encoded.records, replace=replace)
            self._take_start(encoded, wanted)
            folder = None if out is None else self._new_folder(encoded, out)
            if folder is not None:
                watcher.begin(encoded, folder)
            back = encoded_plan.way_back(encoded) if repeat > 1 else b""
            for number in range(repeat):
                if number:
                    goto.move_once(client, back, wanted)
                wanted.check()
                recorder = None
                with ExitStack() as recorded:
                    if folder is not None:
                        repetition = recording.repetition(client, encoded, folder, watcher)
                        recorder = recorded.enter_context(repetition)
                    with running.attended(client, wanted):
                        run = client.start(key.name, key.crc)
                        follower: MotionFollower | SequenceFollower = (
                            SequenceFollower(client, key.name, run, watcher.on_state)
                            if encoded.is_sequence
                            else MotionFollower(client, run)
                        )
                        running.follow(
                            client, wanted, follower, recorder.take if recorder else running.nothing
                        )
                    if recorder:
                        recorder.end(follower.end, follower.lost, wanted.wanted)
                running.raise_failure(client, follower.end)
        return follower.end

    def _take_start(self, encoded: Encoded, stop: StopRequest) -> None:
        """Move a virtual arm to its start; raises LinkError if a real arm is not there."""
        name, advice = repr(encoded.name), "move it there with 'armtempo goto'"
        if encoded.is_sequence:
            name, advice = f"sequence {name}", f"{advice} and the sequence's file"
        self._board.start.take(encoded.arm, encoded.start_deg, name, advice, stop)

    def _new_folder(self, encoded: Encoded, out: Path) -> RunFolder:
        """A new run folder in ``out``, that of ``last_run`` and, of a sequence, of ``last_sequence``."""
        folder = recording.new_run(out, encoded, self._board.port, self._board.client)
        self._last_folder = folder.path
        if encoded.is_sequence:
            self._last_sequence = folder.path
        return folder

    @property
    def last_run(self) -> Run | None:
        """The last run that this object recorded, of a motion or a sequence, even if it ended early; None before the
        first."""
        return _load(self._last_folder) if self._last_folder else None

    @property
    def last_sequence(self) -> Run | None:
        """The last sequence that this object recorded, even if it ended early; None before the first."""
        return _load(self._last_sequence) if self._last_sequence else None

    def fetch(self, motion: Plan | Encoded | Path | str | None = None, out: Path | str = "runs") -> Run:
        """Write the samples that the board kept of its last run into a new run folder in ``out``.

        ``motion``: the motion of that run; None: the motion that the button starts. Waits for the end of a
        run that is still in progress. Raises LinkError if the board has no samples.
        """
        encoded = self._encoded(self._default() if motion is None else motion)
        if encoded.is_sequence:
            raise InputError(
                f"{encoded.name!r} is a sequence, not a motion",
                "record it with 'armtempo run' or run_sequence",
            )
        self._board.configure_for(encoded.arm, encoded.plan)
        folder = recording.fetch(self._board.client, encoded, Path(out), self._board.port)
        self._last_folder = folder.path
        return _load(folder.path)

    def stop(self, now: bool = False) -> None:
        """Brake along the path (``now``: freeze the outputs), and wait until the arm is at rest.

        For motions that no call of this object waits for, such as one started by the button. To stop ``run``,
        give it a ``StopRequest``.
        """
        running.stop(self._board.client, now)

    def request_stop(self, now: bool = False, by: str = "another thread") -> bool:
        """Stop a motion from a thread other than the one that waits for it, where Stopped is raised. Does not wait.

        ``by``: who asks for the stop, for messages. Returns whether something moved. Raises NoAnswerError if
        the board does not answer.
        """
        return running.request_stop(self._board.client, self._board.stops, now, by)

    def speed(self, fraction: float) -> None:
        """Set the speed as a fraction of the planned speed, 0.01 to 1, for the running and all later motions.

        The path does not change; a running motion changes its speed smoothly, within its brake time. Call it
        from a ``Watcher``, from a thread other than the one that waits in ``run``, or for a motion started by
        the button. Raises InputError for another fraction, BoardError if the board refuses.
        """
        change_speed(self._board.client, permille(fraction))

    def pause(self) -> None:
        """Bring the motion to rest on its path; ``resume`` continues it. Raises BoardError if nothing moves."""
        change_speed(self._board.client, 0)

    def resume(self) -> None:
        """Continue along the path at the speed before the pause; raises BoardError if nothing moves."""
        change_speed(self._board.client, RESUME)

    def _encoded(self, what: Plan | Encoded | Path | str) -> Encoded:
        """What a plan, its file or a name on the board stands for."""
        if isinstance(what, str) and not what.endswith(".json"):
            return encoded_plan.of_board(stored_name(what), self._board.known_arm(), self._board.client.fetch)
        return encoded_plan.of_any(what)

    def _default(self) -> str:
        for entry in self._board.client.stored():
            if entry.default:
                return entry.name
        raise InputError(
            "no motion given, and no default motion is set for the board's button",
            "give the motion's name: 'armtempo fetch NAME'; 'armtempo list' shows the names",
        )

    def _posture_deg(self) -> Array:
        return arm_state.posture_deg(self._board.client, self._board.known_arm())


def _load(folder: Path) -> Run:
    from armtempo.report.run import Run  # here, because moves read no run folder

    return Run.load(folder)
