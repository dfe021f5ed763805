"""The board that the panel has: one command at a time, one client in control, states for all."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Flag, auto
from pathlib import Path
from threading import Event as ThreadEvent
from threading import Lock, Thread
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError, InputError, LinkError, PortInUseError
from armtempo.kinematics.chain import chains_mm
from armtempo.link.board_messages import Event, Sample, SequenceState
from armtempo.link.refusal import fault_words
from armtempo.link.traffic import Chunk, Sink
from armtempo.model.plan import Plan
from armtempo.panel import words
from armtempo.panel.desk import Desk
from armtempo.panel.sequence_desk import SequenceDesk
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.robot.board import Board
from armtempo.robot.board_state import BoardState
from armtempo.robot.sharing import sample_json
from armtempo.robot.stop_request import Stopped
from armtempo.robot.where import Where, posture_deg
from armtempo.selftest.result import SelfTest

LOOK_S = 0.25
"""Interval of the board's states while no samples come."""
FREEZE_AFTER_S = 5.0
"""A second press of stop within this time freezes the outputs instead of braking."""
_MOST_POINTS = 300
"""Of the path of a run that is shown."""
_ROWS = ("path_s", "commanded_deg", "angle_deg", "time_s")
"""The times last: another thread that reads as many rows as there are times finds them all."""
_LOG = logging.getLogger("armtempo")


class Needs(Flag):
    """What a command needs, besides that its client has control."""

    IDLE = auto()
    """Nothing else is under way."""
    BOARD = auto()
    """The board answers."""
    REST = auto()
    """The arm is at rest, its position known, and no fault pending."""
    MOTION = auto()
    """Something moves."""
    COMMAND = IDLE | BOARD
    PLAN = auto()
    """A motion is planned."""
    FAULT = auto()
    """A fault is pending."""
    CONTROL = 0
    """Nothing else."""
    PAUSE = BOARD | MOTION
    MOVE = IDLE | BOARD | REST


@dataclass
class LiveCurves:
    """What the samples of the motion that runs, or ran last, say: a row for each sample."""

    time_s: list[float] = field(default_factory=list)
    path_s: list[float] = field(default_factory=list)
    commanded_deg: list[list[float]] = field(default_factory=list)
    angle_deg: list[list[float | None]] = field(default_factory=list)
    run: int = -1

    def take(self, sample: dict[str, Any]) -> None:
        """Add a sample, as ``sharing.sample_json`` gives it; a new run begins anew."""
        if sample["run"] != self.run:
            self.run = sample["run"]
            for name in reversed(_ROWS):
                setattr(self, name, [])
        for name in _ROWS:
            getattr(self, name).append(sample[name])

    def thinned(self, most: int) -> LiveArrays:
        """At most ``most`` samples, evenly spaced."""
        count = len(self.time_s)
        chosen = slice(0, count, max(1, -(-count // most)))
        commanded = np.array(self.commanded_deg[chosen])
        measured = np.array(self.angle_deg[chosen], dtype=float)
        return LiveArrays(
            np.array(self.time_s[chosen]),
            np.array(self.path_s[chosen]),
            commanded,
            np.where(np.isnan(measured), commanded, measured),
        )


@dataclass(frozen=True, eq=False)
class LiveArrays:
    """The same as arrays."""

    time_s: Array
    path_s: Array
    """The motion's own time, (N,)."""
    commanded_deg: Array
    angle_deg: Array
    """By the encoders, (N, J); as commanded for a joint without one."""


class Operator:
    """A board in use by the panel. Every method may be called from any thread.

    Commands run one after the other in a thread of their own; ``stop`` does not wait for them.
    """

    def __init__(self, connect: Callable[[Sink], Board], port: str, desk: Desk, runs: Path) -> None:
        """``connect`` opens the board's ``port``.

        A board that does not answer, or runs another program, is ``trouble``: the panel can deploy the program.
        Raises InputError or PortInUseError if the port cannot be used, LinkError for a board of another arm.
        """
        self.arm, self.desk = desk.arm, desk
        self.port, self.runs = port, runs
        """Where run folders go."""
        self.state: BoardState | None = None
        self.angles_deg: Array = np.array(self.arm.home_deg)
        """Where the joints were commanded to be, by the last message, (J,)."""
        self.curves = LiveCurves()
        self.plan_run: Plan | None = None
        """The plan that runs, or ran last."""
        self.run_path_mm: Array = np.empty((0, 3))
        """Of the tool, by ``curves``; another object whenever it has changed."""
        self.ended = 0
        """How many commands have ended."""
        self.inputs: dict[str, bool] = {}
        """Whether each input of the arm is active."""
        self.sequences = SequenceDesk(desk.arm, desk.folder)
        self.sequence: SequenceState | None = None
        """Where the sequence that was started last is."""
        self.tested: SelfTest | None = None
        """The last self-test."""
        self.target_deg: Array | None = None
        """Where the arm goes, (J,), while it goes to a posture."""
        self.traffic: deque[str] = deque(maxlen=500)
        """The last messages to and from the board, while ``monitors`` is not empty."""
        self.messages = 0
        """How many messages there were."""
        self.monitors: set[str] = set()
        """The clients that watch the traffic."""
        self.trouble = ""
        """Why the board cannot be reached, in words."""
        self.busy = ""
        """What is under way, in words."""
        self.progress = 0.0
        """How far that is, 0 to 1."""
        self.log: deque[str] = deque(maxlen=500)
        self.lines = 0
        """How many lines the log has ever had."""
        self.holder = ""
        """The client that has control; "" for none."""
        self._jogs_from: tuple[float, ...] = ()
        self._jogs: dict[JogMove, str] = {}
        """The answers of ``why_no_jog`` for these angles."""
        self._lock = Lock()
        self._closed = ThreadEvent()
        self._stopped_s = -FREEZE_AFTER_S
        self._connect = connect
        self._board: Board | None = None
        self._open()
        self._looker = Thread(target=self._look, name="armtempo panel states", daemon=True)
        self._looker.start()

    @property
    def board(self) -> Board:
        """The board; LinkError while there is none."""
        if self._board is None:
            raise LinkError(self.trouble or words.NO_BOARD, words.NO_BOARD_HINT)
        return self._board

    def _open(self) -> None:
        try:
            board = self._connect(self._take_traffic)
        except PortInUseError:
            raise
        except LinkError as error:
            self.trouble = str(error)
            self.say(self.trouble)
            return
        try:
            board.configure(self.arm)
        except BaseException:
            board.close()
            raise
        board.client.session.listeners.append(self._take_event)
        self._board, self.trouble = board, ""

    def without_board(self, call: Callable[[], object]) -> None:
        """Free the port, do ``call``, which needs it, and open the board again."""
        board, self._board, self.state = self._board, None, None
        if board is not None:
            board.close()
        try:
            call()
        finally:
            self._open()

    def close(self) -> None:
        """Stop what moves, and let the board go."""
        self._closed.set()
        if self.busy:
            self.stop("the panel's end")
        self._looker.join(2 * LOOK_S)
        if self._board is not None:
            self._board.close()

    # who is in control

    def take_control(self, client: str) -> None:
        """Give ``client`` control; a motion of the one before continues, a jog that it holds ends."""
        self.holder = client

    def release(self, client: str) -> None:
        """Take control from ``client``, if it has it."""
        if self.holder == client:
            self.holder = ""

    def why_not(self, client: str, needs: Needs = Needs.MOVE) -> str:
        """Why ``client`` cannot give a command now, in words; "" if it can."""
        if self.trouble and Needs.BOARD in needs:
            return self.trouble
        if self.holder != client:
            return words.OTHER_IN_CONTROL if self.holder else words.NOBODY_IN_CONTROL
        if self.busy and Needs.IDLE in needs:
            return words.BUSY.format(what=self.busy)
        if Needs.PLAN in needs and self.desk.plan is None:
            return words.NO_PLAN
        if Needs.MOTION in needs and (self.state is None or not self.state.moving):
            return words.AT_REST
        if Needs.FAULT in needs and not self.fault:
            return words.NO_FAULT
        if Needs.REST not in needs or self.state is None:
            return ""
        if self.fault:
            return self.fault
        if not all(joint.known for joint in self.state.joints):
            return words.NOT_HOMED
        return words.MOVING if self.state.moving else ""

    @property
    def fault(self) -> str:
        """The pending fault and its cure, in words; "" for none."""
        return fault_words(self.state.fault) if self.state is not None and self.state.fault else ""

    def why_no_jog(self, move: JogMove) -> str:
        """Why the arm cannot jog that way from where it is, in words; "" if it can."""
        here = tuple(self.angles_deg)
        if here != self._jogs_from:
            self._jogs_from, self._jogs = here, {}
        if move not in self._jogs:
            self._jogs[move] = jog_motion.problem(self.arm, here, move)
        return self._jogs[move]

    # commands

    def do(self, what: str, client: str, call: Callable[[], object], needs: Needs = Needs.MOVE) -> None:
        """Begin ``call`` in a thread of its own; InputError, with the reason, if it cannot be now.

        What it raises goes to the log and to all watching clients.
        """
        with self._lock:
            if reason := self.why_not(client, needs):
                raise InputError(reason, words.WAIT)
            self.busy, self.progress = what, 0.0
        Thread(target=self._work, args=(what, call), name=f"armtempo panel: {what}", daemon=True).start()

    def go(self, where: Where) -> None:
        """Go to a posture, which is ``target_deg`` meanwhile."""
        self.target_deg = posture_deg(where, self.arm)
        try:
            self.board.goto(where, progress=self.part)
        finally:
            self.target_deg = None

    def _work(self, what: str, call: Callable[[], object]) -> None:
        try:
            call()
            self.say(words.DONE.format(what=what))
        except Stopped as stopped:
            self.say(words.STOPPED.format(what=what, why=stopped))
        except ArmtempoError as error:
            self.say(f"{what}: {error}")
        except Exception as error:  # a fault of ours: said, and the panel continues
            _LOG.exception("panel: %s", what)
            self.say(f"{what}: {type(error).__name__}: {error}")
        finally:
            self.busy = ""
            self.ended += 1

    def upload(self, plan: Plan) -> None:
        """Store a plan on the board, in the place of another one of its name."""
        self.board.upload(plan, replace=True, progress=self.part)

    def run(self, plan: Plan, times: int) -> None:
        """Load a plan, run it and write the report."""
        self.upload(plan)
        self.plan_run = plan
        self.board.run(plan, times, self.runs, self.part).report()

    def selftest(self) -> None:
        """Let the board measure itself."""
        self.tested = self.board.selftest(self.part)

    def part(self, done: float, whole: float) -> None:
        """The progress of what is under way."""
        self.progress = done / whole if whole else 0.0

    def stop(self, by: str = words.PANEL) -> None:
        """Brake along the path; a second time within FREEZE_AFTER_S: freeze. Any client may, in control or not."""
        now_s = time.monotonic()
        freeze = now_s - self._stopped_s < FREEZE_AFTER_S
        self._stopped_s = now_s
        try:
            if self.board.request_stop(freeze, by):
                self.say(words.FREEZING if freeze else words.BRAKING)
        except ArmtempoError as error:
            self.say(str(error))

    def say(self, text: str) -> None:
        """Put a line into the log."""
        self.lines += 1
        self.log.append(f"{time.strftime('%H:%M:%S')}  {text}")

    # what the board says

    def _take_event(self, event: Event) -> None:
        if isinstance(event, Sample):
            sample = sample_json(event, self.arm)
            if "commanded_deg" in sample:
                self.curves.take(sample)
                self.angles_deg = np.array(sample["commanded_deg"])

    def take_sequence(self, state: SequenceState) -> None:
        """Where the sequence that runs is."""
        self.sequence = state

    def _take_traffic(self, chunk: Chunk, frames: list[str]) -> None:
        if self.monitors:
            self.messages += len(frames)
            self.traffic.extend(f"{chunk.time_s:9.3f} {chunk.direction} {frame}" for frame in frames)

    def _look(self) -> None:
        seen = (-1, 0)
        while not self._closed.wait(LOOK_S):
            if seen != (seen := (self.curves.run, len(self.curves.time_s))) and seen[1] > 1:
                self.run_path_mm = chains_mm(self.arm, self.curves.thinned(_MOST_POINTS).angle_deg)[:, -1]
            board = self._board
            if board is None:
                continue
            try:
                with board.client.session.in_a_hurry(LOOK_S) as mine:
                    if not mine:
                        continue
                    state = board.state(self.arm)
                    if self.arm.inputs and state.arm:
                        levels = board.client.levels()
                        self.inputs = {one.name: levels.active(n) for n, one in enumerate(self.arm.inputs)}
            except ArmtempoError as error:
                if board is self._board:
                    self.trouble = str(error)
                continue
            angles = [joint.angle_deg for joint in state.joints]
            if all(angle is not None for angle in angles):
                self.angles_deg = np.array(angles, dtype=float)
            self.state, self.trouble = state, ""
