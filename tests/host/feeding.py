"""The paper's feeding motion: via points and the joints' limits, and what of a spline is seen on a fine grid."""

from __future__ import annotations

import numpy as np
from armtempo.model.parts import Limits
from armtempo.splines import bspline
from armtempo.splines.trajectory import JointSpline

FEEDING = np.array(
    [
        [0, -60, 40],
        [20, -75, 50],
        [40, -110, 70],
        [90, -85, 40],
        [130, -60, 10],
        [160, -45, -20],
        [180, -38, -52],
    ],
    dtype=float,
)

LIMITS = [Limits(50, 50, 150), Limits(40, 30, 120), Limits(60, 40, 150)]


def dense(joint: JointSpline, order: int, count: int = 400) -> float:
    """Largest magnitude on a fine grid of u, both sides of each knot."""
    u = np.tile(np.linspace(0, 1, count), len(joint.time_polynomials))
    segment = np.repeat(np.arange(len(joint.time_polynomials)), count)

    def at(pieces: np.ndarray, n: int) -> np.ndarray:
        return bspline.evaluate(bspline.derivative(pieces, n), segment, u)

    q = [at(joint.angle_polynomials, n) for n in range(4)]
    t = [at(joint.time_polynomials, n) for n in range(4)]
    values = [
        q[1] / t[1],
        (q[2] * t[1] - q[1] * t[2]) / t[1] ** 3,
        (q[3] * t[1] ** 2 - 3 * q[2] * t[1] * t[2] + 3 * q[1] * t[2] ** 2 - q[1] * t[1] * t[3]) / t[1] ** 5,
    ]
    return float(np.abs(values[order - 1]).max())
