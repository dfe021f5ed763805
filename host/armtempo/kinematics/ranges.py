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
"""An angle outside its range by less than this is set to the end of the range."""


def _placed(angle: float, low: float, high: float, previous: float) -> float:
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


_ONE_TURN = math.tau - 3.0 * TOLERANCE_RAD
"""In a range narrower than this only one number of whole turns fits."""

_remainder, _TURN = math.remainder, math.tau

_STAYS = 0.99 * math.pi
"""An angle in its range and nearer than this to the previous one needs no whole turn added."""


@dataclass(frozen=True)
class Ranges:
    """Least and greatest angle of each joint, shape (joints,), in rad."""

    low: Array
    high: Array
    slides: frozenset[int] = frozenset()
    """Indices of sliding joints, to whose positions no turns are added."""

    @classmethod
    def of(cls, arm: Arm) -> Ranges:
        """Take the ranges of ``arm``."""
        low, high = np.radians([joint.range_deg for joint in arm.joints]).T
        return cls(low, high, frozenset(index for index, joint in enumerate(arm.joints) if joint.slides))

    @cached_property
    def ends(self) -> tuple[tuple[float, float], ...]:
        """(low, high) of each joint."""
        return tuple(zip(self.low.tolist(), self.high.tolist(), strict=True))

    @cached_property
    def _whole(self) -> tuple[tuple[float, float, float | None], ...]:
        """Low and high of each joint, and the middle if only one number of whole turns fits; of a sliding one NaN."""
        return tuple(
            (low, high, math.nan)
            if index in self.slides
            else (low, high, 0.5 * (low + high) if high - low < _ONE_TURN else None)
            for index, (low, high) in enumerate(self.ends)
        )

    def placed(self, angles: Sequence[float], previous: Sequence[float]) -> list[float]:
        """``placed`` for each joint of one posture."""
        return self.fitted(angles, previous)[0]

    def fitted(self, angles: Sequence[float], previous: Sequence[float]) -> tuple[list[float], float]:
        """As ``placed``, and the largest excess over a range; 0 if all are inside."""
        found, most = [], 0.0
        for angle, before, (low, high, middle) in zip(angles, previous, self._whole, strict=True):
            if not low <= angle <= high or (middle is None and not -_STAYS < angle - before < _STAYS):
                if middle is not None:
                    if middle == middle:  # not NaN
                        angle = middle + _remainder(angle - middle, _TURN)
                elif not low <= (nearest := before + _remainder(angle - before, _TURN)) <= high:
                    angle = _placed(angle, low, high, before)
                else:
                    angle = nearest
                outside = low - angle if angle < low else angle - high
                if outside > TOLERANCE_RAD:
                    most = outside if outside > most else most
                elif outside > 0.0:
                    angle = min(max(angle, low), high)
            found.append(angle)
        return found, most

    def excess(self, angles: Sequence[float]) -> list[float]:
        """Excess of angles over their ranges: negative below, positive above, 0 inside."""
        return [
            min(angle - low, 0.0) + max(angle - high, 0.0)
            for angle, (low, high) in zip(angles, self.ends, strict=True)
        ]
