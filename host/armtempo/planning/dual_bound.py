"""A proven lower bound of the motion time along a path under speed, acceleration and jerk limits.

With x = (du/dt)^2 as a function of the path's parameter u and ' = d/du, a motion takes the integral of x^(-1/2) and

    speed          q'^2 x                                  <= V^2
    acceleration   |q'' x + q' x' / 2|                     <= A
    jerk           |q' x'' / 2 + 3 q'' x' / 2 + qd x|      <= J x^(-1/2),    qd the third derivative

For any multipliers n >= 0, m = m+ - m-, l = l+ - l- of these constraints, every feasible x takes at least

    D = integral of  min over x > 0 of (w x^(-1/2) + c x)  -  n V^2 - (m+ + m-) A
    w = 1 - sum of J (l+ + l-),    c = sum of n q'^2 + (m q'' - m' q') / 2 + (q' l'' - q'' l') / 2

by weak duality and integration by parts (the boundary terms vanish for a path from rest to rest). The minimum
is 3 / 4^(1/3) w^(2/3) c^(1/3): D is concave in the multipliers, and the interior-point method approximately
maximises it over splines on cells of u: l quadratic, m linear, n constant. For any result,
``lower_bounds.value`` bounds D from below.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.optimise import interior_point
from armtempo.optimise.interior_point import Linearised, Schedule
from armtempo.optimise.kkt import Equalities
from armtempo.planning.variables import Index
from armtempo.splines import bspline

_SHARED = 2
"""Largest distance of cells that share variables."""


class DualKkt:
    """Solves the equations for N cells with G points and L variables each.

    ``columns``: (N, L), variables of each cell; ``slopes``: (N, G, 2, L), of w and c at its points.
    """

    def __init__(self, columns: Index, slopes: Array) -> None:
        count, self._points, _, width = slopes.shape
        self._columns = columns
        self._slopes = np.ascontiguousarray(slopes.reshape(count, -1, width))
        self._size = int(columns.max()) + 1
        self._block = self._slopes.shape[1]
        self._shared = [self._both(apart) for apart in range(1, min(_SHARED, count - 1) + 1)]
        self._rows = (_SHARED + 1) * self._block

    def _both(self, apart: int) -> tuple[Index, Index, Index]:
        """Variables shared by a cell and the cell ``apart`` after it: their numbers, and their places in both.

        The places are the same in all cells, except perhaps the last.
        """
        _, first, second = np.intersect1d(self._columns[0], self._columns[apart], return_indices=True)
        return self._columns[:-apart, first], first, second

    def factor(self, entries: Array) -> DualFactor:
        """The matrix with B (2, 2, N G) and D, one after the other. Raises numpy's LinAlgError if it is singular."""
        from scipy.linalg import lapack  # imported here, because that takes longer than most commands

        size = len(entries) - self._size
        (b00, b01), (_, b11) = entries[:size].reshape(2, 2, len(self._columns), self._points)
        inverse = 1.0 / entries[size:]
        slopes, block = self._slopes, self._block
        diagonal = (slopes * inverse[self._columns][:, None]) @ slopes.swapaxes(1, 2)
        determinant = b00 * b11 - b01 * b01
        point = 2 * np.arange(self._points)
        diagonal[:, point, point] += b11 / determinant
        diagonal[:, point + 1, point + 1] += b00 / determinant
        diagonal[:, point + 1, point] -= b01 / determinant
        band = np.zeros((len(slopes), block, self._rows))  # by columns: band[j][i - j] is the entry i, j
        for column in range(block):
            band[:, column, : block - column] = diagonal[:, column:, column]
        for apart, (shared, first, second) in enumerate(self._shared, 1):
            weighted = slopes[:-apart, :, first] * inverse[shared][:, None]
            other = slopes[apart:, :, second] @ weighted.swapaxes(1, 2)
            for column in range(block):
                start = apart * block - column
                band[:-apart, column, start : start + block] = other[:, :, column]
        lower, info = lapack.dpbtrf(band.reshape(-1, self._rows).T, lower=1, overwrite_ab=True)
        if info != 0:
            raise np.linalg.LinAlgError("singular")
        return DualFactor(lower, inverse, self)

    def forward(self, step: Array) -> Array:
        """Change of w and c at all points by a step: (2 N G,)."""
        return np.asarray((self._slopes @ step[self._columns][:, :, None]).ravel())

    def backward(self, weights: Array) -> Array:
        """Sum of their slopes with these weights: (n,)."""
        sums = self._slopes.swapaxes(1, 2) @ weights.reshape(len(self._slopes), -1, 1)
        return np.asarray(np.bincount(self._columns.ravel(), sums.ravel(), minlength=self._size))


@dataclass(frozen=True, eq=False)
class DualFactor:
    """A factorised matrix."""

    lower: Array
    inverse: Array
    kkt: DualKkt

    def solve(self, gradient: Array, residual: Array) -> Array:
        """The step (n,) that minimises gradient . p + p' H p / 2; ``residual`` is empty."""
        from scipy.linalg import lapack

        first = -self.inverse * gradient
        found, _ = lapack.dpbtrs(self.lower, self.kkt.forward(first), lower=1, overwrite_b=True)
        return np.asarray(first - self.inverse * self.kkt.backward(found))


MINIMUM_FACTOR = 3.0 / 4.0 ** (1.0 / 3.0)
"""The minimum of w x^(-1/2) + c x over x > 0, divided by w^(2/3) c^(1/3)."""
_SCHEDULE = Schedule(first_barrier=100.0, last_barrier=1e-4, curvature=False)
_NODES = 4
"""Gauss points in a cell."""
_JERK, _ACCELERATION, _SPEED = 0.2, 0.05, 0.5
"""Start values of the coefficients."""


@dataclass(frozen=True, eq=False)
class Cells:
    """A path cut into N cells of length 1, with a unit of time in which a cell takes about 1.

    ``pieces``: power coefficients of the angles, (N, k + 1, J); ``limits``: (J, 3) in that unit of time.
    ``rests``: whether the second derivative of the angles is also 0 at both ends.
    """

    pieces: Array
    limits: Array
    rests: bool

    @property
    def count(self) -> int:
        """N."""
        return len(self.pieces)

    @property
    def joints(self) -> int:
        """J."""
        return len(self.limits)


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Coefficients of the multipliers, each times its limit, all >= 0.

    ``jerk``: (2, N + 2, J), those of l+ and l-, quadratic B-splines; ``acceleration``: (2, N + 1, J), of m+ and m-
    at the ends of cells; ``speed``: (N, J), n in each cell.
    """

    jerk: Array
    acceleration: Array
    speed: Array


def best_multipliers(cells: Cells) -> Multipliers:
    """The multipliers that approximately maximise the bound."""
    program = _Dual(cells)
    return program.multipliers(interior_point.minimise(program, program.start(), _SCHEDULE).x)


def quadratic(v: Array) -> Array:
    """Values and first two derivatives of the three quadratic B-splines of a cell at v (P,): (3, 3, P)."""
    one = np.ones_like(v)
    return np.array(
        [
            [0.5 * (1.0 - v) ** 2, 0.5 + v - v**2, 0.5 * v**2],
            [v - 1.0, 1.0 - 2.0 * v, v],
            [one, -2.0 * one, one],
        ]
    )


class _Dual:
    """Minus D per cell, for positive coefficients with positive w and c at the Gauss points of the cells."""

    equalities = Equalities.none()

    def __init__(self, cells: Cells) -> None:
        self._cells = cells
        count, joints = cells.count, cells.joints
        sizes = [2 * joints * (count + 2), 2 * joints * (count + 1), joints * count]
        jerk, acceleration, speed = np.split(np.arange(sum(sizes)), np.cumsum(sizes)[:-1])
        self._jerk, self._acceleration = jerk.reshape(2, -1, joints), acceleration.reshape(2, -1, joints)
        self._speed = speed.reshape(count, joints)
        columns = self._local()
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        self._weights = np.tile(weights / 2 / count, count)
        self._slopes = self._local_slopes((nodes + 1) / 2)
        self._cost = np.zeros(sum(sizes))
        self._cost[self._speed] = 1.0 / count
        self._cost[self._acceleration] = 1.0 / count
        self._cost[self._acceleration[:, [0, -1]]] = 0.5 / count
        if not cells.rests:
            self._cost[self._jerk[:, [0, 1, -2, -1]]] = 1.0 / count  # so that they vanish
        self.kkt = DualKkt(columns, self._slopes)

    def _local(self) -> Index:
        """Variables that act on each cell: (N, 11 J)."""
        cell = np.arange(self._cells.count)
        jerk = [self._jerk[sign, cell + offset] for sign in (0, 1) for offset in range(3)]
        acceleration = [self._acceleration[sign, cell + offset] for sign in (0, 1) for offset in range(2)]
        return np.concatenate([*jerk, *acceleration, self._speed], axis=1)

    def _local_slopes(self, v: Array) -> Array:
        """Derivatives of w and c at v (G,) of each cell by its variables: (N, G, 2, 11 J)."""
        cells = self._cells
        q1, q2 = (_values(bspline.derivative(cells.pieces, order), v) for order in (1, 2))
        speed, acceleration, jerk = cells.limits.T
        b0, b1, b2 = quadratic(v)
        linear = np.stack([1.0 - v, v])
        slope = np.array([-1.0, 1.0])
        none = np.zeros_like(q1)
        w, c = [], []
        for sign in (1.0, -1.0):
            for value, first, second in zip(b0, b1, b2, strict=True):
                w.append(none - value[None, :, None])
                c.append(sign * 0.5 * (q1 * second[:, None] - q2 * first[:, None]) / jerk)
        for sign in (1.0, -1.0):
            for value, first in zip(linear, slope, strict=True):
                w.append(none)
                c.append(sign * 0.5 * (q2 * value[:, None] - q1 * first) / acceleration)
        w.append(none)
        c.append((q1 / speed) ** 2)
        slopes = np.stack([np.concatenate(w, axis=2), np.concatenate(c, axis=2)], axis=2)
        if not cells.rests:
            by_jerk = slopes[..., : 6 * cells.joints].reshape(*slopes.shape[:3], 2, 3, cells.joints)
            by_jerk[0, ..., :2, :] = by_jerk[1:2, ..., :1, :] = 0.0
            by_jerk[-1, ..., 1:, :] = by_jerk[-2:-1, ..., 2:, :] = 0.0
        return slopes

    def start(self) -> Array:
        """A feasible start, with positive w and c: multipliers of speed only."""
        x = np.empty(len(self._cost))
        x[self._jerk] = _JERK / self._cells.joints
        x[self._acceleration] = _ACCELERATION
        x[self._speed] = _SPEED
        return x

    def multipliers(self, x: Array) -> Multipliers:
        """The multipliers of the variables x."""
        jerk = x[self._jerk].copy()
        if not self._cells.rests:
            jerk[:, [0, 1, -2, -1]] = 0.0
        return Multipliers(jerk, x[self._acceleration], x[self._speed])

    def objective(self, x: Array) -> float:
        w, c = self._forms(x)
        # not @, with which BLAS starts threads for 10 000 elements or more
        least = MINIMUM_FACTOR * np.sum(self._weights * np.cbrt(w) ** 2 * np.cbrt(c))
        return float(np.sum(self._cost * x) - least)

    def inequalities(self, x: Array) -> Array:
        return np.concatenate([x, *self._forms(x)])

    def linearise(self, x: Array) -> Linearised:
        return _Linearised(self, *self._forms(x))

    def _forms(self, x: Array) -> tuple[Array, Array]:
        w, c = self.kkt.forward(x).reshape(-1, 2).T
        return 1.0 + w, c


class _Linearised:
    def __init__(self, dual: _Dual, w: Array, c: Array) -> None:
        self._dual = dual
        with np.errstate(all="ignore"):
            least = MINIMUM_FACTOR * dual._weights * np.cbrt(w) ** 2 * np.cbrt(c)
            by_w, by_c = 2.0 / 3.0 * least / w, 1.0 / 3.0 * least / c
        self.gradient = dual._cost - dual.kkt.backward(np.stack([by_w, by_c], axis=1))
        bend = 2.0 / 9.0 * least
        self._curvature = np.array([[bend / w**2, -bend / (w * c)], [-bend / (w * c), bend / c**2]])

    def forward(self, step: Array) -> Array:
        w, c = self._dual.kkt.forward(step).reshape(-1, 2).T
        return np.concatenate([step, w, c])

    def backward(self, weights: Array) -> Array:
        own, w, c = self._split(weights)
        return own + self._dual.kkt.backward(np.stack([w, c], axis=1))

    def hessian(self, weights: Array, _: Array, __: bool) -> Array:
        """Entries for ``DualKkt``: the 2 x 2 matrices of w and c at each point, and the diagonal."""
        own, w, c = self._split(weights)
        both = self._curvature.copy()
        both[0, 0] += w
        both[1, 1] += c
        return np.concatenate([both.ravel(), own])

    def _split(self, weights: Array) -> list[Array]:
        points = len(self._dual._weights)
        return np.split(weights, [len(weights) - 2 * points, len(weights) - points])


def _values(pieces: Array, v: Array) -> Array:
    """Values of pieces (N, k + 1, J) at v (G,): (N, G, J)."""
    powers = v[:, None] ** np.arange(pieces.shape[1])
    return np.asarray(np.einsum("gp,npj->ngj", powers, pieces))
