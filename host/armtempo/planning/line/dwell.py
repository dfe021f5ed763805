"""Dwells between two legs: inserted segments in which only time passes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.motion_program import mean_slopes

DEGREE = 5
DWELL_SEGMENTS = DEGREE
"""Segments that a dwell adds to the path."""
_LEAST_STEP = 1e-3
"""Addition to the time axis for a dwell that is too short, as a fraction of the step before it."""


@dataclass(frozen=True, eq=False)
class TimedPath:
    """A path of S segments on a time axis with ``refine`` segments per path segment."""

    angle_points_deg: Array
    """(S + 5, J)."""
    differences_s: Array
    """Of the time control points, (S * refine + 4,)."""
    arrivals: tuple[int, ...]
    """Segments before each via point."""
    refine: int

    def with_dwells(self, dwells_s: Mapping[int, float]) -> TimedPath:
        """The path with dwells, in seconds by via point; each is at a rest, where five control points are equal.

        The time axis before and after is unchanged. The four differences common to both sides of the rest are
        duplicated, so a dwell lasts at least their sum: hundredths to tenths of a second.
        """
        timed = self
        for via in sorted(dwells_s, reverse=True):
            timed = timed._with_dwell(via, dwells_s[via])
        return timed

    def _with_dwell(self, via: int, dwell_s: float) -> TimedPath:
        knot, shared = self.arrivals[via], DEGREE - 1
        segments = -(-DEGREE // self.refine)
        first, count = knot * self.refine, segments * self.refine
        before, after = self.differences_s[: first + shared], self.differences_s[first:]
        twice = np.concatenate([before[-shared:], np.zeros(count - shared), after[:shared]])
        lasts_s = float(np.convolve(np.ones(count), mean_slopes(DEGREE)) @ twice)
        step = max((dwell_s - lasts_s) / (count - shared), _LEAST_STEP * before[-1])
        return TimedPath(
            np.insert(self.angle_points_deg, [knot] * segments, self.angle_points_deg[knot], axis=0),
            np.concatenate([before, np.full(count - shared, step), after]),
            tuple(at + segments * (number > via) for number, at in enumerate(self.arrivals)),
            self.refine,
        )
