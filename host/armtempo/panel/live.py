"""Live data from the board: its state, the arm's position, the samples of the running motion."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics.chain import chains_mm
from armtempo.link.board_messages import Event, Sample, SequenceState
from armtempo.link.refusal import describe_fault
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.robot.board import Board
from armtempo.robot.board_state import BoardState
from armtempo.robot.sharing import sample_json

_MOST_POINTS = 300
"""Largest number of points of a displayed path."""
_ROWS = ("path_s", "commanded_deg", "angle_deg", "time_s")
"""The times last: another thread that reads as many rows as there are times finds them all."""


class Lines:
    """The last lines of a growing text, and the total number of lines."""

    def __init__(self) -> None:
        self.last: deque[str] = deque(maxlen=500)
        self.count = 0

    def add(self, lines: Sequence[str]) -> None:
        """Append lines."""
        self.last.extend(lines)
        self.count += len(lines)


@dataclass
class LiveCurves:
    """The samples of one run, one row per sample."""

    run: int
    time_s: list[float] = field(default_factory=list)
    path_s: list[float] = field(default_factory=list)
    commanded_deg: list[list[float]] = field(default_factory=list)
    angle_deg: list[list[float | None]] = field(default_factory=list)

    def take(self, sample: dict[str, Any]) -> None:
        """Add a sample, as ``sharing.sample_json`` gives it."""
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
    """Samples as arrays."""

    time_s: Array
    path_s: Array
    """The motion's own time, (N,)."""
    commanded_deg: Array
    angle_deg: Array
    """Encoder angles, (N, J); commanded angles of joints without an encoder."""


class LiveArm:
    """The known state of the arm; each attribute is replaced as a whole, so other threads can read it."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.state: BoardState | None = None
        self.angles_deg: Array = np.array(arm.home_deg)
        """Commanded angles by the last message, (J,)."""
        self.curves = LiveCurves(run=-1)
        """Of the running or last motion; a new object for each run, for threads that read it."""
        self.plan: Plan | None = None
        """The plan of the running or last motion."""
        self.target_deg: Array | None = None
        """Target, (J,), during a motion to a posture."""
        self.run_path_mm: Array = np.empty((0, 3))
        """Of the tool, by ``curves``; another object whenever it has changed."""
        self.inputs: dict[str, bool] = {}
        """Whether each input of the arm is active."""
        self.outputs: dict[str, str | float] = {}
        """The state that the board last set of each output of the arm, or the value if it is none, in its unit."""
        self.heard_s = time.monotonic()
        """When the board last said where the arm is."""
        self.guided = False
        """Whether it is guided by hand."""
        self.held = False
        """Whether it moves as long as a button is held: that it brakes then is no pause."""
        self.sought = False
        """Whether it is homed by its switches: the board counts from where it only assumes the joints to be."""
        self.doubt = ""
        """Text: why the arm may be elsewhere than the board says; "" after it was homed."""
        self.sequence: SequenceState | None = None
        """State of the sequence that was started last."""
        self._seen = (-1, 0)
        self._jogs: tuple[tuple[Arm, Array], dict[JogMove, str]] = (arm, np.empty(0)), {}
        """The arm, its angles, (J,), and why jogs along axes of frames are not possible from there."""
        self._asked_jogs: set[JogMove] = set()

    @property
    def age_s(self) -> float:
        """How long ago the board last said where the arm is."""
        return time.monotonic() - self.heard_s

    @property
    def known(self) -> bool:
        """Whether the board knows where the arm is, or its encoders tell while it is guided by hand."""
        if self.guided or self.sought:
            return self.guided
        return self.state is not None and all(joint.known for joint in self.state.joints)

    def known_alone(self, joint: int) -> float | None:
        """Where one joint is, deg or mm, if the board knows it though perhaps not of all; None if not."""
        if self.sought or self.state is None or not self.state.joints[joint].known:
            return None
        return self.state.joints[joint].position

    @property
    def fault(self) -> str:
        """The pending fault and its cure; "" for none."""
        return describe_fault(self.state.fault) if self.state is not None and self.state.fault else ""

    def why_no_jog(self, move: JogMove) -> str:
        """Why this jog is not possible now; "" if it is.

        Along the axes of a frame it is as it was until ``draw`` has found it: that takes up to 10 ms for each.
        """
        if move.joint is None:
            self._asked_jogs.add(move)
            return self._jogs[1].get(move, "")
        return jog_motion.problem(self.arm, tuple(map(float, self.angles_deg)), move)

    def _look_at_jogs(self) -> None:
        """Find why the jogs that were asked for are not possible, if the arm has moved or others are asked for."""
        arm, here, asked = self.arm, self.angles_deg, self._asked_jogs
        self._asked_jogs = set()
        seen, known = self._jogs
        if arm is not seen[0] or not np.array_equal(here, seen[1]):
            known = {}
        if asked := asked - known.keys():
            angles = tuple(map(float, here))
            found = {move: jog_motion.problem(arm, angles, move) for move in asked}
            self._jogs = (arm, here), known | found

    def take_event(self, event: Event) -> None:
        """Handle an event of the board."""
        if isinstance(event, Sample):
            self.heard_s = time.monotonic()
            sample = sample_json(event, self.arm)
            keys = {name: self.arm.texts.list_key(name) for name in ("commanded_deg", "angle_deg")}
            if keys["commanded_deg"] in sample:
                sample |= {name: sample[key] for name, key in keys.items()}
                if sample["run"] != self.curves.run:
                    self.curves = LiveCurves(sample["run"])
                self.curves.take(sample)
                self.angles_deg = np.array(sample["commanded_deg"])

    def take_sequence(self, state: SequenceState) -> None:
        """Note the state of the running sequence."""
        self.sequence = state

    def draw(self) -> None:
        """The tool's path by the samples, if there are new ones, and why jogs are not possible where it rests."""
        curves = self.curves
        if self._seen != (seen := (curves.run, len(curves.time_s))) and seen[1] > 1:
            arm = self.plan.arm if self.plan is not None else self.arm  # a job's tool is its own
            self.run_path_mm = chains_mm(arm, curves.thinned(_MOST_POINTS).angle_deg)[:, -1]
        self._seen = seen
        if self.state is None or not self.state.moving:
            self._look_at_jogs()

    def ask(self, board: Board) -> None:
        """Read the board's state and inputs; raises LinkError if it does not answer."""
        state = board.state(self.arm)
        if (self.arm.inputs or self.arm.outputs) and state.arm:
            levels = board.client.levels()
            self.inputs = {one.name: levels.active(n) for n, one in enumerate(self.arm.inputs)}
            self.outputs = {
                one.name: one.state(levels.outputs[n]) or one.value(levels.outputs[n])
                for n, one in enumerate(self.arm.outputs)
            }
        angles = [joint.position for joint in state.joints]
        # Of joints that are not known the steps say nothing
        known = all(joint.known for joint in state.joints) and None not in angles
        if not self.guided:
            self.angles_deg = np.array(angles if known else self.arm.home_deg, dtype=float)
        self.state, self.heard_s = state, time.monotonic()
