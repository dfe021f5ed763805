"""A planned motion as splines over time: angle and its derivatives at any time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class JointSpline:
    """One joint: angle over u and time over u, both uniform B-splines of the same degree.

    With n path segments and refinement R, ``angle_points_deg`` has shape (n + degree,) and
    ``time_points_s`` shape (n * R + degree,).
    """

    degree: int
    refine: int
    angle_points_deg: Array
    time_points_s: Array


@dataclass(frozen=True)
class Trajectory:
    """All joints of a motion; with shared timing all joints hold the same ``time_points_s``."""

    name: str
    joints: tuple[JointSpline, ...]
    shared: bool
