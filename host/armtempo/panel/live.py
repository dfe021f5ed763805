"""What the board says while the panel has it: its state, where the arm is, the samples of what runs."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics.chain import chains_mm
from armtempo.link.board_messages import Event, Sample, SequenceState
from armtempo.link.refusal import fault_words
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.robot.board import Board
from armtempo.robot.board_state import BoardState
from armtempo.robot.sharing import sample_json

_MOST_POINTS = 300
"""Of the path of a run that is shown."""
_ROWS = ("path_s", "commanded_deg", "angle_deg", "time_s")
"""The times last: another thread that reads as many rows as there are times finds them all."""


class Lines:
    """The last lines of a text that grows, and how many there have ever been."""

    def __init__(self) -> None:
        self.last: deque[str] = deque(maxlen=500)
        self.count = 0

    def add(self, lines: Sequence[str]) -> None:
        """Let it grow."""
        self.last.extend(lines)
        self.count += len(lines)


@dataclass
class LiveCurves:
    """What the samples of one run say: a row for each sample."""

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
    """The same as arrays."""

    time_s: Array
    path_s: Array
    """The motion's own time, (N,)."""
    commanded_deg: Array
    angle_deg: Array
    """By the encoders, (N, J); as commanded for a joint without one."""


class LiveArm:
    """What is known of the arm. Threads that read it see each part whole, as it was or as it is."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.state: BoardState | None = None
        self.angles_deg: Array = np.array(arm.home_deg)
        """Where the joints were commanded to be, by the last message, (J,)."""
        self.curves = LiveCurves(run=-1)
        """Of the motion that runs, or ran last: another object for each run, for those who read it meanwhile."""
        self.plan: Plan | None = None
        """The plan that runs, or ran last."""
        self.target_deg: Array | None = None
        """Where the arm goes, (J,), while it goes to a posture."""
        self.run_path_mm: Array = np.empty((0, 3))
        """Of the tool, by ``curves``; another object whenever it has changed."""
        self.inputs: dict[str, bool] = {}
        """Whether each input of the arm is active."""
        self.sequence: SequenceState | None = None
        """Where the sequence that was started last is."""
        self._seen = (-1, 0)
        self._jogs: tuple[Array, dict[JogMove, str]] = (np.empty(0), {})
        """Angles, (J,), and the answers of ``why_no_jog`` for them."""

    @property
    def fault(self) -> str:
        """The pending fault and its cure, in words; "" for none."""
        return fault_words(self.state.fault) if self.state is not None and self.state.fault else ""

    def why_no_jog(self, move: JogMove) -> str:
        """Why the arm cannot jog that way from where it is, in words; "" if it can."""
        here = self.angles_deg
        if not np.array_equal(here, self._jogs[0]):
            self._jogs = here, {}
        known = self._jogs[1]
        if move not in known:
            known[move] = jog_motion.problem(self.arm, tuple(map(float, here)), move)
        return known[move]

    def take_event(self, event: Event) -> None:
        """What the board says by itself."""
        if isinstance(event, Sample):
            sample = sample_json(event, self.arm)
            if "commanded_deg" in sample:
                if sample["run"] != self.curves.run:
                    self.curves = LiveCurves(sample["run"])
                self.curves.take(sample)
                self.angles_deg = np.array(sample["commanded_deg"])

    def take_sequence(self, state: SequenceState) -> None:
        """Where the sequence that runs is."""
        self.sequence = state

    def draw(self) -> None:
        """The tool's path by the samples, if there are new ones."""
        curves = self.curves
        if self._seen != (seen := (curves.run, len(curves.time_s))) and seen[1] > 1:
            self.run_path_mm = chains_mm(self.arm, curves.thinned(_MOST_POINTS).angle_deg)[:, -1]
        self._seen = seen

    def ask(self, board: Board) -> None:
        """The board's state and the levels of its inputs; LinkError if it does not answer."""
        state = board.state(self.arm)
        if self.arm.inputs and state.arm:
            levels = board.client.levels()
            self.inputs = {one.name: levels.active(n) for n, one in enumerate(self.arm.inputs)}
        angles = [joint.angle_deg for joint in state.joints]
        if all(angle is not None for angle in angles):
            self.angles_deg = np.array(angles, dtype=float)
        self.state = state
