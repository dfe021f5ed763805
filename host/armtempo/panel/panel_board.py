"""The panel's board: one command at a time, of the client that has control."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, MutableSequence
from enum import Flag, auto
from functools import partial
from pathlib import Path
from threading import Lock, Thread

from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.deploy import deploy
from armtempo.diagnosis.selftest.result import SelfTest
from armtempo.link.traffic import Sink
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.panel import words
from armtempo.panel.board_link import BoardLink
from armtempo.panel.job_editor import JobEditor
from armtempo.panel.press import Press, Presses
from armtempo.panel.sequence_editor import SequenceEditor
from armtempo.planning import brake_time
from armtempo.planning.jog.jog_motion import JogMotion
from armtempo.robot import goto
from armtempo.robot.board import Board
from armtempo.robot.goto import MovePace, Where, posture_deg
from armtempo.robot.jog import HeldJog
from armtempo.robot.stop_request import Stopped, StopRequest

FREEZE_AFTER_S = 0.5
"""An arm that is not at rest this long after a stop can be frozen: a double press of stop does not do it."""
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
    """A motion is planned, and the job was not changed since."""
    FAULT = auto()
    """A fault is pending."""
    CONTROL = 0
    """Nothing else."""
    PAUSE = BOARD | MOTION
    MOVE = IDLE | BOARD | REST


class PanelBoard(BoardLink):
    """The panel's board. All methods are thread-safe.

    Commands run one at a time in separate threads; ``stop`` does not wait for them.
    """

    def __init__(
        self,
        connect: Callable[[Sink, Callable[[str], object]], Board],
        port: str,
        jobs: JobEditor,
        runs: Path,
    ) -> None:
        """``connect``, ``port``, errors: as those of the connection; ``runs``: where run folders go."""
        # Before the connection, whose thread tells of the board's states
        self.jobs, self.runs = jobs, runs
        self.sequences = SequenceEditor(jobs.arm, jobs.folder)
        self.ended = 0
        """Number of ended commands."""
        self.tested: SelfTest | None = None
        """The last self-test."""
        self.busy = ""
        """Text: the running command."""
        self.progress = 0.0
        """Its progress, 0 to 1."""
        self.left = 0.0
        """What is left of it; of a run in seconds of motion."""
        self.failure = ""
        """Text: why the last command failed; "" after the next one has begun."""
        self.guiding = False
        """Whether the arm is guided by hand."""
        self.holder = ""
        """The client that has control; "" for none."""
        self.presses = Presses(self._situation)
        """Which presses of the pages are still meant."""
        self._lock = Lock()
        self._stop = StopRequest()
        """Asks the running command for its end, also while it plans or stores before anything moves."""
        self._stop_s: float | None = None
        """When a stop was asked for, until the arm is known to rest."""
        self._stop_sent_s = 0.0
        super().__init__(connect, port, jobs.arm)

    def arm_changed(self, arm: Arm, tool: str | None = None) -> None:
        """Take another version of the arm that differs in what the board does not know alone: its postures, workspace,
        frames and tools. The chosen tool, or another one if it is given, stays if it is still there."""
        wanted = self.tool if tool is None else tool
        self.jobs.take_arm(arm)
        self.sequences.take_arm(arm)
        self._put_on(wanted if wanted in [one.name for one in arm.tools] else "")

    @property
    def tool(self) -> str:
        """The name of the tool that is jogged and moved to poses; "" for none. A job or a sequence names its own."""
        return self.arm.tool.name if self.arm.tool else ""

    def choose_tool(self, client: str, press: Press, name: str) -> None:
        """Choose the tool, "" for none; raises InputError as ``check``, or if the arm has no such tool."""
        self.check(client, press, Needs.IDLE)
        self._put_on(name)

    def _put_on(self, tool: str) -> None:
        self.arm = self.live.arm = self.jobs.arm.with_tool(tool)
        if self._board is not None:
            self._board.arm = self.arm

    def close(self) -> None:
        """Stop a motion, and close the board."""
        if self.busy:
            self.stop("the panel's end")
        super().close()

    # control

    def _situation(self) -> object:
        """What a command depends on."""
        state = self.live.state
        seen = state and (
            state.moving,
            state.fault,
            not state.speed_percent,
            [one.known for one in state.joints],
        )
        return self.holder, self.busy, self.trouble, id(self.jobs.plan), self.arm, seen

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
        if Needs.PLAN in needs and (self.jobs.plan is None or self.jobs.plan_is_old):
            return words.PLAN_IS_OLD if self.jobs.plan else words.NO_PLAN
        state, fault = self.live.state, self.live.fault
        if Needs.MOTION in needs and (state is None or not state.moving):
            return words.AT_REST
        if Needs.FAULT in needs and not fault:
            return words.NO_FAULT
        if Needs.REST not in needs or state is None:
            return ""
        if fault:
            return fault
        if not self.live.known:
            return words.NOT_HOMED
        return words.MOVING if state.moving else ""

    # commands

    def check(self, client: str, press: Press, needs: Needs) -> None:
        """Raise InputError, with the reason, if a press of ``client`` is not meant any more, or not possible now."""
        self.presses.take(client, press)
        if reason := self.why_not(client, needs):
            raise InputError(reason, words.WAIT)

    def do(
        self,
        what: str,
        client: str,
        press: Press,
        call: Callable[[], object],
        needs: Needs = Needs.MOVE,
        before: Callable[[], None] = lambda: None,
    ) -> None:
        """Run ``call`` in a separate thread; raises InputError as ``check``.

        ``before`` is called first, if it is possible. Errors of ``call`` go to the log and to all clients.
        """
        with self._lock:
            self.check(client, press, needs)
            before()
            self.busy, self.progress, self.failure = what, 0.0, ""
            self.live.plan = None
            self._stop = request = StopRequest()
            stops: MutableSequence[StopRequest] = self._board.stops if self._board is not None else []
            stops.append(request)
        work = partial(self._work, what, call, lambda: stops.remove(request))
        Thread(target=work, name=f"armtempo panel: {what}", daemon=True).start()

    def go(self, where: Where, pace: MovePace | None = None) -> None:
        """Go to a posture, which is ``target_deg`` meanwhile."""
        pace = pace or MovePace()
        self.live.target_deg = posture_deg(where, self.arm)
        try:
            self.board.goto(where, self.part, self._stop, pace.speed, pace.line)
        finally:
            self.live.target_deg = None

    def held_move(self, where: Where, pace: MovePace) -> HeldJog:
        """A move to a posture that lasts while it is held; errors as those of ``Board.goto``."""
        here_deg, target_deg = self.board.posture_deg(), posture_deg(where, self.arm)
        trajectory = goto.motion(self.arm, here_deg, target_deg, pace)
        brakes = brake_time.of_motion(trajectory, [joint.limits for joint in self.arm.driven])
        return HeldJog(self.board.client, self.arm, JogMotion(trajectory, brakes, ""))

    def home(self, joint: str | None = None) -> None:
        """Declare that the arm is at home, or a joint of it alone."""
        self.board.home(self.arm, joint=joint)
        self._homed(joint)

    def home_to_switches(self, joint: str | None = None) -> None:
        """Home the joints that have switches, or one of them alone; each that is at home is told."""
        self.live.sought = True
        try:
            self.board.home_to_switches(self.arm, joint=joint, progress=self._tell_homing)
        finally:
            self.live.sought = False
        self._homed(joint)

    def _tell_homing(self, text: str, done: int, whole: int) -> None:
        self.say(text)
        self.part(done, whole)

    def _homed(self, joint: str | None) -> None:
        if joint is None:  # else the others may still be elsewhere
            self.live.doubt = ""

    def _work(self, what: str, call: Callable[[], object], ended: Callable[[], None]) -> None:
        try:
            call()
            self.say(words.DONE.format(what=what))
        except Stopped as stopped:
            self.say(words.STOPPED.format(what=what, why=stopped))
        except ArmtempoError as error:
            self._fail(f"{what}: {words.of_error(error)}")
        except Exception as error:  # a bug: reported, and the panel continues
            _LOG.exception("panel: %s", what)
            self._fail(f"{what}: {type(error).__name__}: {error}")
        finally:
            ended()
            self.busy = ""
            self.ended += 1

    def _fail(self, text: str) -> None:
        self.failure = text
        self.say(text)

    def upload(self, plan: Plan) -> None:
        """Store a plan on the board, in the place of another one of its name."""
        self.board.upload(plan, replace=True, progress=self.part)

    def run(self, plan: Plan, times: int) -> None:
        """Load a plan and run it; its report is made when it is asked for."""
        self.upload(plan)
        self.part(0.0, times * plan.total_s)
        self.live.plan = plan
        self.board.run(plan, times, self.runs, self.part, stop=self._stop)

    def run_sequence(self, sequence: Plan | str) -> None:
        """Run a planned sequence, stored in the place of another one of its name; or the stored one of that name."""
        take = self.live.take_sequence
        if not isinstance(sequence, str):  # many motions take half a minute
            self.upload(sequence)
            self.part(0.0, 0.0)
        take(self.board.run_sequence(sequence, take, self._stop, replace=True, out=self.runs))

    def deploy(self) -> None:
        """Put this version's program on the board."""
        self.without_board(lambda: deploy(self.port, tell=self.say, progress=self.part))

    def selftest(self) -> None:
        """Let the board measure itself."""
        if self.board.info.virtual:  # its drivers hold no arm, and it has no reset button to switch them off
            self.board.client.drivers(False)
        self.tested = self.board.selftest(self.part)

    def part(self, done: float, whole: float) -> None:
        """Store the progress of the running command."""
        self.left, self.progress = whole - done, done / whole if whole else 0.0

    def preparing(self, done: float, whole: float) -> None:
        """As ``part``, of what is done before something moves: it ends, with Stopped, if a stop was asked for."""
        self._stop.check()
        self.part(done, whole)

    def stop(self, by: str = words.PANEL) -> None:
        """Brake along the path; a command that has not moved anything yet will not. Allowed for all clients."""
        self.guiding = False
        if self._stop_s is None:
            self._stop_s = time.monotonic()
        try:
            if self.board.request_stop(False, by):
                self.say(words.BRAKING)
            else:
                self._stop_s = None
        except ArmtempoError as error:
            self._fail(words.of_error(error))
        self._stop_sent_s = time.monotonic()

    def _heard(self, asked_s: float) -> None:
        if self.live.state and not self.live.state.moving and asked_s > self._stop_sent_s:
            self._stop_s = None

    @property
    def can_freeze(self) -> bool:
        """Whether a stop was asked for, and the arm does not rest yet."""
        return self._stop_s is not None and time.monotonic() - self._stop_s > FREEZE_AFTER_S

    def freeze(self, by: str = words.PANEL) -> None:
        """Freeze the outputs of an arm that does not come to rest after a stop. Allowed for all clients."""
        if not self.can_freeze:
            return
        try:
            if self.board.request_stop(True, by):
                blind = [joint.name for joint in self.arm.driven if joint.encoder is None]
                self.live.doubt = (
                    words.FROZEN_BLIND.format(joints=", ".join(blind)) if blind else words.FROZEN
                )
                self.say(self.live.doubt)
        except ArmtempoError as error:
            self._fail(words.of_error(error))
