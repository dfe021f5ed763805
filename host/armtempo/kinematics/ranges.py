"""Joint ranges: whole turns added to an angle so that it lies in its range, nearest to where the joint is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.model.arm import Arm
from armtempo.model.parts import END_STEPS

_ROUNDING_RAD = 1e-9
"""Least of ``Ranges.beyond_rad``."""


def _placed(angle: float, low: float, high: float, beyond: float, previous: float) -> float:
    """Add whole turns to an angle: into the range, there nearest to ``previous``; if none fits, nearest to the range.

    ``beyond``: by how much it may be outside. All in rad; NaN stays NaN.
    """
    if math.isnan(angle):
        return angle
    least = math.ceil((low - beyond - angle) / math.tau)
    most = math.floor((high + beyond - angle) / math.tau)
    if least <= most:
        turns = min(max(round((previous - angle) / math.tau), least), most)
        return min(max(angle + math.tau * turns, low), high)
    below, above = angle + math.tau * (least - 1), angle + math.tau * least
    return below if low - below < above - high else above


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
    beyond_rad: Array | None = None
    """(joints,): an angle that is outside by no more is the end of the range; None: by rounding only."""

    @classmethod
    def of(cls, arm: Arm) -> Ranges:
        """Take the ranges of ``arm``."""
        low, high = np.radians([joint.range_deg for joint in arm.joints]).T
        steps_per_deg = [joint.motor.steps_per_deg if joint.motor else math.inf for joint in arm.joints]
        beyond = np.maximum(np.radians(END_STEPS / np.array(steps_per_deg)), _ROUNDING_RAD)
        slides = frozenset(index for index, joint in enumerate(arm.joints) if joint.slides)
        return cls(low, high, slides, beyond)

    @cached_property
    def ends(self) -> tuple[tuple[float, float], ...]:
        """(low, high) of each joint."""
        return tuple(zip(self.low.tolist(), self.high.tolist(), strict=True))

    @cached_property
    def outside_rad(self) -> Array:
        """By how much an angle may be outside: (joints,)."""
        return np.full(len(self.low), _ROUNDING_RAD) if self.beyond_rad is None else self.beyond_rad

    @cached_property
    def _whole(self) -> tuple[tuple[float, float, float, float | None], ...]:
        """Low and high of each joint, how far it may be outside, and the middle if only one number of whole turns fits;
        of a sliding one NaN."""
        return tuple(
            (low, high, beyond, math.nan)
            if index in self.slides
            else (low, high, beyond, 0.5 * (low + high) if high - low < math.tau - 3.0 * beyond else None)
            for index, ((low, high), beyond) in enumerate(
                zip(self.ends, self.outside_rad.tolist(), strict=True)
            )
        )

    def placed(self, angles: Sequence[float], previous: Sequence[float]) -> list[float]:
        """``placed`` for each joint of one posture."""
        return self.fitted(angles, previous)[0]

    def fitted(self, angles: Sequence[float], previous: Sequence[float]) -> tuple[list[float], float]:
        """As ``placed``, and the largest excess over a range; 0 if all are inside."""
        found, most = [], 0.0
        for angle, before, (low, high, beyond, middle) in zip(angles, previous, self._whole, strict=True):
            if not low <= angle <= high or (middle is None and not -_STAYS < angle - before < _STAYS):
                if middle is not None:
                    if middle == middle:  # not NaN
                        angle = middle + _remainder(angle - middle, _TURN)
                elif not low <= (nearest := before + _remainder(angle - before, _TURN)) <= high:
                    angle = _placed(angle, low, high, beyond, before)
                else:
                    angle = nearest
                outside = low - angle if angle < low else angle - high
                if outside > beyond:
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
