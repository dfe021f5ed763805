"""Rigorous bounds of the largest speed, acceleration and jerk of a motion.

All three are quotients of polynomials in u whose denominator is a power of t' > 0 (Eqs. 17 to 19). With both in
Bernstein form of the same degree, the quotients of their coefficients bound the quotient on the segment. Pieces
that may contain the maximum are halved (branch and bound), which reduces the gap quadratically.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armtempo.splines import bernstein
from armtempo.splines.bspline import Array
from armtempo.splines.trajectory import JointSpline

GAP = 1e-11
"""Largest relative difference of a bound from the true maximum."""

_DEPTH = 48
"""Halvings after which a piece is narrower than the resolution of a double."""


@dataclass(frozen=True)
class Extremes:
    """Upper bounds of a joint's motion, within GAP."""

    speed_deg_s: float
    acceleration_deg_s2: float
    jerk_deg_s3: float

    @property
    def values(self) -> Array:
        """Speed, acceleration, jerk: (3,)."""
        return np.array([self.speed_deg_s, self.acceleration_deg_s2, self.jerk_deg_s3])


def of_joint(joint: JointSpline) -> Extremes:
    """The extremes of a joint's whole motion."""
    return of_joints([joint])[0]


def of_joints(joints: Sequence[JointSpline]) -> tuple[Extremes, ...]:
    """The extremes of each joint's whole motion; all joints must have the same number of segments."""
    angle = np.stack([joint.angle_polynomials for joint in joints])
    time = np.stack([joint.time_polynomials for joint in joints])
    return tuple(Extremes(*map(float, values)) for values in magnitudes(angle, time))


def magnitudes(angle: Array, time: Array) -> Array:
    """Upper bounds, within GAP, of |speed|, |acceleration|, |jerk| over all segments: (J, 3).

    ``angle``: (J, m, k + 1) and ``time``: (m, k + 1) or (J, m, k + 1), power coefficients, t' > 0.
    """
    joints = angle.shape[0]
    top, bottom = quotients(angle, time)
    group = np.broadcast_to(np.arange(3 * joints).reshape(joints, 1, 3), top.shape[:-1])
    return largest_quotients(
        top.reshape(-1, top.shape[-1]), bottom.reshape(-1, top.shape[-1]), group.ravel(), 3 * joints
    ).reshape(joints, 3)


def quotients(angle: Array, time: Array) -> tuple[Array, Array]:
    """Plain Bernstein numerators and denominators of speed, acceleration, jerk: each (J, m, 3, d + 1).

    With ' = d/du: q' / t', (q'' t' - q' t'') / t'^3 =: a / t'^3, (a' t' - 3 a t'') / t'^5.
    """
    powers = np.arange(1, angle.shape[-1])
    q1 = bernstein.from_power(angle[..., 1:] * powers)
    t1 = bernstein.from_power(np.broadcast_to(time, angle.shape)[..., 1:] * powers)
    q2, t2 = bernstein.derivative(q1), bernstein.derivative(t1)
    multiply = bernstein.multiply
    a = multiply(q2, t1) - multiply(q1, t2)
    j = multiply(bernstein.derivative(a), t1) - 3 * multiply(a, t2)
    cube = multiply(multiply(t1, t1), t1)
    fifth = multiply(multiply(cube, t1), t1)
    degree = fifth.shape[-1] - 1
    top = [bernstein.unscale(bernstein.elevate(p, degree)) for p in (q1, a, j)]
    bottom = [bernstein.unscale(bernstein.elevate(p, degree)) for p in (t1, cube, fifth)]
    return np.stack(top, axis=-2), np.stack(bottom, axis=-2)


def largest_quotients(top: Array, bottom: Array, group: NDArray[np.intp], groups: int) -> Array:
    """Upper bounds, within GAP, of max |top / bottom| over the pieces of each group: (groups,).

    ``top`` and ``bottom``: (P, d + 1) plain Bernstein coefficients over [0, 1], bottom positive; ``group``:
    (P,). The same branch and bound for every group at once.
    """
    best = np.zeros(groups)
    for _ in range(_DEPTH):
        quotient = np.abs(top / bottom)
        np.maximum.at(best, group, np.maximum(quotient[:, 0], quotient[:, -1]))
        open_ = quotient.max(axis=1) > best[group] * (1 + GAP)
        if not open_.any():
            return np.asarray(best * (1 + GAP))
        top = bernstein.halves(top[open_]).reshape(-1, top.shape[1])
        bottom = bernstein.halves(bottom[open_]).reshape(-1, bottom.shape[1])
        group = np.repeat(group[open_], 2)
    np.maximum.at(best, group, np.abs(top / bottom).max(axis=1))
    return np.asarray(best * (1 + GAP))


def range_of(polynomials: Array) -> tuple[Array, Array]:
    """Lowest and highest angle of each joint, within GAP of its range: two arrays (J,).

    ``polynomials``: (J, m, k + 1), power coefficients.
    """
    plain = bernstein.unscale(bernstein.from_power(polynomials))
    joints, pieces, count = plain.shape
    low, high = plain.min(axis=(1, 2)), plain.max(axis=(1, 2))
    group = np.repeat(np.arange(joints), pieces)
    bottom = np.ones((joints * pieces, count))
    above = largest_quotients((plain - low[:, None, None]).reshape(-1, count), bottom, group, joints)
    below = largest_quotients((high[:, None, None] - plain).reshape(-1, count), bottom, group, joints)
    return high - below / (1 + GAP), low + above / (1 + GAP)
