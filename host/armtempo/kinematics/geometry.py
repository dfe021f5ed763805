"""The geometry of a serial arm: its Denavit-Hartenberg table, lengths in any one unit, angles in radians."""

from __future__ import annotations

import math
from dataclasses import dataclass

from armtempo.arrays import Array as Array
from armtempo.model.arm import Arm


@dataclass(frozen=True)
class Geometry:
    """Denavit-Hartenberg rows, standard (distal) convention, revolute joints only.

    Row i is the transform Rz(angle + offset) Tz(d) Tx(a) Rx(alpha) from frame i - 1 to frame i.
    All lengths share one unit, which is also the unit of the poses.
    """

    d: tuple[float, ...]
    a: tuple[float, ...]
    alpha: tuple[float, ...]
    offset: tuple[float, ...]
    """Added to each joint's angle."""

    @classmethod
    def of(cls, arm: Arm) -> Geometry:
        """Take the geometry of ``arm``: lengths in mm."""
        return cls(
            d=tuple(joint.d_mm for joint in arm.joints),
            a=tuple(joint.a_mm for joint in arm.joints),
            alpha=tuple(math.radians(joint.alpha_deg) for joint in arm.joints),
            offset=tuple(math.radians(joint.theta_offset_deg) for joint in arm.joints),
        )

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.d)

    @property
    def reach(self) -> float:
        """Sum of all lengths but the base height: no tool point is farther from the foot of joint 2."""
        return math.fsum(map(abs, self.d[1:])) + math.fsum(map(abs, self.a))


def twist(alpha: float) -> tuple[float, float]:
    """Cosine and sine of ``alpha`` (rad), exact at multiples of a quarter turn."""
    quarters = alpha / (math.pi / 2)
    if abs(quarters - round(quarters)) < 1e-12:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarters) % 4]
    return math.cos(alpha), math.sin(alpha)
