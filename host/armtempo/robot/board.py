"""A board in use: everything that can be done with it, from its arm to a recorded run."""

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
from armtempo.link import Client
from armtempo.link.board_messages import Hello, SequenceState, Status, StoredMotion
from armtempo.model.arm import Arm
from armtempo.model.job import NAME_RULE, is_name
from armtempo.model.plan import Plan
from armtempo.model.sequence_plan import SequencePlan
from armtempo.planning.jog.jog_motion import SPEED, move_of
from armtempo.records import encoded_motion, encoded_sequence
from armtempo.records.encoded_motion import EncodedMotion, MotionKey
from armtempo.robot import (
    arm_state,
    board_state,
    goto,
    homing,
    jog,
    recording,
    sequence_recording,
    sequence_run,
    stored_motion,
)
from armtempo.robot.board_state import BoardState
from armtempo.robot.by_hand import HandGuided
from armtempo.robot.jog import HeldJog
from armtempo.robot.motor_test import MotorTest
from armtempo.robot.outputs import BoardInput, BoardOutput
from armtempo.robot.recording import Watcher
from armtempo.robot.run import Run
from armtempo.robot.sequence_run import SequenceWatcher
from armtempo.robot.speed import change_speed, permille
from armtempo.robot.stop_request import StopRequest, stoppable
from armtempo.robot.stored_motion import TURN_S
from armtempo.robot.where import Where, posture_deg
from armtempo.runs.sequence_reader import SequenceRun
from armtempo.selftest import selftest
from armtempo.selftest.result import SelfTest

_MOST_REPETITIONS = 99
"""Their files are numbered with two digits."""


@checked
class Board:
    """A board and the arm that it moves; ``connect`` gives one.

    Nothing moves before the arm's position is known (``home``), and a motion only starts from where it begins
    (``goto``). Every method raises BoardError if the board refuses or a fault ends a motion, LinkError
    where it cannot be reached. What moves stops at Ctrl-C, and with Stopped at a ``StopRequest``.
    """

    def __init__(self, client: Client, port: str, stack: ExitStack | None = None) -> None:
        self.client = client
        """The protocol's commands one by one."""
        self.port = port
        self.arm: Arm | None = None
        """The arm that the board was last set up for through this object."""
        self.stops: list[StopRequest] = []
        """The stop requests of what this object has under way."""
        self.last_jog_ends = ""
        """Why the last jog ended before it was to, in words; "" if it did not."""
        self._stack = stack or ExitStack()
        self._start = goto.StartPosition(client, port)
        self._last_folder: Path | None = None
        self._last_sequence: Path | None = None

    def close(self) -> None:
        """Free the port; a virtual board ends. Nothing else can be done with this object then."""
        with self._last_turn():
            self._stack.close()

    @contextmanager
    def _last_turn(self) -> Iterator[None]:
        """While no other thread is within a command: it would open a port again that was closed under it.

        One that waits longer, for a cable that is out, finds that the board is closed.
        """
        with self.client.session.in_a_hurry(TURN_S):
            self.client.session.check = self._closed
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
        """Who the board is: program, protocol, arm record, room, step rates."""
        return self.client.info

    def status(self) -> Status:
        """What the board is doing, its fault, and where the joints are in steps and counts."""
        return self.client.status()

    def state(self, arm: Arm | Path | str | None = None) -> BoardState:
        """The same with what the board says of itself, in degrees and with the names of the joints.

        ``arm``: where the board is set up for it; None: the one that was named to this object.
        """
        return board_state.read(self.client, self.port).named(self.arm if arm is None else Arm.of(arm))

    def configure(self, arm: Arm | Path | str, replace: bool = False) -> None:
        """Make sure that the board has this arm's record; ``arm``: or its file, or the name of one that ships.

        ``replace``: put it in the place of another one. All positions are unknown then, unless the two differ
        in limits alone; stored motions of the other record are refused. Raises LinkError if the board has
        another record and ``replace`` is false, InputError if a figure of the arm does not fit the board.
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
        """Store a motion, unless the board has just this one already; ``progress`` counts bytes.

        ``motion``: a plan or its file. ``name``: on the board, else made of the job's name. ``default``: let the
        board's button start it. ``replace``: also in the place of another motion of this name, which the button then
        starts no longer. Raises LinkError if there is such a motion, or the board is set up for another arm.
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
        """Store a planned sequence and its motions, unless the board has just these; as ``upload`` for a motion."""
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
        """A stored motion of ``arm``, else of the arm that the board is set up for, read back.

        InputError if the record is damaged or does not fit the arm.
        """
        data = self.client.fetch(self._stored_name(name))
        if data.startswith(MAGIC[:KIND_BYTES]):
            raise InputError(f"{name!r} is a sequence, not a motion", f"run it with: armtempo run {name}")
        return encoded_motion.of_record(name, data, self._known_arm() if arm is None else Arm.of(arm))

    def _stored_name(self, name: str) -> str:
        """The name, where it can be one: InputError with what is meant else."""
        if not is_name(name):
            raise InputError(
                f"{name!r} is not a valid name of a motion on the board",
                f"give the name of a stored one: {NAME_RULE}; armtempo.Plan.load reads a file",
            )
        return name

    def remove(self, name: str) -> None:
        """Remove a stored motion."""
        self.client.remove(self._stored_name(name))

    def rename(self, old: str, new: str) -> None:
        """Give a stored motion another name."""
        self.client.rename(self._stored_name(old), self._stored_name(new))

    def set_default(self, name: str) -> None:
        """What the board's button starts; "" for nothing."""
        self.client.set_default(self._stored_name(name) if name else name)

    # where the arm is

    def home(self, arm: Arm | Path | str, where: Where | None = None) -> None:
        """Declare that ``arm`` is at ``where``, or at its home posture; nothing moves.

        Raises InputError for a posture that does not fit the arm, LinkError if the board is set up for another.
        """
        arm = Arm.of(arm)
        self.configure(arm)
        arm_state.home(self.client, arm, None if where is None else posture_deg(where, arm))

    def home_to_switches(self, arm: Arm | Path | str, stop: StopRequest | None = None) -> None:
        """Home the joints that have a switch of known angle: to it, off it, slowly to it again, to their home angle.

        Raises InputError if no joint has one, LinkError if a switch does not trip.
        """
        arm = Arm.of(arm)
        self.configure(arm)
        with self._stoppable(stop) as wanted:
            self._start.moved = True
            homing.home_to_switches(self.client, arm, wanted)

    def posture_deg(self) -> Array:
        """Where the joints are by the steps commanded, degrees (J,); LinkError if that is unknown."""
        return arm_state.posture_deg(self.client, self._known_arm())

    # outputs and inputs

    def output(self, name: str) -> BoardOutput:
        """An output of the arm by its name; InputError if the arm has none of this name or is not known."""
        return BoardOutput(self.client, self._configured_arm(), name)

    def input(self, name: str) -> BoardInput:
        """An input of the arm by its name; raises as ``output``."""
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

        ``where``: also the file of a plan, for where it begins. ``speed``: part of the quickest, 0.01 to 1.
        ``line``: the tool goes in a straight line. Raises LinkError if the position is unknown, InputError for a
        posture that does not fit the arm, PlanError if the arm cannot follow the line.
        """
        permille(speed)  # InputError for one that is none
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
        """Move a little, straight, and wait: ``joint=2, by_deg=-5``, ``axis="z", by_mm=10``, or ``axis="z", by_deg=5``.

        ``joint``: number, from 1, or name; ``axis``: "x", "y", "z" of the base or "tool-x", "tool-y", "tool-z", along
        which the tool moves by ``by_mm``, or about which it turns by ``by_deg``; ``speed``: part of the speed limits,
        0.01 to 1. The jog ends at the end of a range, or where the tool cannot continue along the line, at the latest.
        Gives the posture in degrees, (J,); ``last_jog_ends`` says why it ended early. Raises LinkError if the
        position is unknown, InputError if nothing can move that way.
        """
        arm = self._known_arm()
        move = move_of(arm, joint, axis, by_deg, by_mm)
        with self._stoppable(stop) as wanted:
            self._start.home_virtual_arm(arm)
            self.last_jog_ends = jog.step(self.client, arm, move, speed, wanted).ends
        return self.posture_deg()

    def held_jog(
        self,
        joint: int | str | None = None,
        axis: str | None = None,
        direction: int = 1,
        turn: bool = False,
        speed: float = SPEED,
    ) -> HeldJog:
        """A jog to the end of the range that continues only while its ``hold`` is called, in a ``with`` statement.

        ``direction``: 1 or -1; ``turn``: about ``axis`` instead of along it; the rest as in ``jog``. Where the calls
        cease the board brakes; leaving the context brakes too, and waits for rest.
        """
        arm = self._known_arm()
        by = math.copysign(math.inf, direction)
        along = None if turn or joint is not None else by
        move = move_of(arm, joint, axis, None if along else by, along)
        self._start.home_virtual_arm(arm)
        return HeldJog(self.client, arm, jog.plan(self.client, arm, move, speed))

    def by_hand(self) -> HandGuided:
        """The arm without its motors' current, to be moved by hand while its encoders are followed, in a ``with``
        statement: its ``angles_deg()``. Hold the arm before: it sinks.

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
        """Replay a motion ``repeat`` times, up to 99, and record what comes back in a new run folder below ``out``.

        ``motion``: a plan, its file (FILE.json), or the name of a motion on the board. The arm must be homed and be
        where the motion begins, else LinkError, as where the board keeps another motion under its name (``upload``
        can replace it) or is set up for another arm. The arm of a virtual board is brought there. Between repetitions
        it returns along the same path, all at the speed that ``speed`` was told last. ``progress`` counts seconds of
        motion; ``watcher`` sees folder, samples and repetitions. Whatever ends the run early raises, and what was
        recorded until then is ``last_run``.
        """
        if not 1 <= repeat <= _MOST_REPETITIONS:
            raise InputError(f"repeat: {repeat} is not in the range 1<=x<={_MOST_REPETITIONS}", "change it")
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
        """Run a planned sequence, or the stored one of that name, to its end, and say how it ended and where.

        Its rows and samples are recorded in a new run folder below ``out``; None: nowhere. The arm must be homed and
        be where the sequence begins, else LinkError or BoardError; the arm of a virtual board is brought there.
        ``watcher`` gets its state. What an input that does not come does is the sequence's affair: an end as
        ``timed_out``, or BoardError. With Stopped, its end is what ``client.sequence()`` says.
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
        """Values of the counters of the sequence that runs, or of the last one, by name.

        They begin at 0 whenever a sequence starts; the board keeps them until then, or until its power goes.
        """
        return self.client.counters()

    def _sequence(self, sequence: SequencePlan | str, stop: StopRequest, replace: bool) -> MotionKey:
        """What the board has it as; a virtual arm is brought to its start."""
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
        """The last run that this object recorded, however it ended; None before the first."""
        return Run.load(self._last_folder) if self._last_folder else None

    @property
    def last_sequence(self) -> SequenceRun | None:
        """The last sequence that this object recorded, however it ended; None before the first."""
        return SequenceRun.load(self._last_sequence) if self._last_sequence else None

    def fetch(self, motion: Plan | EncodedMotion | Path | str | None = None, out: Path | str = "runs") -> Run:
        """The samples that the board keeps of its last run, in a new run folder below ``out``.

        ``motion`` is what was run; None: the motion that the button starts. Such a run needs no host; one under
        way is followed to its end. Raises LinkError if the board keeps no samples.
        """
        encoded = self._encoded(self._default() if motion is None else motion)
        folder = recording.fetch(self.client, encoded, Path(out), self.port)
        self._last_folder = folder.path
        return Run.load(folder.path)

    def stop(self, now: bool = False) -> None:
        """Brake along the path, or freeze where ``now``, and wait until the arm rests.

        For motions that this object does not wait for, such as one that the button started; else give ``run``
        a ``StopRequest``.
        """
        stored_motion.stop(self.client, now)

    def request_stop(self, now: bool = False, by: str = "another thread") -> bool:
        """Stop what moves from another thread than the one that waits for it, which gets Stopped; whether
        something moved. Does not wait for rest.

        ``by``: who asks for it, in words. NoAnswerError if the board is silent.
        """
        return stored_motion.request_stop(self.client, self.stops, now, by)

    def speed(self, fraction: float) -> None:
        """Run at a fraction of the planned speed, 0.01 to 1: what this object starts from now on, and what moves.

        The path is unchanged; while it moves, the speed goes over smoothly in the motion's brake time: from a
        ``Watcher``, from another thread than the one that waits in ``run``, or for what the button started.
        Raises InputError for another fraction, BoardError if the board refuses.
        """
        change_speed(self.client, permille(fraction))

    def pause(self) -> None:
        """Let what moves come to rest on its path, to continue with ``resume``; BoardError if nothing moves."""
        change_speed(self.client, 0)

    def resume(self) -> None:
        """Continue along the path at the speed before the pause; BoardError if nothing moves."""
        change_speed(self.client, RESUME)

    def selftest(self, progress: Progress | None = None) -> SelfTest:
        """The board measures itself with its drivers off; ``progress`` tells how far it is.

        The board is reset at the end, so its positions are unknown. Raises LinkError if the drivers are on,
        something moves, or the program is not a part of the board's firmware; nothing was done then.
        """
        return selftest.run(self.client, progress)

    def motor_test(
        self, arm: Arm | Path | str, ask: Callable[[str], bool], tell: Callable[[str], object] = print
    ) -> SelfTest:
        """Try directions, encoders, switches and E-stop: each joint moves up to a degree there and back, slowly.

        ``ask`` puts a question to the person at the arm, first one that names what will move, and gives True for
        yes; ``tell`` says what to press. Lines to correct in the arm file are in the result's ``data["arm_file"]``.
        Raises ArmtempoError without a yes, LinkError where a position is unknown; nothing moved then.
        """
        arm = Arm.of(arm)
        self.configure(arm)
        self._start.home_virtual_arm(arm)
        with self._stoppable(None) as stop:
            return MotorTest(self.client, arm, stop, ask, tell).run()

    def clear(self) -> None:
        """Clear a fault; BoardError while its cause is still there."""
        self.client.clear()

    @contextmanager
    def _stoppable(self, given: StopRequest | None) -> Iterator[StopRequest]:
        """As ``stoppable``; other programs can ask for this stop as well."""
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
        """Store the motion; bring a virtual arm to its start, and refuse where a real one is elsewhere."""
        stored_motion.store(self.client, motion.name, motion.data)
        advice = "move it there with 'armtempo goto'"
        self._start.take(motion.arm, motion.start_deg, repr(motion.name), advice, stop)
