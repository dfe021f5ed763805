"""The limits as smooth functions of the time axis, with derivatives, for gradient solvers.

With ' = d/du and t(u) linear in the variables y, Eqs. (17) to (19) become polynomials in t', t'', t''':

    speed          V t'        - |q'|                                                  >= 0
    acceleration   A t'^3      - |q'' t' - q' t''|                                     >= 0
    jerk           J t'^5      - |q''' t'^2 - 3 q'' t' t'' + 3 q' t''^2 - q' t' t'''|  >= 0

each divided by its first term, so that a row is 1 - reached / limit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armtempo.model.arm import Limits
from armtempo.planning.fitness import stretch_of
from armtempo.splines import bspline, extremes
from armtempo.splines.bspline import Array

Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Rows:
    """Where limits are watched: segment, u, joint and kind (0 speed, 1 acceleration, 2 jerk), each (P,)."""

    segment: Index
    u: Array
    joint: Index
    kind: Index

    def __add__(self, other: Rows) -> Rows:
        return Rows(
            np.concatenate([self.segment, other.segment]),
            np.concatenate([self.u, other.u]),
            np.concatenate([self.joint, other.joint]),
            np.concatenate([self.kind, other.kind]),
        )


class Path:
    """A fixed path with limits, and the linear map from variables y (v,) to the time axis.

    ``angle_points_deg``: (n + degree, J), one of ``limits`` each; ``axis``: (v, m + degree) as from
    ``timeaxis.step_map`` or ``free_map``, m a multiple of n.
    """

    def __init__(self, angle_points_deg: Array, degree: int, limits: Sequence[Limits], axis: Array) -> None:
        self.axis = axis
        self.degree = degree
        self.segments = axis.shape[1] - degree
        parts = self.segments // (len(angle_points_deg) - degree)
        pieces = bspline.subdivide(bspline.polynomials(angle_points_deg, degree), parts)
        self.limits = np.array([limit.values for limit in limits])
        self.joints = len(self.limits)
        self.angle = np.ascontiguousarray(np.moveaxis(pieces, 2, 0))
        times = bspline.polynomials(np.ascontiguousarray(axis.T), degree)
        self.weights = times[-1].sum(axis=0)
        """The motion time is ``weights @ y``."""
        self._angles = [bspline.derivative(pieces, order) for order in (1, 2, 3)]
        self._times = [bspline.derivative(times, order) for order in (1, 2, 3)]

    def derivatives(self, segment: Index, u: Array) -> tuple[Array, Array]:
        """q', q'', q''' (3, P, J) and the maps from y to t', t'', t''' (3, P, v) at points (P,)."""

        def at(pieces: list[Array]) -> Array:
            return np.stack(
                [
                    np.einsum("pc,pcx->px", u[:, None] ** np.arange(piece.shape[1]), piece[segment])
                    for piece in pieces
                ]
            )

        return at(self._angles), at(self._times)

    def stretched(self, y: Array) -> Array:
        """``y`` scaled until the motion just keeps every limit, proven.

        Scaling time by s scales speed by 1/s, acceleration by 1/s², jerk by 1/s³.
        """
        time = bspline.polynomials(y @ self.axis, self.degree)
        ratios = extremes.magnitudes(self.angle, time) / self.limits
        return np.asarray(y * float(stretch_of(ratios.T).max()))

    def duration_s(self, y: Array) -> float:
        """Motion time."""
        return float(self.weights @ y)

    def slack(self, parts: int, y: Array) -> Array:
        """1 - reached / limit on a grid of each segment: (m, parts + 1, J, 3)."""
        segment, u = self.grid(parts)
        angles, maps = self.derivatives(segment, u)
        times = (maps @ y)[:, :, None]
        allowed = self.limits.T[:, None, :] * times[0] ** _POWERS[:, None, None]
        ratio = np.abs(np.stack(_numerators(angles, times))) / allowed
        slack = np.moveaxis(1.0 - ratio, 0, 2)
        return np.asarray(slack.reshape(self.segments, parts + 1, self.joints, 3))

    def grid(self, parts: int) -> tuple[Index, Array]:
        """Segment and u of ``parts`` + 1 points in every segment."""
        segment = np.repeat(np.arange(self.segments), parts + 1)
        return segment, np.tile(np.linspace(0.0, 1.0, parts + 1), self.segments)


_POWERS = np.array([1, 3, 5])
"""Powers of t' below speed, acceleration and jerk."""


def _numerators(q: Array, t: Array) -> tuple[Array, Array, Array]:
    """The terms between the bars above; ``q`` and ``t``: first to third derivatives."""
    q1, q2, q3 = q
    t1, t2, t3 = t
    return q1, q2 * t1 - q1 * t2, q3 * t1**2 - 3 * q2 * t1 * t2 + 3 * q1 * t2**2 - q1 * t1 * t3


class Constraints:
    """The rows as functions of y, feasible where not negative; signs and scale are those at ``y``."""

    def __init__(self, path: Path, rows: Rows, y: Array) -> None:
        angles, self._maps = path.derivatives(rows.segment, rows.u)
        index = np.arange(len(rows.u))
        self._q = angles[:, index, rows.joint]
        self._kind = rows.kind
        self._power = _POWERS[rows.kind]
        self._limit = path.limits[rows.joint, rows.kind]
        times = self._maps @ y
        self._sign = np.sign(np.choose(rows.kind, _numerators(self._q, times)))
        self._scale = self._limit * times[0] ** self._power

    def values(self, y: Array) -> Array:
        """(P,)."""
        times = self._maps @ y
        reached = self._sign * np.choose(self._kind, _numerators(self._q, times))
        return np.asarray((self._limit * times[0] ** self._power - reached) / self._scale)

    def gradient(self, y: Array) -> Array:
        """(P, v)."""
        t1, t2, t3 = self._maps @ y
        q1, q2, q3 = self._q
        none = np.zeros_like(t1)
        by_t1 = np.choose(self._kind, (none, q2, 2 * q3 * t1 - 3 * q2 * t2 - q1 * t3))
        by_t2 = np.choose(self._kind, (none, -q1, 6 * q1 * t2 - 3 * q2 * t1))
        by_t3 = np.choose(self._kind, (none, none, -q1 * t1))
        by = -self._sign * np.stack([by_t1, by_t2, by_t3])
        by[0] += self._power * self._limit * t1 ** (self._power - 1)
        return np.asarray(np.einsum("op,opv->pv", by / self._scale, self._maps))


def near_rows(path: Path, y: Array, parts: int, slack: float) -> Rows:
    """Rows on a grid that have less than ``slack`` left."""
    point, part, joint, kind = np.nonzero(path.slack(parts, y) < slack)
    return Rows(point, part / parts, joint, kind)


def peak_rows(path: Path, y: Array, parts: int, slack: float) -> Rows:
    """Rows at the peaks between grid points, by parabolas, that have less than ``slack`` left."""
    left = path.slack(parts, y)
    before, middle, after = left[:, :-2], left[:, 1:-1], left[:, 2:]
    bend = before - 2 * middle + after
    offset = np.divide(before - after, 2 * bend, out=np.full_like(bend, np.inf), where=bend > 0)
    inner = np.abs(offset) <= 0.5
    inner[:, 0] |= np.abs(offset[:, 0] + 0.5) <= 0.5
    inner[:, -1] |= np.abs(offset[:, -1] - 0.5) <= 0.5
    point, part, joint, kind = np.nonzero(inner & (middle < slack))
    u = (part + 1 + offset[point, part, joint, kind]) / parts
    return Rows(point, u, joint, kind)
