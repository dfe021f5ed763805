"""Joint ranges: whole turns added to an angle so that it lies in its range, nearest to where the joint is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.model.arm import Arm

TOLERANCE_RAD = 1e-9
"""An angle this little outside its range is set onto the end of the range."""


def placed(angle: float, low: float, high: float, previous: float) -> float:
    """Add whole turns to an angle: into the range, there nearest to ``previous``; if none fits, nearest to the range.

    All in rad; NaN stays NaN.
    """
    if math.isnan(angle):
        return angle
    least = math.ceil((low - TOLERANCE_RAD - angle) / math.tau)
    most = math.floor((high + TOLERANCE_RAD - angle) / math.tau)
    if least <= most:
        turns = min(max(round((previous - angle) / math.tau), least), most)
        return min(max(angle + math.tau * turns, low), high)
    below, above = angle + math.tau * (least - 1), angle + math.tau * least
    return below if low - below < above - high else above


@dataclass(frozen=True)
class Ranges:
    """Least and greatest angle of each joint, shape (joints,), in rad."""

    low: Array
    high: Array

    @classmethod
    def of(cls, arm: Arm) -> Ranges:
        """Take the ranges of ``arm``."""
        low, high = np.radians([joint.range_deg for joint in arm.joints]).T
        return cls(low, high)

    @cached_property
    def ends(self) -> tuple[tuple[float, float], ...]:
        """(low, high) of each joint."""
        return tuple(zip(self.low.tolist(), self.high.tolist(), strict=True))

    def placed(self, angles: Sequence[float], previous: Sequence[float]) -> list[float]:
        """``placed`` for each joint of one posture."""
        return [
            placed(angle, low, high, before)
            for angle, (low, high), before in zip(angles, self.ends, previous, strict=True)
        ]

    def excess(self, angles: Sequence[float]) -> list[float]:
        """How far angles lie outside: negative below the range, positive above it, 0 inside."""
        return [
            min(angle - low, 0.0) + max(angle - high, 0.0)
            for angle, (low, high) in zip(angles, self.ends, strict=True)
        ]
