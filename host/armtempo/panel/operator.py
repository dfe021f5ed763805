"""The panel's board: one command at a time, one client in control, states for all."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from enum import Flag, auto
from pathlib import Path
from threading import Event as ThreadEvent
from threading import Lock, Thread

from armtempo.basics.errors import ArmtempoError, InputError, LinkError, PortInUseError
from armtempo.diagnosis.selftest.result import SelfTest
from armtempo.link.traffic import Chunk, Sink
from armtempo.model.plan import Plan
from armtempo.panel import words
from armtempo.panel.desk import Desk
from armtempo.panel.live import Lines, LiveArm
from armtempo.panel.sequence_desk import SequenceDesk
from armtempo.robot.board import Board
from armtempo.robot.goto import Where, posture_deg
from armtempo.robot.stop_request import Stopped

LOOK_S = 0.25
"""Interval of status requests while there are no samples."""
FREEZE_AFTER_S = 5.0
"""A second press of stop within this time freezes the outputs instead of braking."""
_LOG = logging.getLogger("armtempo")


class Needs(Flag):
    """Requirements of a command, besides control by its client."""

    IDLE = auto()
    """No other command is running."""
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


class Operator:
    """The panel's board. All methods are thread-safe.

    Commands run one at a time in separate threads; ``stop`` does not wait for them.
    """

    def __init__(
        self, connect: Callable[[Sink, Callable[[str], object]], Board], port: str, desk: Desk, runs: Path
    ) -> None:
        """``connect`` opens the board's ``port``.

        A board that does not answer, or runs another program, is ``trouble``: the panel can deploy the program.
        Raises InputError or PortInUseError if the port cannot be used, LinkError for a board of another arm.
        """
        self.arm, self.desk = desk.arm, desk
        self.port, self.runs = port, runs
        """Where run folders go."""
        self.live = LiveArm(desk.arm)
        self.ended = 0
        """Number of ended commands."""
        self.sequences = SequenceDesk(desk.arm, desk.folder)
        self.tested: SelfTest | None = None
        """The last self-test."""
        self.traffic = Lines()
        """Messages to and from the board, while ``monitors`` is not empty."""
        self.monitors: set[str] = set()
        """The clients that watch the traffic."""
        self.trouble = ""
        """Text: why the board cannot be reached."""
        self.busy = ""
        """Text: the running command."""
        self.progress = 0.0
        """Its progress, 0 to 1."""
        self.log = Lines()
        self.holder = ""
        """The client that has control; "" for none."""
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
        """The board; raises LinkError while there is none."""
        if self._board is None:
            raise LinkError(self.trouble or words.NO_BOARD, words.NO_BOARD_HINT)
        return self._board

    def _open(self) -> None:
        try:
            board = self._connect(self._take_traffic, self._tell)
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
        board.client.session.listen(self.live.take_event)
        self._board, self.trouble = board, ""

    def _tell(self, text: str) -> None:
        """Store a message about the connection as ``trouble``, until the board reports its state again."""
        self.trouble = text
        self.say(text)

    def without_board(self, call: Callable[[], object]) -> None:
        """Close the port, run ``call``, which needs it, and open the board again."""
        board, self._board = self._board, None
        if board is not None:
            board.close()
        self.live.state = None  # after the last reader
        try:
            call()
        finally:
            try:
                self._open()
            except LinkError as error:
                self.trouble = str(error)
                raise

    def close(self) -> None:
        """Stop a motion, and close the board."""
        self._closed.set()
        if self.busy:
            self.stop("the panel's end")
        self._looker.join(2 * LOOK_S)
        if self._board is not None:
            self._board.close()

    # control

    def take_control(self, client: str) -> None:
        """Give ``client`` control; a motion of the previous client continues, its held jog ends."""
        self.holder = client

    def release(self, client: str) -> None:
        """Take control from ``client``, if it has it."""
        if self.holder == client:
            self.holder = ""

    def why_not(self, client: str, needs: Needs = Needs.MOVE) -> str:
        """Why ``client`` cannot give a command now; "" if it can."""
        if self.trouble and Needs.BOARD in needs:
            return self.trouble
        if self.holder != client:
            return words.OTHER_IN_CONTROL if self.holder else words.NOBODY_IN_CONTROL
        if self.busy and Needs.IDLE in needs:
            return words.BUSY.format(what=self.busy)
        if Needs.PLAN in needs and self.desk.plan is None:
            return words.NO_PLAN
        state, fault = self.live.state, self.live.fault
        if Needs.MOTION in needs and (state is None or not state.moving):
            return words.AT_REST
        if Needs.FAULT in needs and not fault:
            return words.NO_FAULT
        if Needs.REST not in needs or state is None:
            return ""
        if fault:
            return fault
        if not all(joint.known for joint in state.joints):
            return words.NOT_HOMED
        return words.MOVING if state.moving else ""

    # commands

    def do(self, what: str, client: str, call: Callable[[], object], needs: Needs = Needs.MOVE) -> None:
        """Run ``call`` in a separate thread; raises InputError, with the reason, if that is not possible now.

        Its errors go to the log and to all clients.
        """
        with self._lock:
            if reason := self.why_not(client, needs):
                raise InputError(reason, words.WAIT)
            self.busy, self.progress = what, 0.0
        Thread(target=self._work, args=(what, call), name=f"armtempo panel: {what}", daemon=True).start()

    def go(self, where: Where) -> None:
        """Go to a posture, which is ``target_deg`` meanwhile."""
        self.live.target_deg = posture_deg(where, self.arm)
        try:
            self.board.goto(where, progress=self.part)
        finally:
            self.live.target_deg = None

    def _work(self, what: str, call: Callable[[], object]) -> None:
        try:
            call()
            self.say(words.DONE.format(what=what))
        except Stopped as stopped:
            self.say(words.STOPPED.format(what=what, why=stopped))
        except ArmtempoError as error:
            self.say(f"{what}: {error}")
        except Exception as error:  # a bug: reported, and the panel continues
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
        self.live.plan = plan
        self.board.run(plan, times, self.runs, self.part).report()

    def selftest(self) -> None:
        """Let the board measure itself."""
        self.tested = self.board.selftest(self.part)

    def part(self, done: float, whole: float) -> None:
        """Store the progress of the running command."""
        self.progress = done / whole if whole else 0.0

    def stop(self, by: str = words.PANEL) -> None:
        """Brake along the path; a second time within FREEZE_AFTER_S: freeze. Allowed for all clients."""
        now_s = time.monotonic()
        freeze = now_s - self._stopped_s < FREEZE_AFTER_S
        self._stopped_s = now_s
        try:
            if self.board.request_stop(freeze, by):
                self.say(words.FREEZING if freeze else words.BRAKING)
        except ArmtempoError as error:
            self.say(str(error))

    def say(self, text: str) -> None:
        """Append a line to the log."""
        self.log.add([f"{time.strftime('%H:%M:%S')}  {text}"])

    # messages of the board

    def _take_traffic(self, chunk: Chunk, frames: list[str]) -> None:
        if self.monitors:
            self.traffic.add([f"{chunk.time_s:9.3f} {chunk.direction} {frame}" for frame in frames])

    def _look(self) -> None:
        while not self._closed.wait(LOOK_S):
            board = self._board
            try:
                self.live.draw()
                if board is None:
                    continue
                with board.client.session.in_a_hurry(LOOK_S) as mine:
                    if not mine:
                        continue
                    self.live.ask(board)
                    self.trouble = ""
            except ArmtempoError as error:
                if board is self._board:
                    self.trouble = str(error)
            except Exception:  # a bug: logged, and states continue
                _LOG.exception("panel: the board's state")
