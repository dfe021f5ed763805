"""What a joint's STEP and DIR pins did, from the pin log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.system.exact import ExactJoint
from tests.system.replays import Replay

PINS = (("A15", "E7"), ("A1", "E8"), ("B10", "E10"))
"""STEP and DIR of the shipped arm's joints (board-side home of the fact: armtempo_board/hardware/pins.py)."""
Ticks = NDArray[np.int64]


@dataclass(frozen=True)
class Pulses:
    """Times in ticks of the motion clock."""

    rises: Ticks
    falls: Ticks
    directions: NDArray[np.int64]
    """DIR at each rise: +1 high, -1 low."""
    dir_ticks: Ticks
    """Every change of DIR since power-up."""

    def position(self, start: int, ticks: NDArray[np.float64]) -> NDArray[np.int64]:
        """Commanded position at these times."""
        made = np.concatenate(([0], np.cumsum(self.directions)))
        return np.asarray(start + made[np.searchsorted(self.rises, ticks, side="right")])


def pulses(replay: Replay, joint: int) -> Pulses:
    """Of a joint, counted from 0."""
    ticks, levels = replay.pins[PINS[joint][0]]
    rises = ticks[levels == 1]
    dir_ticks, dir_levels = replay.pins.get(PINS[joint][1], (np.zeros(0, np.int64), np.zeros(0, np.int8)))
    at_first = 1 - int(dir_levels[0]) if len(dir_levels) else 0  # pins are low after a reset
    history = np.concatenate(([at_first], dir_levels)).astype(np.int64)
    directions = 2 * history[np.searchsorted(dir_ticks, rises, side="right")] - 1
    return Pulses(rises, ticks[levels == 0], directions, dir_ticks)


def exact(replay: Replay, joint: int) -> ExactJoint:
    """The spline of a joint, counted from 0."""
    spline, motor = replay.plan.trajectory.joints[joint], replay.plan.arm.driven[joint].motor
    assert motor is not None
    return ExactJoint(
        spline.angle_points_deg, spline.time_points_s, spline.degree, spline.refine, motor.steps_per_deg
    )
