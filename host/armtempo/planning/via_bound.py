"""A proven lower bound of the time of all motions through via points, joints together, whatever their path.

For a joint between two via points, d apart, and any constant h and functions k(t), l(t),

    h d + change of (k v + l a) = integral of (h + k') v + (k + l') a + l j
                               <= integral of V |h + k'| + A |k + l'| + J |l|

over its speed, acceleration and jerk. So with k and l given at both via points, T from one to the other takes

    T + (k v + l a where it starts) - (k v + l a where it ends)  >=  E(T)
    E(T) = T + sum over joints of (h d - integral of V |h + k'| + A |k + l'| + J |l|)

Summed over the stretches of a motion from rest to rest, all but T cancels out: no motion takes less than the sum of the
least E over T, whatever the k and l at via points and, for each T, h and what k and l are between.

Newton's method on smoothed absolute values finds about the best: k and l at via points by a few T near those of a plan
(``_best``), then, with these, for many T (``_Scan``). What it ends with need not be the best: E is computed from it,
with integrals that are rather too large. From one T to the next, h and, as functions of t / T, k and l change linearly;
E is at least its line less s (1 - s) times (T2 - T1) the integral of V |dh| + A |dk| + J |dl|, for the products with T.
Beyond the last T the functions wait at some t, which costs no more than it takes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.progress import alive

_CELLS = 8
"""Parts of a stretch; on each k is linear, l quadratic."""
_ABOUT = np.array([0.97, 1.0, 1.03])
"""Times that k and l at via points are chosen for, as parts of those told."""
_SCANNED = np.array([0.4, 0.55, 0.7, 0.8, 0.87, 0.92, 0.96, 1.0, 1.04, 1.09, 1.16, 1.28, 1.5, 2.0, 3.0])
"""Times for which E is computed at first."""
_LONGER = 2.0
"""The next one after the last."""
_ROUNDS = 6
"""Times are added so often between those where E may be lower."""
_SMOOTH, _SHARP, _FALL = 0.1, 1e-5, 0.3
"""Smoothing of absolute values as a part of the mean time of a stretch: first, last, and what it falls by."""
_WARM = 1e-2
"""The first where columns come from a time near by."""
_MOST_STEPS = 60
_ARMIJO = 1e-4
_FINE = 2e-3
"""E is known well enough if its least is within this part of the time."""
_ABOVE = 0.1
"""E is high enough if it is by this part of the time above its least."""
_WILD = 30.0
"""Columns that many times those for a longer time are no good start."""
_SHORTEST = 1e-3
"""Least time told that is believed, as a part of the mean."""
_ROUNDING = 1e-9
"""Part of the terms of E that their rounding is less than."""

_LOCAL = 3 * _CELLS - 1
"""Columns of one joint and stretch: h, k and l where cells meet, middle Bernstein coefficients of l; then k and l
at the start and at the end."""
_COLUMNS = _LOCAL + 4
_K = np.array([_LOCAL, *range(1, _CELLS), _LOCAL + 2])
_L = np.array([_LOCAL + 1, *range(_CELLS, 2 * _CELLS - 1), _LOCAL + 3])
"""Of k and l where cells meet, from start to end."""


def _patterns() -> Array:
    """What stands in absolute values by columns, (5, 6 N, C), times T V, V, T A, A and T J."""
    cells = _CELLS
    found = np.zeros((5, 6 * cells, _COLUMNS))
    for cell in range(cells):
        row, middle = 6 * cell, 2 * cells - 1 + cell
        found[0, row, 0] = 1.0 / cells
        found[1, row, [_K[cell], _K[cell + 1]]] = -1.0, 1.0
        for end, (first, second) in enumerate(((_L[cell], middle), (middle, _L[cell + 1])), 1):
            found[2, row + end, _K[cell + end - 1]] = 0.5 / cells
            found[3, row + end, [first, second]] = -1.0, 1.0
        found[4, range(row + 3, row + 6), [_L[cell], middle, _L[cell + 1]]] = 1.0 / (3 * cells)
    return found


_PATTERNS = _patterns()


@np.errstate(all="ignore")  # where numbers are too far apart in size nothing is proven
def floor_s(via_deg: Array, limits: Array, times_s: Array, rests: bool = True) -> float:
    """No motion from rest through via angles (n + 1, J), to rest if ``rests``, takes less.

    ``limits``: (J, 3). ``times_s``: (n,), about what it takes from one to the next; 0 if nothing is proven.
    """
    moves = np.ptp(via_deg, axis=0) > 0.0
    if not moves.any():
        return 0.0
    size, unit_s = np.ptp(via_deg, axis=0)[moves], float(np.mean(times_s))
    ways = np.diff(via_deg[:, moves], axis=0) / size
    rounded = np.finfo(float).eps * np.max(np.abs(via_deg[:, moves]), axis=0) / size
    ways = np.sign(ways) * np.maximum(np.abs(ways) - 8 * rounded, 0.0)
    scaled = limits[moves] / size[:, None] * unit_s ** np.arange(1, 4)
    about = np.maximum(times_s / unit_s, _SHORTEST)
    times = about[:, None] * _ABOUT
    try:
        found = float(np.sum(_Scan(ways, scaled, times, _best(ways, scaled, times, rests)).floor()))
    except np.linalg.LinAlgError:  # numbers too far apart in size, or no motion takes times so short
        return 0.0
    return max(found, 0.0) * unit_s if np.isfinite(found) else 0.0


@dataclass(frozen=True, eq=False)
class _Cost:
    """E of any stretches and times, by columns x (..., J, C).

    ``ways``: (..., J); ``times``: (...); ``forms``: (..., J, 6 N, C).
    """

    ways: Array
    times: Array
    forms: Array

    @classmethod
    def of(cls, ways: Array, limits: Array, times: Array) -> _Cost:
        """``limits``: (J, 3)."""
        speed, acceleration, jerk = limits.T
        t = times[..., None]
        one = np.ones_like(t)
        weights = [t * speed, one * speed, t * acceleration, one * acceleration, t * jerk]
        return cls(ways, times, np.tensordot(np.stack(weights, axis=-1), _PATTERNS, 1))

    def take(self, which: NDArray[np.intp]) -> _Cost:
        """Some of them."""
        return _Cost(self.ways[which], self.times[which], self.forms[which])

    def inside(self, x: Array) -> Array:
        """What stands in absolute values: (..., J, 6 N)."""
        return np.asarray((self.forms @ x[..., None])[..., 0])

    def exact(self, x: Array, inside: Array) -> Array:
        """E, (...), less what rounding may have added."""
        gained, lost = self.ways * x[..., 0], np.abs(inside).sum(axis=-1)
        terms = np.abs(gained) + np.sum(np.abs(self.forms) @ np.abs(x)[..., None], axis=(-1, -2))
        return np.asarray(self.times + np.sum(gained - lost - _ROUNDING * terms, axis=-1))

    def smooth(self, x: Array, inside: Array, smoothing: float) -> Array:
        """A little more than E by joint, (..., J), without the time."""
        root = np.sqrt(smoothing**2 + inside**2)
        lost = root - smoothing + smoothing * np.log(2.0 * smoothing / (root + smoothing))
        return np.asarray(self.ways * x[..., 0] - lost.sum(axis=-1))

    def derivatives(self, inside: Array, smoothing: float) -> tuple[Array, Array]:
        """Of that: gradient (..., J, C), and minus the second derivatives (..., J, C, C)."""
        root = np.sqrt(smoothing**2 + inside**2)
        gradient = -((inside / (smoothing + root))[..., None, :] @ self.forms)[..., 0, :]
        gradient[..., 0] += self.ways
        weighted = self.forms * np.sqrt(smoothing / (root * (smoothing + root)))[..., None]
        bend = weighted.swapaxes(-1, -2) @ weighted
        diagonal = np.arange(_COLUMNS)
        bend[..., diagonal, diagonal] *= 1.0 + 1e-12
        bend[..., 0, 0] += np.finfo(float).tiny  # of no time h is without effect
        return gradient, bend


def _best(ways: Array, limits: Array, times: Array, rests: bool) -> Array:
    """Columns (n, M, J, C) for times (n, M), equal where stretches meet, with about the highest sum of least E.

    The least over times is smooth too: the y with sum of smoothing / (E - y) = 1.
    """
    cost = _Cost.of(ways[:, None], limits, times)
    x = np.zeros((*times.shape, ways.shape[1], _COLUMNS))
    inside, smoothing = cost.inside(x), _SMOOTH

    def value(x: Array, inside: Array) -> tuple[float, Array]:
        e = times + cost.smooth(x, inside, smoothing).sum(axis=-1)
        gap = _gaps(e, smoothing)
        return float(np.sum(e[:, 0] - gap[:, 0] + smoothing * np.sum(np.log(gap / smoothing), axis=1))), gap

    for _ in range(_MOST_STEPS):
        alive()
        here, gap = value(x, inside)
        gradient, bend = cost.derivatives(inside, smoothing)
        step = _step(smoothing / gap, smoothing, gradient, bend, rests)
        change = cost.inside(step)
        slope = float(np.sum((smoothing / gap)[..., None, None] * gradient * step))
        length = 1.0
        while length > 1e-6 and not (
            value(x + length * step, inside + length * change)[0] >= here + _ARMIJO * length * slope
        ):
            length *= 0.5
        if length > 1e-6:
            x, inside = x + length * step, inside + length * change
        if length <= 1e-6 or length == 1.0 or slope < smoothing * len(ways):
            if smoothing <= _SHARP:
                break
            smoothing = max(_SHARP, smoothing * _FALL)
    return x


def _gaps(e: Array, smoothing: float) -> Array:
    """E - y, (n, M), for the y below all E (n, M) of a stretch with sum of smoothing / (E - y) = 1."""
    above = e - e.min(axis=1, keepdims=True)
    down = np.full((len(e), 1), smoothing)
    for _ in range(30):  # Newton's method from the left on a convex function
        gap = above + down
        total = np.sum(smoothing / gap, axis=1, keepdims=True)
        down = down + (total - 1.0) * total / np.sum(smoothing / gap**2, axis=1, keepdims=True)
        if total.max() < 1.0 + 1e-9:
            break
    return np.asarray(above + down)


def _step(weight: Array, smoothing: float, gradient: Array, bend: Array, rests: bool) -> Array:
    """Newton's step (n, M, J, C): columns of each stretch and time are eliminated, then what the weights will be.

    ``weight``: (n, M), of each time. Left is a banded matrix of k and l at via points.
    """
    inner, outer = slice(0, _LOCAL), slice(_LOCAL, None)
    right = np.concatenate([gradient[..., inner, None], bend[..., inner, outer]], axis=-1)
    solved = np.linalg.solve(bend[..., inner, inner], right)
    own, by_ends = solved[..., 0], solved[..., 1:]
    left = bend[..., outer, outer] - bend[..., outer, inner] @ by_ends
    rise = gradient[..., outer] - (bend[..., outer, inner] @ own[..., None])[..., 0]
    gain = np.sum(gradient[..., inner] * own, axis=(-1, -2))
    loose = 1.0 / (gain / weight + smoothing / weight**2)
    count, times, joints, _ = rise.shape
    rise = rise.reshape(count, times, -1)
    mean = np.einsum("im,imc->ic", loose, rise)
    whole = loose.sum(axis=1)
    matrix = np.einsum("imc,im,imd->icd", rise, loose, rise)
    matrix -= mean[:, :, None] * mean[:, None, :] / whole[:, None, None]
    for joint in range(joints):
        part = slice(4 * joint, 4 * joint + 4)
        matrix[:, part, part] += np.einsum("im,imcd->icd", weight, left[:, :, joint])
    pull = loose * smoothing / weight
    short = (1.0 - pull.sum(axis=1)) / whole
    right = np.einsum("im,imc->ic", pull, rise) + short[:, None] * mean
    ends = _banded(matrix, right, joints, rests)
    flat = ends.reshape(count, -1)
    level = short + np.sum(mean * flat, axis=1) / whole
    later = loose * (smoothing / weight - np.einsum("imc,ic->im", rise, flat) + level[:, None])
    step = np.empty(gradient.shape)
    step[..., inner] = (later / weight)[..., None, None] * own - (by_ends @ ends[:, None, ..., None])[..., 0]
    step[..., outer] = ends[:, None]
    return step


def _banded(matrix: Array, right: Array, joints: int, rests: bool) -> Array:
    """Solves for k and l at both ends of each stretch, (n, J, 4), equal where stretches meet; 0 at a free end."""
    from scipy.linalg import solveh_banded  # here, because loading it takes longer than most commands

    order = np.arange(4 * joints).reshape(joints, 2, 2).swapaxes(0, 1).ravel()  # by end, joint, k or l
    matrix, right = matrix[:, order][:, :, order], right[:, order]
    half, stretches = 2 * joints, len(matrix)
    band, total = np.zeros((2 * half, half * (stretches + 1))), np.zeros(half * (stretches + 1))
    for row in range(2 * half):
        total[row : row + half * stretches : half] += right[:, row]
        for column in range(row + 1):
            band[row - column, column : column + half * stretches : half] += matrix[:, row, column]
    band[0] *= 1.0 + 1e-12
    if not rests:
        band[0, -half:], total[-half:] = 1e30 * band[0].max(), 0.0
    found = solveh_banded(band, total, lower=True).reshape(stretches + 1, joints, 2)
    return np.concatenate([found[:-1], found[1:]], axis=-1)


class _Scan:
    """E of each stretch for more and more times, with k and l at via points as they are.

    A row for each stretch and time, sorted: ``stretch``, ``times``, ``e`` (B,), ``x`` (B, J, C).
    """

    def __init__(self, ways: Array, limits: Array, times: Array, chosen: Array) -> None:
        """``chosen``: (n, M, J, C), columns for ``times`` (n, M)."""
        self._ways, self._limits = ways, limits
        cost = _Cost.of(ways[:, None], limits, times)
        self._about = times[:, len(_ABOUT) // 2]
        self._least = cost.exact(chosen, cost.inside(chosen)).min(axis=1)
        self.stretch = np.empty(0, dtype=np.intp)
        self.times, self.e = np.empty(0), np.empty(0)
        self.x = np.empty((0, *chosen.shape[2:]))
        # Columns grow and grow for a time in which no motion is possible; more is possible in the longest.
        size = np.abs(chosen).max(axis=(2, 3))
        chosen = np.where((size > _WILD * size[:, -1:])[..., None, None], chosen[:, -1:], chosen)
        shortest = np.max(np.abs(ways) / limits[:, 0], axis=1) * (1.0 - _ROUNDING)
        scanned = self._about[:, None] * _SCANNED
        stretch, column = np.nonzero(scanned > shortest[:, None])
        nearest = np.abs(_SCANNED[:, None] - _ABOUT).argmin(axis=1)
        enough = self._least + _ABOVE * self._about
        self._add(stretch, scanned[stretch, column], chosen[stretch, nearest[column]], enough)
        first = np.searchsorted(self.stretch, np.arange(len(ways)))
        self._add(np.arange(len(ways)), shortest, self.x[first], self._least + _FINE * self._about)

    def floor(self) -> Array:
        """The least E of each stretch over all times, proven: (n,)."""
        low, last = self._between(), self._after()
        for _ in range(_ROUNDS):
            alive()
            least = np.minimum(self._least, self._lowest(self.e, self.stretch))
            enough = least - _FINE * self._about
            wide = np.flatnonzero(low < enough[self.stretch[:-1]])
            longer = np.flatnonzero(last < enough)
            if not len(wide) and not len(longer):
                break
            ends = np.searchsorted(self.stretch, longer, side="right") - 1
            stretch = np.concatenate([self.stretch[wide], longer])
            times = np.concatenate(
                [0.5 * (self.times[wide] + self.times[wide + 1]), _LONGER * self.times[ends]]
            )
            self._add(
                stretch,
                times,
                np.concatenate([0.5 * (self.x[wide] + self.x[wide + 1]), self.x[ends]]),
                least + _ABOVE * self._about,
            )
            low, last = self._between(), self._after()
        return np.minimum(self._lowest(low, self.stretch[:-1]), last)

    def _lowest(self, values: Array, stretch: NDArray[np.intp]) -> Array:
        found = np.full(len(self._ways), np.inf)
        np.minimum.at(found, stretch, values)
        return found

    def _between(self) -> Array:
        """E from each row to the next is at least: (B - 1,), infinite where another stretch begins."""
        first, second = self.e[:-1], self.e[1:]
        speed, acceleration, jerk = self._limits.T
        change = np.abs(np.diff(self.x, axis=0))
        k, l_ = change[..., _K], change[..., _L]
        middle = change[..., 2 * _CELLS - 1 : _LOCAL].sum(axis=-1)
        by_joint = (
            speed * change[..., 0]
            + (
                acceleration * 0.5 * (k[..., 1:] + k[..., :-1]).sum(axis=-1)
                + jerk / 3.0 * ((l_[..., 1:] + l_[..., :-1]).sum(axis=-1) + middle)
            )
            / _CELLS
        )
        sag = np.diff(self.times) * by_joint.sum(axis=-1) * (1.0 + _ROUNDING)
        # the least of first + s (second - first) - s (1 - s) sag
        with np.errstate(all="ignore"):
            s = np.clip(np.nan_to_num(0.5 * (1.0 - (second - first) / sag), nan=0.0), 0.0, 1.0)
        low = np.minimum(np.minimum(first, second), first + s * (second - first) - s * (1.0 - s) * sag)
        return np.where(np.diff(self.stretch) == 0, low, np.inf)

    def _after(self) -> Array:
        """E from the last time of each stretch on is at least: (n,)."""
        row = np.searchsorted(self.stretch, np.arange(len(self._ways)), side="right") - 1
        speed, acceleration, jerk = self._limits.T[:, None, :, None]
        x = np.abs(self.x[row])
        waiting = np.min(speed * x[..., :1] + acceleration * x[..., _K] + jerk * x[..., _L], axis=-1).sum(
            axis=-1
        )
        waits = np.where(waiting <= 1.0 - _ROUNDING, self.e[row], -np.inf)
        # Or k and l fall to 0 at once and h is 0.
        ends = (speed * x[..., _K[[0, -1]]] + acceleration * x[..., _L[[0, -1]]]).sum(axis=(-1, -2))
        return np.asarray(np.maximum(waits, self.times[row] - ends * (1.0 + _ROUNDING)))

    def _add(self, stretch: NDArray[np.intp], times: Array, x: Array, enough: Array) -> None:
        """Rows with the E that Newton's method reaches from columns x, but not above ``enough`` (n,)."""
        cost = _Cost.of(self._ways[stretch], self._limits, times)
        x, e = _improved(cost, x, enough[stretch])
        stretch, times = np.concatenate([self.stretch, stretch]), np.concatenate([self.times, times])
        order = np.lexsort([times, stretch])
        self.stretch, self.times = stretch[order], times[order]
        self.x, self.e = np.concatenate([self.x, x])[order], np.concatenate([self.e, e])[order]


def _improved(cost: _Cost, x: Array, enough: Array) -> tuple[Array, Array]:
    """Columns (B, J, C) with the same ends and a higher E, and E (B,): about the highest, or about ``enough``."""
    x = x.copy()
    best, highest = x.copy(), cost.exact(x, cost.inside(x))
    rows, smoothing = np.flatnonzero(highest < enough), _WARM
    for _ in range(_MOST_STEPS):
        if not len(rows):
            break
        own, here = cost.take(rows), x[rows]
        inside = own.inside(here)
        gradient, bend = own.derivatives(inside, smoothing)
        step = np.zeros(here.shape)
        local = slice(0, _LOCAL)
        step[..., local] = np.linalg.solve(bend[..., local, local], gradient[..., local, None])[..., 0]
        change, slope = own.inside(step), np.sum(step * gradient, axis=-1)
        start, length = own.smooth(here, inside, smoothing), np.ones(slope.shape)
        for _ in range(20):
            far = length[..., None]
            reached = own.smooth(here + far * step, inside + far * change, smoothing)
            short = ~(reached >= start + _ARMIJO * length * slope)
            if not short.any():
                break
            length[short] *= 0.5
        here = here + length[..., None] * step
        x[rows] = here
        e = own.exact(here, own.inside(here))
        # E is concave: what lies between is at least on the line.
        up = e - highest[rows]
        part = np.where(
            up > 0.0, np.minimum(1.0, (enough - highest)[rows] / np.where(up > 0.0, up, 1.0)), 0.0
        )
        best[rows] += part[:, None, None] * (here - best[rows])
        highest[rows] += part * up
        rows = rows[e < enough[rows]]
        if np.median(length) == 1.0 or np.mean(slope) < smoothing:
            if smoothing <= _SHARP:
                break
            smoothing = max(_SHARP, smoothing * _FALL)
    return best, cost.exact(best, cost.inside(best))
