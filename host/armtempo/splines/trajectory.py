"""A planned motion: splines of angle and time, and the angle's derivatives at any time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armtempo.basics import json_codec
from armtempo.basics.arguments import checked
from armtempo.basics.errors import InputError
from armtempo.splines import bspline, time_axis
from armtempo.splines.bspline import Array


@dataclass(frozen=True, eq=False)
class JointSpline:
    """A joint's angle over u and time over u, uniform B-splines of the same degree.

    With n path segments and refinement R, ``angle_points_deg`` has shape (n + degree,) and
    ``time_points_s`` shape (n * R + degree,).
    """

    degree: int
    refine: int
    angle_points_deg: Array
    time_points_s: Array
    via_segments: tuple[int, ...] | None = field(default=None, metadata=json_codec.ADDED)
    """Number of path segments before each via point; None: each path segment ends at one."""

    @cached_property
    def angle_polynomials(self) -> Array:
        """Angle over each time segment, power basis: (n * R, degree + 1)."""
        return bspline.subdivide(bspline.polynomials(self.angle_points_deg, self.degree), self.refine)

    @cached_property
    def time_polynomials(self) -> Array:
        """Time over each time segment, power basis: (n * R, degree + 1)."""
        return bspline.polynomials(self.time_points_s, self.degree)

    @cached_property
    def duration_s(self) -> float:
        """Time at the end."""
        return float(self.time_polynomials[-1].sum())

    @cached_property
    def via_times_s(self) -> Array:
        """Times at which the joint passes each via point, seconds (n + 1,)."""
        knots = np.append(self.time_polynomials[:: self.refine, 0], self.duration_s)
        return knots if self.via_segments is None else np.asarray(knots[list(self.via_segments)])

    def __call__(self, time_s: ArrayLike, order: int = 0) -> Array:
        """Angle (order 0), speed, acceleration or jerk (order 3) in deg, deg/s, deg/s², deg/s³.

        Returns the shape of ``time_s``. Outside of [0, duration] the joint rests: first or last angle, derivatives 0.
        Eqs. (17) to (19); jerk by differentiation, as Eq. (19) has a misprint.
        """
        time = np.asarray(time_s, dtype=float)
        segment, u = time_axis.parameter(self.time_polynomials, time)
        value = derivatives(self.angle_polynomials, self.time_polynomials, segment, u, order)
        if order > 0:
            value = np.where((time < 0) | (time > self.duration_s), 0.0, value)
        return value

    def sampled(self, parts: int) -> tuple[Array, Array]:
        """Times (N,), and speed, acceleration and jerk there (3, N), at ``parts`` equidistant u in each segment.

        Units as in ``__call__``; quicker than that, as no u has to be found.
        """
        powers = _powers(parts)

        def at(coefficients: Array, order: int) -> Array:
            found = bspline.derivative(coefficients, order)
            return np.asarray((found @ powers[: found.shape[1]]).ravel())

        angle = [at(self.angle_polynomials, order) for order in range(1, 4)]
        time = [at(self.time_polynomials, order) for order in range(4)]
        return time[0], np.stack(by_time(angle, time[1:]))


@cache
def _powers(parts: int) -> Array:
    """Powers 0 to 5 of equidistant u, (6, parts)."""
    return np.vander(np.linspace(0.0, 1.0, parts), max(bspline.DEGREES) + 1, increasing=True).T.copy()


def by_time(angle: Sequence[Array] | Array, time: Sequence[Array] | Array, count: int = 3) -> list[Array]:
    """The first ``count`` of speed, acceleration and jerk, from as many derivatives of angle and time by u.

    Eqs. (17) to (19), the last as differentiation gives it.
    """
    inverse = 1.0 / time[0]
    found = [angle[0] * inverse]
    if count > 1:
        found.append((angle[1] - found[0] * time[1]) * inverse**2)
    if count > 2:
        found.append((angle[2] - 3.0 * found[1] * time[0] * time[1] - found[0] * time[2]) * inverse**3)
    return found


def derivatives(angle: Array, time: Array, segment: NDArray[np.intp], u: Array, order: int) -> Array:
    """The ``order``-th time derivative of the angle at (segment, u), from power coefficients of both."""

    def at(coefficients: Array, n: int) -> Array:
        return bspline.evaluate(bspline.derivative(coefficients, n), segment, u)

    if order == 0:
        return at(angle, 0)
    orders = range(1, order + 1)
    return by_time([at(angle, n) for n in orders], [at(time, n) for n in orders], order)[-1]


@checked
@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """All joints of a motion; with shared timing all have the same ``time_points_s``."""

    name: str
    joints: tuple[JointSpline, ...]
    shared: bool

    def __repr__(self) -> str:
        return f"<Trajectory {self.name!r}: {len(self.joints)} joints, {self.duration_s:.3f} s>"

    @property
    def duration_s(self) -> float:
        """Time at which the last joint arrives."""
        return max(joint.duration_s for joint in (self.joints[:1] if self.shared else self.joints))

    def __call__(self, time_s: ArrayLike, order: int = 0) -> Array:
        """Like ``JointSpline.__call__``, all joints in the last axis: (..., J)."""
        if not 0 <= order <= 3:
            raise InputError(
                f"a derivative of order {order} is not known", "give 0 (angle), 1 (speed), 2 or 3 (jerk)"
            )
        return np.stack([joint(time_s, order) for joint in self.joints], axis=-1)
