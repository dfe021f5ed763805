"""The board that the panel has: one command at a time, one client in control, states for all."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event as Flag
from threading import Lock, Thread

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.link.board_messages import Event, Sample
from armtempo.model.arm import Arm
from armtempo.panel import words
from armtempo.panel.desk import Desk
from armtempo.robot.board import Board
from armtempo.robot.board_state import BoardState
from armtempo.robot.sharing import sample_json
from armtempo.robot.stop_request import Stopped

LOOK_S = 0.25
"""Interval of the board's states while no samples come."""
FREEZE_AFTER_S = 5.0
"""A second press of stop within this time freezes the outputs instead of braking."""
_LOG = logging.getLogger("armtempo")


@dataclass
class LiveCurves:
    """What the samples of the motion that runs, or ran last, say: a row for each sample."""

    time_s: list[float] = field(default_factory=list)
    commanded_deg: list[list[float]] = field(default_factory=list)
    angle_deg: list[list[float | None]] = field(default_factory=list)
    run: int = -1

    def take(self, sample: dict[str, object]) -> None:
        """Add a sample, as ``sharing.sample_json`` gives it; a new run begins anew."""
        if sample["run"] != self.run:
            self.__init__(run=sample["run"])  # type: ignore[misc]
        self.time_s.append(sample["time_s"])  # type: ignore[arg-type]
        self.commanded_deg.append(sample["commanded_deg"])  # type: ignore[arg-type]
        self.angle_deg.append(sample["angle_deg"])  # type: ignore[arg-type]


class Operator:
    """A board in use by the panel. Every method may be called from any thread.

    Commands run one after the other in a thread of their own; ``stop`` does not wait for them.
    """

    def __init__(self, board: Board, arm: Arm, desk: Desk, runs: Path) -> None:
        self.board, self.arm, self.desk = board, arm, desk
        self.runs = runs
        """Where run folders go."""
        self.state: BoardState | None = None
        self.angles_deg: Array = np.array(arm.home_deg)
        """Where the joints were commanded to be, by the last message, (J,)."""
        self.curves = LiveCurves()
        self.inputs: dict[str, bool] = {}
        """Whether each input of the arm is active."""
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
        self._lock = Lock()
        self._closed = Flag()
        self._stopped_s = -FREEZE_AFTER_S
        board.client.session.listeners.append(self._take_event)
        self._looker = Thread(target=self._look, name="armtempo panel states", daemon=True)
        self._looker.start()

    def close(self) -> None:
        """Stop what moves, and let the board go."""
        self._closed.set()
        if self.busy:
            self.stop("the panel's end")
        self._looker.join(2 * LOOK_S)

    # who is in control

    def take_control(self, client: str) -> None:
        """Give ``client`` control; a motion of the one before goes on, a jog that it holds ends."""
        self.holder = client

    def release(self, client: str) -> None:
        """Take control from ``client``, if it has it."""
        if self.holder == client:
            self.holder = ""

    def why_not(self, client: str, moves: bool = True) -> str:
        """Why ``client`` cannot give a command now, in words; "" if it can. ``moves``: one that moves the arm."""
        if self.trouble:
            return self.trouble
        if self.holder != client:
            return words.OTHER_IN_CONTROL if self.holder else words.NOBODY_IN_CONTROL
        if self.busy:
            return words.BUSY.format(what=self.busy)
        if not moves or self.state is None:
            return ""
        if self.state.fault:
            return words.FAULT.format(fault=self.state.fault)
        if not all(joint.known for joint in self.state.joints):
            return words.NOT_HOMED
        return words.MOVING if self.state.moving else ""

    # commands

    def do(self, what: str, client: str, call: Callable[[], object], moves: bool = True) -> None:
        """Begin ``call`` in a thread of its own; InputError, with the reason, if it cannot be now.

        What it raises goes to the log and to whoever watches.
        """
        with self._lock:
            if reason := self.why_not(client, moves):
                raise InputError(reason, words.WAIT)
            self.busy, self.progress = what, 0.0
        Thread(target=self._work, args=(what, call), name=f"armtempo panel: {what}", daemon=True).start()

    def _work(self, what: str, call: Callable[[], object]) -> None:
        try:
            call()
            self.say(words.DONE.format(what=what))
        except Stopped as stopped:
            self.say(words.STOPPED.format(what=what, why=stopped))
        except ArmtempoError as error:
            self.say(f"{what}: {error}")
        except Exception as error:  # a fault of ours: said, and the panel goes on
            _LOG.exception("panel: %s", what)
            self.say(f"{what}: {type(error).__name__}: {error}")
        finally:
            self.busy = ""

    def part(self, done: float, whole: float) -> None:
        """The progress of what is under way."""
        self.progress = done / whole if whole else 0.0

    def stop(self, by: str = words.PANEL) -> None:
        """Brake along the path; a second time within FREEZE_AFTER_S: freeze. Whoever asks, in control or not."""
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

    def _look(self) -> None:
        while not self._closed.wait(LOOK_S):
            try:
                with self.board.client.session.in_a_hurry(LOOK_S) as mine:
                    if not mine:
                        continue
                    self.state = self.board.state(self.arm)
                    if self.arm.inputs and self.state.arm:
                        levels = self.board.client.levels()
                        self.inputs = {one.name: levels.active(n) for n, one in enumerate(self.arm.inputs)}
                self.trouble = ""
            except ArmtempoError as error:
                self.trouble = str(error)
                continue
            angles = [joint.angle_deg for joint in self.state.joints]
            if all(angle is not None for angle in angles):
                self.angles_deg = np.array(angles, dtype=float)
