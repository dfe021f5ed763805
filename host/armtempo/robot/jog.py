"""Jogging: a step, or a motion that continues only while it is held."""

from __future__ import annotations

from contextlib import ExitStack
from types import TracebackType
from typing import Self

import numpy as np
from armtempo_shared.codes import NOT_MOVING
from armtempo_shared.limits import HOLD_TIMEOUT_MS
from armtempo_shared.messages import START_HELD

from armtempo.basics.arrays import Array
from armtempo.basics.errors import BoardError, LinkError
from armtempo.encoding import encode
from armtempo.link import Client
from armtempo.link.board_messages import Done, Event, Fault, Positions, Sample
from armtempo.link.refusal import refusal
from armtempo.link.session import OnLoss
from armtempo.model.arm import Arm
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMotion, JogMove
from armtempo.robot import arm_state, goto, running
from armtempo.robot.stop_request import StopRequest

NAME = "jog"
HOLD_S = 0.08
"""Interval of the hold messages of a held jog: three in a row may be lost."""
BEFORE_BRAKING_S = 0.15
"""From a stop command until the board brakes: it finishes the steps in its rings, and one more step at low speed."""
_ANSWER_S = 1.0
_AT_END_STEPS = 1.5
_FIRST_STEP_S, _LOOK_S = 1.0, 0.01
"""Longest time until the first step of a press, and between two looks at the position."""
_FIRST = 2  # holds sent at the start: a virtual board keeps to real time from then on


def rest_s(motion: JogMotion, stopped: bool = False) -> float:
    """Longest time until a held jog is at rest, after the last hold (``stopped``: after the stop) reached the
    board, seconds."""
    silence_s = 0.0 if stopped else HOLD_TIMEOUT_MS / 1000.0
    return silence_s + BEFORE_BRAKING_S + motion.brakes.longest_rest_s


def plan(client: Client, arm: Arm, move: JogMove, speed: float = jog_motion.SPEED) -> JogMotion:
    """Plan the jog from the arm's position; raises LinkError if that is unknown, else as ``jog_motion.plan``."""
    return jog_motion.plan(NAME, arm, arm_state.posture_deg(client, arm).tolist(), move, speed)


def distance_deg(here_deg: Array, arm: Arm, joint: int | str, to_deg: float) -> float:
    """The distance of a joint from a position; 0 for less than half a step. Raises InputError for an unknown joint."""
    number = jog_motion.number_of_joint(arm, joint)
    found = to_deg - float(here_deg[number])
    return found if abs(found) * arm.driven[number].steps_per_deg >= 0.5 else 0.0


def step(client: Client, arm: Arm, move: JogMove, speed: float, stop: StopRequest) -> JogMotion:
    """Make the jog, at most to the end of the range, and wait for it.

    Raises BoardError if the board refuses or a fault ends it; otherwise as ``plan``.
    """
    motion = plan(client, arm, move, speed)
    goto.move_once(client, _record(motion, arm), stop)
    return motion


def _record(motion: JogMotion, arm: Arm) -> bytes:
    return encode.motion_record(motion.trajectory, arm, motion.brakes)


class HeldJog:
    """A jog that continues only while ``hold`` is called; a context that ends with the arm at rest.

    ``hold`` is a dead man's switch: no thread calls it. If the board receives no hold for HOLD_TIMEOUT_MS, it
    brakes by itself and is at rest after ``rest_s`` at the latest.
    """

    def __init__(self, client: Client, arm: Arm, motion: JogMotion) -> None:
        self.motion = motion
        self.arm = arm
        self.moving = False
        """Whether it still moves, by the last message of the board."""
        self.fault: Fault | None = None
        """The fault that ended it, if any."""
        self.ends = ""
        """Why it ended by itself, known after the context; "" if it did not."""
        self._client = client
        self._run = 0
        self._said_s = 0.0
        self._silent_s = 0.0  # the longest time between two holds
        self._positions: Positions | None = None
        self._ends = ExitStack()

    def __enter__(self) -> Self:
        """Upload and start it; raises BoardError if the board refuses."""
        client = self._client
        client.need("jog", "moving by hand")
        with ExitStack() as ends:
            key = ends.enter_context(running.on_board(client, _record(self.motion, self.arm)))
            # Nothing holds the jog while a broken port is waited for
            ends.enter_context(client.session.on_loss(OnLoss(retry_s=0.0)))
            self._run = client.start(key.name, key.crc, START_HELD)
            self.moving = True
            self._said_s = client.session.clock()
            for _ in range(_FIRST):
                self._send_hold()
            self._ends = ends.pop_all()
        return self

    @property
    def rest_s(self) -> float:
        """Longest time from the last received hold until the arm is at rest, seconds."""
        return rest_s(self.motion)

    @property
    def angles_deg(self) -> Array:
        """Commanded joint angles by the last message of the board, degrees (J,)."""
        if self._positions is None:
            return self.motion.trajectory(0.0)
        return self.arm.transmission.angles_of_steps(self._positions.commanded_steps)

    def hold(self, seconds: float = 0.05) -> bool:
        """Hold the jog for ``seconds`` and read the board's messages; returns False once it has ended.

        Raises LinkError if the board cannot be reached any more; it then brakes by itself.
        """
        session = self._client.session
        until_s = session.clock() + seconds
        while self.moving:
            now_s = session.clock()
            if now_s - self._said_s >= HOLD_S:
                self._send_hold()
            left_s = min(until_s, self._said_s + HOLD_S) - session.clock()
            self._take(session.poll(max(0.0, left_s)))
            if session.clock() >= until_s:
                break
        return self.moving

    def _send_hold(self) -> None:
        now_s = self._client.session.clock()
        self._silent_s, self._said_s = max(self._silent_s, now_s - self._said_s), now_s
        try:
            self._client.hold(_ANSWER_S)
        except BoardError as error:
            if error.code != NOT_MOVING:
                raise
            self.moving = False

    def _take(self, event: Event | None) -> None:
        if not isinstance(event, Sample | Done | Fault) or event.run != self._run:
            return
        self._positions = event.positions
        if isinstance(event, Fault):
            self.fault = event
        self.moving = self.moving and isinstance(event, Sample)

    def _why_ended(self) -> str:
        """Why it has ended by itself."""
        if self.fault is not None:
            return "a fault"
        off_steps = self.arm.transmission.steps(self.angles_deg - self.motion.end_deg)
        if np.all(np.abs(off_steps) < _AT_END_STEPS):
            return self.motion.ends
        if self._silent_s > HOLD_TIMEOUT_MS / 1000.0:
            return f"this program was busy for {self._silent_s:.1f} s and did not hold it"
        return f"stopped, or no hold reached the board for {HOLD_TIMEOUT_MS / 1000:g} s: look at the cable"

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Brake and wait for rest; raises BoardError if a fault ended the jog."""
        try:
            ended = not self.moving
            if value is None:
                self._make_a_step()
            self._rest()
            self.ends = self._why_ended() if ended else ""
        except LinkError:
            if value is None:  # do not hide the first error
                raise
            return
        finally:
            self._ends.close()
        if self.fault is not None and value is None:
            raise refusal("a fault ended the jog", self.fault.code, self.fault.joint)

    def _make_a_step(self) -> None:
        """Go on until a joint has moved by a step: the shortest press moves something."""
        session = self._client.session
        start = np.rint(self.arm.transmission.steps(self.motion.trajectory(0.0)))
        limit_s = session.clock() + _FIRST_STEP_S
        while self.moving and session.clock() < limit_s:
            status = self._client.status()
            if not status.moving or np.any(np.array(status.positions.commanded_steps) != start):
                return
            self.hold(_LOOK_S)

    def _rest(self) -> None:
        client = self._client
        running.send_stop(client)
        limit_s = client.session.clock() + rest_s(self.motion, stopped=True) + running.BRAKE_S
        while (status := client.status()).moving:
            if client.session.clock() > limit_s:
                running.stop(client, now=True)
            self._take(client.session.poll(HOLD_S))
        while client.session.events:
            self._take(client.session.events.popleft())
        self._positions = status.positions
        self.moving = False
        if status.fault and self.fault is None:
            self.fault = status.as_fault()
