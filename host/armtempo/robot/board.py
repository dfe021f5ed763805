"""A connected board: configure, home, move, replay, record, stop."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from armtempo_shared.messages import RESUME
from armtempo_shared.sequence import KIND_BYTES, MAGIC

from armtempo.basics.arguments import checked
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, LinkError
from armtempo.basics.progress import Progress
from armtempo.diagnosis.selftest import selftest
from armtempo.diagnosis.selftest.result import SelfTest
from armtempo.encoding import encoded_motion, encoded_sequence
from armtempo.encoding.encoded_motion import EncodedMotion, MotionKey
from armtempo.link import Client
from armtempo.link.board_messages import Hello, SequenceState, Status, StoredMotion
from armtempo.model.arm import Arm
from armtempo.model.job import NAME_RULE, is_name
from armtempo.model.plan import Plan
from armtempo.model.sequence_plan import SequencePlan
from armtempo.planning.jog.jog_motion import SPEED, move_of, number_of_joint
from armtempo.report.run import Run
from armtempo.report.sequence_reader import SequenceRun
from armtempo.robot import (
    arm_state,
    board_state,
    goto,
    homing,
    jog,
    kept_position,
    recording,
    sequence_recording,
    sequence_run,
    stored_motion,
)
from armtempo.robot.board_state import BoardState
from armtempo.robot.by_hand import HandGuided
from armtempo.robot.goto import Where, posture_deg
from armtempo.robot.homing import HomingProgress
from armtempo.robot.jog import HeldJog
from armtempo.robot.motor_test import MotorTest
from armtempo.robot.outputs import BoardInput, BoardOutput
from armtempo.robot.recording import Watcher
from armtempo.robot.sequence_run import SequenceWatcher
from armtempo.robot.speed import change_speed, permille
from armtempo.robot.stop_request import StopRequest, stoppable
from armtempo.robot.stored_motion import TURN_S

MOST_REPETITIONS = 99
"""Their files are numbered with two digits."""


@checked
class Board:
    """A board and the arm that it moves; ``connect`` gives one.

    Nothing moves before the arm's position is known (``home``), and a motion only starts if the arm is at its
    start (``goto``). Every method raises BoardError if the board refuses or a fault ends a motion, and
    LinkError if the board cannot be reached. Ctrl-C, or a ``StopRequest``, brakes a motion and raises
    Stopped.
    """

    def __init__(self, client: Client, port: str, stack: ExitStack | None = None) -> None:
        self.client = client
        """The protocol's commands one by one."""
        self.port = port
        self.arm: Arm | None = None
        """The arm that this object last set the board up for."""
        self.stops: list[StopRequest] = []
        """The stop requests of running calls of this object."""
        self.last_jog_ends = ""
        """Why the last jog ended early; "" if it did not."""
        self._stack = stack or ExitStack()
        self._start = goto.StartPosition(client, port)
        self._last_folder: Path | None = None
        self._last_sequence: Path | None = None

    def close(self) -> None:
        """Close the port; a virtual board ends. Other methods raise LinkError afterwards."""
        with self._last_turn():
            self._stack.close()

    @contextmanager
    def _last_turn(self) -> Iterator[None]:
        """While no other thread is within a command: it would open a port again that was closed under it.

        One that waits longer, for a cable that is out, finds that the board is closed.
        """
        with self.client.session.in_a_hurry(TURN_S):
            kept_position.keep(self.client, self.port)
            self.client.session.guard(self._closed)
            yield

    def _closed(self) -> None:
        raise LinkError(f"the board on {self.port} was closed", "open it again with armtempo.connect")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            with self._last_turn():
                self._stack.__exit__(kind, value, trace)
        finally:
            self.close()

    @property
    def info(self) -> Hello:
        """The board's identity: program, protocol, arm record, memory, step rates."""
        return self.client.info

    def status(self) -> Status:
        """The board's state, its fault, and the joints' positions in steps and counts."""
        return self.client.status()

    def state(self, arm: Arm | Path | str | None = None) -> BoardState:
        """``info`` and ``status`` in one object, with the joints' names and angles in degrees.

        ``arm``: used if the board is set up for it; None: ``self.arm``.
        """
        return board_state.read(self.client, self.port).named(self.arm if arm is None else Arm.of(arm))

    def configure(self, arm: Arm | Path | str, replace: bool = False) -> None:
        """Set the board up for ``arm``: an object, its file, or the name of a shipped arm.

        ``replace``: replace another arm's record. All positions are unknown afterwards, unless only limits
        differ; stored motions of the other record are refused. Raises LinkError if the board has another
        record and ``replace`` is false, InputError if a value of the arm does not fit the board.
        """
        arm = Arm.of(arm)
        arm_state.configure(self.client, arm, replace)
        self.arm = arm

    # what it keeps

    def upload(
        self,
        motion: Plan | EncodedMotion | Path | str,
        name: str | None = None,
        default: bool = False,
        progress: Progress | None = None,
        replace: bool = False,
    ) -> EncodedMotion:
        """Store a motion, unless the board already has it; ``progress`` counts bytes.

        ``motion``: a plan or its file. ``name``: on the board; default: from the job's name. ``default``: let
        the board's button start it. ``replace``: replace another motion of this name; if that was the
        default, the button starts nothing. Raises LinkError if there is such a motion and ``replace`` is
        false, or the board is set up for another arm.
        """
        if isinstance(motion, Path | str):
            motion = Plan.load(motion)
        encoded = encoded_motion.of_plan(motion, name) if isinstance(motion, Plan) else motion
        self.configure(encoded.arm)
        stored_motion.store(self.client, encoded.name, encoded.data, progress, replace)
        if default:
            self.client.set_default(encoded.name)
        return encoded

    def upload_sequence(
        self,
        sequence: SequencePlan,
        default: bool = False,
        progress: Progress | None = None,
        replace: bool = False,
    ) -> MotionKey:
        """Store a planned sequence and its motions; arguments and errors as in ``upload``."""
        encoded = encoded_sequence.of_plan(sequence)
        self.configure(encoded.arm)
        key = sequence_run.store(self.client, encoded, progress, replace)
        if default:
            self.client.set_default(key.name)
        return key

    def list(self) -> tuple[StoredMotion, ...]:
        """The stored motions and sequences."""
        return tuple(self.client.stored())

    def read(self, name: str, arm: Arm | Path | str | None = None) -> EncodedMotion:
        """Read a stored motion back.

        ``arm``: the arm it was made for; default: the board's. Raises InputError if the record is damaged or
        does not fit the arm.
        """
        data = self.client.fetch(self._stored_name(name))
        if data.startswith(MAGIC[:KIND_BYTES]):
            raise InputError(f"{name!r} is a sequence, not a motion", f"run it with: armtempo run {name}")
        return encoded_motion.of_record(name, data, self._known_arm() if arm is None else Arm.of(arm))

    def _stored_name(self, name: str) -> str:
        """``name`` if it is valid for a stored motion; raises InputError otherwise."""
        if not is_name(name):
            raise InputError(
                f"{name!r} is not a valid name of a motion on the board",
                f"give the name of a stored motion: {NAME_RULE}; armtempo.Plan.load reads a file",
            )
        return name

    def remove(self, name: str) -> None:
        """Remove a stored motion."""
        self.client.remove(self._stored_name(name))

    def rename(self, old: str, new: str) -> None:
        """Give a stored motion another name."""
        self.client.rename(self._stored_name(old), self._stored_name(new))

    def set_default(self, name: str) -> None:
        """Set the motion or sequence that the board's button starts; "" for none."""
        self.client.set_default(self._stored_name(name) if name else name)

    # where the arm is

    def home(self, arm: Arm | Path | str, where: Where | None = None, joint: int | str | None = None) -> None:
        """Declare that ``arm`` is at ``where`` (default: its home posture); nothing moves.

        ``joint``: number (from 1) or name of the only joint, with those that are coupled with it, that is declared to
        be at its home angle. Raises InputError for a posture that does not fit the arm, a joint that it does not have,
        or a posture and a joint, LinkError if the board is set up for another arm.
        """
        arm = Arm.of(arm)
        if joint is not None and where is not None:
            raise InputError("a posture and a joint exclude each other", "give one of them")
        number = None if joint is None else number_of_joint(arm, joint)
        self.configure(arm)
        if number is None:
            arm_state.home(self.client, arm, None if where is None else posture_deg(where, arm))
        else:
            arm_state.home_joint(self.client, arm, number)

    def home_to_switches(
        self,
        arm: Arm | Path | str,
        stop: StopRequest | None = None,
        joint: int | str | None = None,
        progress: HomingProgress | None = None,
    ) -> None:
        """Home the joints that have a switch of known angle: to it, off it, slowly to it again, to their home angle.

        ``joint``: number (from 1) or name of the only one, with those that are coupled with it. ``progress``: called
        with what happens and how many of the joints are at home. Raises InputError if no joint has such a switch,
        LinkError if a switch does not trip.
        """
        arm = Arm.of(arm)
        number = None if joint is None else number_of_joint(arm, joint)
        self.configure(arm)
        with self._stoppable(stop) as wanted:
            self._start.moved = True
            homing.home_to_switches(self.client, arm, wanted, number, progress or homing.silent)

    def posture_deg(self) -> Array:
        """Joint angles from the commanded steps, degrees (J,); raises LinkError if a position is unknown."""
        return arm_state.posture_deg(self.client, self._known_arm())

    # outputs and inputs

    def output(self, name: str) -> BoardOutput:
        """An output of the arm by name; raises InputError if the arm has no such output or is not known."""
        return BoardOutput(self.client, self._configured_arm(), name)

    def input(self, name: str) -> BoardInput:
        """An input of the arm by name; raises as ``output``."""
        return BoardInput(self.client, self._configured_arm(), name)

    # moving

    def goto(
        self,
        where: Where,
        progress: Progress | None = None,
        stop: StopRequest | None = None,
        speed: float = 1.0,
        line: bool = False,
    ) -> None:
        """Move straight to a posture, all joints together within their limits; ``progress`` counts seconds.

        ``where``: a posture, or a plan, sequence or its file (the start). ``speed``: fraction of the fastest
        move, 0.01 to 1. ``line``: move the tool in a straight line. Raises LinkError if the position is
        unknown, InputError for a posture that does not fit the arm, PlanError if the arm cannot follow the
        line.
        """
        permille(speed)  # raises InputError for an invalid speed
        arm = self._known_arm()
        target_deg = posture_deg(where, arm)
        with self._stoppable(stop) as wanted:
            self._start.home_virtual_arm(arm)
            goto.go_to(self.client, arm, target_deg, wanted, progress, goto.MovePace(speed, line))

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

        ``joint``: number (from 1) or name; ``axis``: "x", "y", "z" of the base or "tool-x", "tool-y",
        "tool-z": the tool moves along it by ``by_mm``, or turns about it by ``by_deg``; ``speed``: fraction
        of the speed limits, 0.01 to 1. The jog ends early at the end of a range, or if the tool cannot
        continue along the line (``last_jog_ends`` says why). Returns the posture in degrees, (J,). Raises
        LinkError if the position is unknown, InputError if no motion in that direction is possible.
        """
        arm = self._known_arm()
        move = move_of(arm, joint, axis, by_deg, by_mm)
        with self._stoppable(stop) as wanted:
            self._start.home_virtual_arm(arm)
            self.last_jog_ends = jog.step(self.client, arm, move, speed, wanted).ends
        return self.posture_deg()

    def jog_to(
        self, joint: int | str, angle_deg: float, speed: float = SPEED, stop: StopRequest | None = None
    ) -> Array:
        """Move a joint to an angle; nothing moves if it is there. The rest as in ``jog``."""
        arm = self._known_arm()
        self._start.home_virtual_arm(arm)
        by_deg = jog.distance_deg(self.posture_deg(), arm, joint, angle_deg)
        if by_deg:
            return self.jog(joint, by_deg, speed=speed, stop=stop)
        self.last_jog_ends = ""
        return self.posture_deg()

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
        arm = self._known_arm()
        by = math.copysign(math.inf, direction)
        along = None if turn or joint is not None else by
        move = move_of(arm, joint, axis, None if along else by, along)
        self._start.home_virtual_arm(arm)
        return HeldJog(self.client, arm, jog.plan(self.client, arm, move, speed))

    def by_hand(self) -> HandGuided:
        """A context without motor current: move the arm by hand, and read the encoders with ``angles_deg()``.

        Hold the arm before: it sinks.

        Raises InputError for a driven joint without an encoder, LinkError if the position is unknown.
        """
        return HandGuided(self.client, self._known_arm())

    def run(
        self,
        motion: Plan | EncodedMotion | Path | str,
        repeat: int = 1,
        out: Path | str = "runs",
        progress: Progress | None = None,
        watcher: Watcher | None = None,
        stop: StopRequest | None = None,
    ) -> Run:
        """Replay a motion ``repeat`` times, 1 to 99, and record it in a new run folder in ``out``.

        ``motion``: a plan, its file (FILE.json), or the name of a motion on the board. The arm must be homed
        and at the start of the motion; the arm of a virtual board is moved there. Between repetitions it
        returns along the same path. The speed is that of the last ``speed`` call. ``progress`` counts seconds
        of motion; ``watcher`` is called with folder, samples and repetitions. If the run ends early, it
        raises, and ``last_run`` holds the recording. Raises LinkError if the arm is not homed or not at the
        start, the board has another motion of this name (``upload`` can replace it), or is set up for another
        arm.
        """
        if not 1 <= repeat <= MOST_REPETITIONS:
            raise InputError(f"repeat: {repeat} is not in the range 1<=x<={MOST_REPETITIONS}", "change it")
        encoded = self._encoded(motion)
        seen = recording.ProgressWatcher(progress, repeat, watcher or Watcher())
        with self._stoppable(stop) as wanted:
            self._bring_to_start(encoded, wanted)
            folder = recording.new_run(Path(out), encoded, self.port, self.client)
            self._last_folder = folder.path
            seen.begin(encoded, folder)
            for _ in recording.repeat(self.client, encoded, folder, repeat, wanted, seen):
                pass
        return Run.load(folder.path)

    def run_sequence(
        self,
        sequence: SequencePlan | str,
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
        with self._stoppable(stop) as wanted:
            key = self._sequence(sequence, wanted, replace)
            if out is None:
                return sequence_run.run(self.client, key, wanted, watcher)
            content = (
                sequence_recording.fetched(self.client, sequence, self._known_arm())
                if isinstance(sequence, str)
                else sequence_recording.of_plan(sequence)
            )
            with sequence_recording.recorder(self.client, content, Path(out), self.port) as recorder:
                self._last_sequence = recorder.path
                return sequence_run.run(self.client, key, wanted, watcher, recorder)

    @property
    def counters(self) -> dict[str, int]:
        """Counters of the running or the last sequence, by name.

        A start of a sequence sets them to 0; a power cycle loses them.
        """
        return self.client.counters()

    def _sequence(self, sequence: SequencePlan | str, stop: StopRequest, replace: bool) -> MotionKey:
        """Store the sequence if it is a plan, and move a virtual arm to its start; returns its key."""
        if isinstance(sequence, str):
            found = self.client.find(self._stored_name(sequence))
            if found is None or not found.sequence:
                raise InputError(f"the board has no sequence {sequence!r}", "see 'armtempo list'")
            if self.arm is not None:
                self._start.home_virtual_arm(self.arm)
            return MotionKey(found.name, found.crc)
        key = self.upload_sequence(sequence, replace=replace)
        self._start.take(
            sequence.arm,
            None if sequence.start_deg is None else np.array(sequence.start_deg),
            f"sequence {sequence.name!r}",
            "move it there with 'armtempo goto' and the sequence's file",
            stop,
        )
        return key

    @property
    def last_run(self) -> Run | None:
        """The last run that this object recorded, even if it ended early; None before the first."""
        return Run.load(self._last_folder) if self._last_folder else None

    @property
    def last_sequence(self) -> SequenceRun | None:
        """The last sequence that this object recorded, even if it ended early; None before the first."""
        return SequenceRun.load(self._last_sequence) if self._last_sequence else None

    def fetch(self, motion: Plan | EncodedMotion | Path | str | None = None, out: Path | str = "runs") -> Run:
        """Write the samples that the board kept of its last run into a new run folder in ``out``.

        ``motion``: the motion of that run; None: the motion that the button starts. Waits for the end of a
        run that is still in progress. Raises LinkError if the board has no samples.
        """
        encoded = self._encoded(self._default() if motion is None else motion)
        folder = recording.fetch(self.client, encoded, Path(out), self.port)
        self._last_folder = folder.path
        return Run.load(folder.path)

    def stop(self, now: bool = False) -> None:
        """Brake along the path (``now``: freeze the outputs), and wait until the arm is at rest.

        For motions that no call of this object waits for, such as one started by the button. To stop ``run``,
        give it a ``StopRequest``.
        """
        stored_motion.stop(self.client, now)

    def request_stop(self, now: bool = False, by: str = "another thread") -> bool:
        """Stop a motion from a thread other than the one that waits for it, where Stopped is raised. Does not wait.

        ``by``: who asks for the stop, for messages. Returns whether something moved. Raises NoAnswerError if
        the board does not answer.
        """
        return stored_motion.request_stop(self.client, self.stops, now, by)

    def speed(self, fraction: float) -> None:
        """Set the speed as a fraction of the planned speed, 0.01 to 1, for the running and all later motions.

        The path does not change; a running motion changes its speed smoothly, within its brake time. Call it
        from a ``Watcher``, from a thread other than the one that waits in ``run``, or for a motion started by
        the button. Raises InputError for another fraction, BoardError if the board refuses.
        """
        change_speed(self.client, permille(fraction))

    def pause(self) -> None:
        """Bring the motion to rest on its path; ``resume`` continues it. Raises BoardError if nothing moves."""
        change_speed(self.client, 0)

    def resume(self) -> None:
        """Continue along the path at the speed before the pause; raises BoardError if nothing moves."""
        change_speed(self.client, RESUME)

    def selftest(self, progress: Progress | None = None) -> SelfTest:
        """Let the board measure itself with its drivers off; ``progress`` reports the progress.

        The board is reset at the end, and its positions are unknown. Raises LinkError, before anything is
        done, if the drivers are on, a motion runs, or the program is not built into the board's firmware.
        """
        return selftest.run(self.client, progress)

    def motor_test(
        self, arm: Arm | Path | str, ask: Callable[[str], bool], tell: Callable[[str], object] = print
    ) -> SelfTest:
        """Test directions, encoders, switches and E-stop: each joint moves slowly up to a degree there and back.

        ``ask`` asks the person at the arm (first, whether the listed joints may move) and returns True for
        yes; ``tell`` prints what to press. The result's ``data["arm_file"]`` has the lines to correct in the
        arm file. Raises ArmtempoError without a yes, LinkError if a position is unknown, both before anything
        moves.
        """
        arm = Arm.of(arm)
        self.configure(arm)
        self._start.home_virtual_arm(arm)
        with self._stoppable(None) as stop:
            return MotorTest(self.client, arm, stop, ask, tell).run()

    def clear(self) -> None:
        """Clear a fault; raises BoardError while its cause persists."""
        self.client.clear()

    @contextmanager
    def _stoppable(self, given: StopRequest | None) -> Iterator[StopRequest]:
        """As ``stoppable``; other programs can request this stop too."""
        with stoppable(given) as wanted:
            self.stops.append(wanted)
            try:
                yield wanted
            finally:
                self.stops.remove(wanted)

    def _known_arm(self) -> Arm:
        if self.arm is None:
            raise InputError("no arm is set", "set it with home(arm) or configure(arm)")
        return self.arm

    def _configured_arm(self) -> Arm:
        arm = self._known_arm()
        self.configure(arm)
        return arm

    def _encoded(self, motion: Plan | EncodedMotion | Path | str) -> EncodedMotion:
        """The motion for a board that is set up for its arm."""
        if isinstance(motion, Path) or (isinstance(motion, str) and motion.endswith(".json")):
            motion = Plan.load(motion)
        if isinstance(motion, str):
            return self.read(motion)
        encoded = encoded_motion.of_plan(motion) if isinstance(motion, Plan) else motion
        self.configure(encoded.arm)
        return encoded

    def _default(self) -> str:
        for entry in self.client.stored():
            if entry.default:
                return entry.name
        raise InputError(
            "no motion given, and no default motion is set for the board's button",
            "give the motion's name: armtempo fetch NAME; 'armtempo list' shows the names",
        )

    def _bring_to_start(self, motion: EncodedMotion, stop: StopRequest) -> None:
        """Store the motion; move a virtual arm to its start; raises LinkError if a real arm is not there."""
        stored_motion.store(self.client, motion.name, motion.data)
        advice = "move it there with 'armtempo goto'"
        self._start.take(motion.arm, motion.start_deg, repr(motion.name), advice, stop)
