"""Joint ranges: whole turns added to an angle so that it lies in its range, nearest to where the joint is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.kinematics.geometry import Array
from armtempo.model.arm import Arm

TOLERANCE_RAD = 1e-9
"""An angle this little outside its range is set onto the end of the range."""


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

    def place(self, angles: Array, previous: Array) -> Array:
        """Add whole turns: into the range, there nearest to ``previous``; if none fits, nearest to the range.

        ``angles`` and ``previous`` have shape (..., joints), in rad; so has the result.
        """
        turn = 2 * np.pi
        least = np.ceil((self.low - TOLERANCE_RAD - angles) / turn)
        most = np.floor((self.high + TOLERANCE_RAD - angles) / turn)
        nearest = angles + turn * np.clip(np.rint((previous - angles) / turn), least, most)
        inside = np.clip(nearest, self.low, self.high)
        below, above = angles + turn * (least - 1), angles + turn * least
        outside = np.where(self.low - below < above - self.high, below, above)
        return np.where(least <= most, inside, outside)

    def excess(self, angles: Array) -> Array:
        """How far angles lie outside: negative below the range, positive above it, 0 inside."""
        return np.minimum(angles - self.low, 0.0) + np.maximum(angles - self.high, 0.0)
