"""A proven lower bound of the motion time through via points: all joints together, for any path.

Consider one leg, of duration T, between two via points. For a joint with displacement d, velocity v, acceleration a
and jerk j, any constant h and functions k(t), l(t) satisfy

    h d + [k v + l a] = integral of (h + k') v + (k + l') a + l j dt
                     <= integral of V |h + k'| + A |k + l'| + J |l| dt

where V, A, J are the joint's limits and [.] is the value at the end minus the value at the start. h, k and l are
multipliers of displacement, velocity and acceleration. With

    E(T) = T + sum over joints of (h d - integral of V |h + k'| + A |k + l'| + J |l| dt)

it follows that T >= E(T) + sum over joints of [k v + l a]. If k and l are continuous at via points, those terms cancel
in the sum over all legs of a motion from rest to rest. So no motion is shorter than the sum of min over T of E(T),
whatever k and l are at the via points, and whatever h, k and l are inside a leg for each T.

Good multipliers are found by Newton's method with smoothed absolute values: first k and l at the via points, for a few
T near those of a plan (``_best``), then, with these fixed, the multipliers inside each leg for many T (``_Scan``).
They need not be optimal: E is evaluated for what was found, with integrals rounded upwards. Between two neighbouring T,
h and, as functions of t / T, k and l are interpolated linearly; because of the products with T, E is then at least its
linear interpolation minus s (1 - s) (T2 - T1) integral of V |dh| + A |dk| + J |dl|, 0 <= s <= 1. Beyond the largest T
the multipliers are constant for a while, at the t where that costs least, at most as much as it adds to T.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.progress import alive

_CELLS = 8
"""Cells of a leg; on each k is linear, l quadratic."""
_TRIAL_TIMES = np.array([0.97, 1.0, 1.03])
"""Durations for which k and l at via points are optimised, relative to the expected ones."""
_GRID_TIMES = np.array([0.5, 0.75, 0.9, 1.0, 1.1, 1.3, 2.0, 3.0])
"""Durations at which E is evaluated first, relative to the expected ones."""
_EXTENSION = 2.0
"""Factor from the largest duration to the next one."""
_MOST_REFINEMENTS = 6
"""How often durations are added where E may be lower between two of them."""
_FIRST_SMOOTHING, _LAST_SMOOTHING, _SMOOTHING_FACTOR = 0.05, 3e-5, 0.3
"""Smoothing of absolute values relative to the mean duration of a leg: first, last, factor from one to the next."""
_WARM_SMOOTHING = 1e-2
"""First smoothing if the multipliers of a similar duration are the start."""
_MOST_STEPS = 60
_ARMIJO = 1e-4
_TOLERANCE = 2e-3
"""Accuracy of the minimum of E, relative to the expected duration."""
_MARGIN = 0.1
"""E need not be raised further if it is above its minimum by this, relative to the expected duration."""
_DIVERGED = 30.0
"""Multipliers this many times as large as those of a longer duration have diverged."""
_LEAST_TIME = 1e-3
"""Smallest expected duration that is used, relative to the mean."""
_ROUNDING = 1e-9
"""Bound of the rounding error of E, relative to the sum of its terms."""

_COLUMNS = 3 * _CELLS + 3
"""Multipliers of a joint in a leg. Cell by cell k and l at its start and the middle Bernstein coefficient of l, then h,
then k and l at the end of the leg."""
_K = np.array([*range(0, 3 * _CELLS, 3), _COLUMNS - 2])
_L = _K + 1
"""Indices of k and l at the ends of the cells, from start to end."""
_MIDDLE = _L[:-1] + 1
_H = 3 * _CELLS
_INNER, _ENDS = slice(2, _H + 1), np.array([0, 1, _COLUMNS - 2, _COLUMNS - 1])
"""Multipliers inside a leg, and k and l at its ends."""
_CELL = np.stack([_K[:-1], _L[:-1], _MIDDLE, _K[1:], _L[1:], np.full(_CELLS, _H)], axis=1)
"""Multipliers that act on each cell: (N, 6)."""


def _patterns() -> Array:
    """Rows of the absolute values' arguments in a cell: (5, 6, 6), to be multiplied by T V, V, T A, A and T J."""
    found = np.zeros((5, 6, 6))
    found[0, 0, 5] = 1.0 / _CELLS
    found[1, 0, [0, 3]] = -1.0, 1.0
    for row, (k, first, second) in enumerate(((0, 1, 2), (3, 2, 4)), 1):
        found[2, row, k] = 0.5 / _CELLS
        found[3, row, [first, second]] = -1.0, 1.0
    found[4, range(3, 6), [1, 2, 4]] = 1.0 / (3 * _CELLS)
    return found


_PATTERNS = _patterns()


@np.errstate(all="ignore")  # numbers too far apart in size prove nothing
def lower_bound_s(via_deg: Array, limits: Array, times_s: Array, rests: bool = True) -> float:
    """Lower bound of the time of motions from rest through via angles (n + 1, J), to rest if ``rests``; 0: none.

    ``limits``: (J, 3). ``times_s``: (n,), expected durations of the legs; they decide how tight the bound is.
    """
    moves = np.ptp(via_deg, axis=0) > 0.0
    if not moves.any():
        return 0.0
    size, unit_s = np.ptp(via_deg, axis=0)[moves], float(np.mean(times_s))
    distances = np.diff(via_deg[:, moves], axis=0) / size
    rounded = np.finfo(float).eps * np.max(np.abs(via_deg[:, moves]), axis=0) / size
    distances = np.sign(distances) * np.maximum(np.abs(distances) - 8 * rounded, 0.0)
    scaled = limits[moves] / size[:, None] * unit_s ** np.arange(1, 4)
    expected = np.maximum(times_s / unit_s, _LEAST_TIME)
    times = expected[:, None] * _TRIAL_TIMES
    try:
        found = float(
            np.sum(_Scan(distances, scaled, times, _best(distances, scaled, times, rests)).lower_bounds())
        )
    except np.linalg.LinAlgError:  # numbers too far apart in size, or durations too short
        return 0.0
    return max(found, 0.0) * unit_s if np.isfinite(found) else 0.0


@dataclass(frozen=True, eq=False)
class _Cost:
    """E as a function of the multipliers x (..., J, C), for any legs and durations.

    ``distances``: (..., J); ``times``: (...); ``rows``: (..., J, 6, 6), the same in each cell.
    """

    distances: Array
    times: Array
    rows: Array

    @classmethod
    def of(cls, distances: Array, limits: Array, times: Array) -> _Cost:
        """``limits``: (J, 3)."""
        speed, acceleration, jerk = limits.T
        t = times[..., None]
        one = np.ones_like(t)
        weights = [t * speed, one * speed, t * acceleration, one * acceleration, t * jerk]
        return cls(distances, times, np.tensordot(np.stack(weights, axis=-1), _PATTERNS, 1))

    def take(self, which: NDArray[np.intp]) -> _Cost:
        """Those with the indices ``which``."""
        return _Cost(self.distances[which], self.times[which], self.rows[which])

    def arguments(self, x: Array) -> Array:
        """Arguments of the absolute values: (..., J, N, 6)."""
        return np.asarray(x[..., _CELL] @ self.rows.swapaxes(-1, -2))

    def exact(self, x: Array, arguments: Array) -> Array:
        """E, rounded downwards: (...)."""
        gained, lost = self.distances * x[..., _H], np.abs(arguments).sum(axis=(-1, -2))
        largest = np.abs(x)[..., _CELL] @ np.abs(self.rows).swapaxes(-1, -2)
        terms = np.abs(gained) + largest.sum(axis=(-1, -2))
        return np.asarray(self.times + np.sum(gained - lost - _ROUNDING * terms, axis=-1))

    def smooth(self, x: Array, arguments: Array, smoothing: float) -> Array:
        """E minus the duration, by joint, with smoothed absolute values; slightly too large: (..., J)."""
        root = np.sqrt(smoothing**2 + arguments**2)
        lost = root - smoothing + smoothing * np.log(2.0 * smoothing / (root + smoothing))
        return np.asarray(self.distances * x[..., _H] - lost.sum(axis=(-1, -2)))

    def derivatives(self, arguments: Array, smoothing: float) -> tuple[Array, Array]:
        """Of ``smooth``: gradient (..., J, C) and negative Hessian (..., J, C, C)."""
        root = np.sqrt(smoothing**2 + arguments**2)
        by_cell = -(arguments / (smoothing + root)) @ self.rows
        gradient = np.zeros((*arguments.shape[:-2], _COLUMNS))
        for number in range(5):
            gradient[..., _CELL[:, number]] += by_cell[..., number]
        gradient[..., _H] = by_cell[..., 5].sum(axis=-1) + self.distances
        outer = (self.rows[..., :, None] * self.rows[..., None, :]).reshape(*self.rows.shape[:-1], 36)
        bent = ((smoothing / (root * (smoothing + root))) @ outer).reshape(*arguments.shape[:-1], 6, 6)
        curvature = np.zeros((*gradient.shape, _COLUMNS))
        for number in range(5):
            curvature[..., _H, _CELL[:, number]] += bent[..., 5, number]
        curvature[..., _H] = curvature[..., _H, :]
        curvature[..., _H, _H] = bent[..., 5, 5].sum(axis=-1)
        for cell in range(_CELLS - 1):
            own = slice(3 * cell, 3 * cell + 5)
            curvature[..., own, own] += bent[..., cell, :5, :5]
        last = _CELL[-1, :5]
        curvature[..., last[:, None], last] += bent[..., -1, :5, :5]
        diagonal = np.arange(_COLUMNS)
        curvature[..., diagonal, diagonal] *= 1.0 + 1e-12
        curvature[..., _H, _H] += np.finfo(float).tiny  # at duration 0 h has no effect
        return gradient, curvature


def _best(distances: Array, limits: Array, times: Array, rests: bool) -> Array:
    """Multipliers (n, M, J, C) for durations (n, M), equal at via points, that nearly maximise the sum of min E.

    The minimum over durations is smoothed, too: the y with sum of smoothing / (E - y) = 1.
    """
    cost = _Cost.of(distances[:, None], limits, times)
    x = np.zeros((*times.shape, distances.shape[1], _COLUMNS))
    arguments, smoothing = cost.arguments(x), _FIRST_SMOOTHING

    def value(x: Array, arguments: Array) -> tuple[float, Array]:
        e = times + cost.smooth(x, arguments, smoothing).sum(axis=-1)
        gap = _gaps(e, smoothing)
        return float(np.sum(e[:, 0] - gap[:, 0] + smoothing * np.sum(np.log(gap / smoothing), axis=1))), gap

    for _ in range(_MOST_STEPS):
        alive()
        here, gap = value(x, arguments)
        gradient, curvature = cost.derivatives(arguments, smoothing)
        step = _step(smoothing / gap, smoothing, gradient, curvature, rests)
        change = cost.arguments(step)
        slope = float(np.sum((smoothing / gap)[..., None, None] * gradient * step))
        length = 1.0
        while length > 1e-6 and not (
            value(x + length * step, arguments + length * change)[0] >= here + _ARMIJO * length * slope
        ):
            length *= 0.5
        if length > 1e-6:
            x, arguments = x + length * step, arguments + length * change
        if length <= 1e-6 or length == 1.0 or slope < smoothing * len(distances):
            if smoothing <= _LAST_SMOOTHING:
                break
            smoothing = max(_LAST_SMOOTHING, smoothing * _SMOOTHING_FACTOR)
    return x


def _gaps(e: Array, smoothing: float) -> Array:
    """E - y, (n, M), where y is the smoothed minimum of each leg."""
    above = e - e.min(axis=1, keepdims=True)
    down = np.full((len(e), 1), smoothing)
    for _ in range(30):  # Newton's method from the left on a convex function
        gap = above + down
        total = np.sum(smoothing / gap, axis=1, keepdims=True)
        down = down + (total - 1.0) * total / np.sum(smoothing / gap**2, axis=1, keepdims=True)
        if total.max() < 1.0 + 1e-9:
            break
    return np.asarray(above + down)


def _step(weight: Array, smoothing: float, gradient: Array, curvature: Array, rests: bool) -> Array:
    """Newton step (n, M, J, C). Multipliers inside legs and the changes of the weights are eliminated.

    ``weight``: (n, M), of each duration. A banded system of k and l at the via points remains.
    """
    across = curvature[..., _INNER, :][..., _ENDS]
    right = np.concatenate([gradient[..., _INNER, None], across], axis=-1)
    solved = np.linalg.solve(curvature[..., _INNER, _INNER], right)
    own, by_ends = solved[..., 0], solved[..., 1:]
    left = curvature[..., _ENDS[:, None], _ENDS] - across.swapaxes(-1, -2) @ by_ends
    rise = gradient[..., _ENDS] - (across.swapaxes(-1, -2) @ own[..., None])[..., 0]
    gain = np.sum(gradient[..., _INNER] * own, axis=(-1, -2))
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
    step[..., _INNER] = (later / weight)[..., None, None] * own - (by_ends @ ends[:, None, ..., None])[..., 0]
    step[..., _ENDS] = ends[:, None]
    return step


def _banded(matrix: Array, right: Array, joints: int, rests: bool) -> Array:
    """Solve for k and l at both ends of each leg, (n, J, 4), equal at via points; 0 at an end without rest."""
    from scipy.linalg import solveh_banded  # here: importing it takes longer than most commands

    order = np.arange(4 * joints).reshape(joints, 2, 2).swapaxes(0, 1).ravel()  # order: end, joint, k or l
    matrix, right = matrix[:, order][:, :, order], right[:, order]
    half, legs = 2 * joints, len(matrix)
    band, total = np.zeros((2 * half, half * (legs + 1))), np.zeros(half * (legs + 1))
    for row in range(2 * half):
        total[row : row + half * legs : half] += right[:, row]
        for column in range(row + 1):
            band[row - column, column : column + half * legs : half] += matrix[:, row, column]
    band[0] *= 1.0 + 1e-12
    if not rests:
        band[0, -half:], total[-half:] = 1e30 * band[0].max(), 0.0
    found = solveh_banded(band, total, lower=True).reshape(legs + 1, joints, 2)
    return np.concatenate([found[:-1], found[1:]], axis=-1)


class _Scan:
    """E of each leg as a function of its duration, with fixed k and l at via points.

    Sorted rows, one for each leg and duration: ``leg``, ``times``, ``e`` (B,), ``x`` (B, J, C).
    """

    def __init__(self, distances: Array, limits: Array, times: Array, chosen: Array) -> None:
        """``chosen``: multipliers (n, M, J, C) for ``times`` (n, M)."""
        self._distances, self._limits = distances, limits
        cost = _Cost.of(distances[:, None], limits, times)
        self._expected = times[:, len(_TRIAL_TIMES) // 2]
        self._least = cost.exact(chosen, cost.arguments(chosen)).min(axis=1)
        self.leg = np.empty(0, dtype=np.intp)
        self.times, self.e = np.empty(0), np.empty(0)
        self.x = np.empty((0, *chosen.shape[2:]))
        # The multipliers of a duration that is too short for any motion diverge; those of the longest are used.
        size = np.abs(chosen).max(axis=(2, 3))
        chosen = np.where((size > _DIVERGED * size[:, -1:])[..., None, None], chosen[:, -1:], chosen)
        shortest = np.max(np.abs(distances) / limits[:, 0], axis=1) * (1.0 - _ROUNDING)
        scanned = self._expected[:, None] * _GRID_TIMES
        leg, column = np.nonzero(scanned > shortest[:, None])
        nearest = np.abs(_GRID_TIMES[:, None] - _TRIAL_TIMES).argmin(axis=1)
        target = self._least + _MARGIN * self._expected
        self._add(leg, scanned[leg, column], chosen[leg, nearest[column]], target)
        first = np.searchsorted(self.leg, np.arange(len(distances)))
        self._add(
            np.arange(len(distances)), shortest, self.x[first], self._least + _TOLERANCE * self._expected
        )

    def lower_bounds(self) -> Array:
        """Proven minimum of E over all durations, by leg: (n,)."""
        low, last = self._between(), self._after()
        for _ in range(_MOST_REFINEMENTS):
            alive()
            least = np.minimum(self._least, self._lowest(self.e, self.leg))
            target = least - _TOLERANCE * self._expected
            wide = np.flatnonzero(low < target[self.leg[:-1]])
            longer = np.flatnonzero(last < target)
            if not len(wide) and not len(longer):
                break
            ends = np.searchsorted(self.leg, longer, side="right") - 1
            leg = np.concatenate([self.leg[wide], longer])
            times = np.concatenate(
                [0.5 * (self.times[wide] + self.times[wide + 1]), _EXTENSION * self.times[ends]]
            )
            self._add(
                leg,
                times,
                np.concatenate([0.5 * (self.x[wide] + self.x[wide + 1]), self.x[ends]]),
                least + _MARGIN * self._expected,
            )
            low, last = self._between(), self._after()
        return np.minimum(self._lowest(low, self.leg[:-1]), last)

    def _lowest(self, values: Array, leg: NDArray[np.intp]) -> Array:
        found = np.full(len(self._distances), np.inf)
        np.minimum.at(found, leg, values)
        return found

    def _between(self) -> Array:
        """Lower bound of E from each row to the next: (B - 1,), infinite if they are of different legs."""
        first, second = self.e[:-1], self.e[1:]
        speed, acceleration, jerk = self._limits.T
        change = np.abs(np.diff(self.x, axis=0))
        k, l_ = change[..., _K], change[..., _L]
        middle = change[..., _MIDDLE].sum(axis=-1)
        by_joint = (
            speed * change[..., _H]
            + (
                acceleration * 0.5 * (k[..., 1:] + k[..., :-1]).sum(axis=-1)
                + jerk / 3.0 * ((l_[..., 1:] + l_[..., :-1]).sum(axis=-1) + middle)
            )
            / _CELLS
        )
        sag = np.diff(self.times) * by_joint.sum(axis=-1) * (1.0 + _ROUNDING)
        # minimum over s of first + s (second - first) - s (1 - s) sag
        with np.errstate(all="ignore"):
            s = np.clip(np.nan_to_num(0.5 * (1.0 - (second - first) / sag), nan=0.0), 0.0, 1.0)
        low = np.minimum(np.minimum(first, second), first + s * (second - first) - s * (1.0 - s) * sag)
        return np.where(np.diff(self.leg) == 0, low, np.inf)

    def _after(self) -> Array:
        """Lower bound of E beyond the largest duration, by leg: (n,)."""
        row = np.searchsorted(self.leg, np.arange(len(self._distances)), side="right") - 1
        speed, acceleration, jerk = self._limits.T[:, None, :, None]
        x = np.abs(self.x[row])
        waiting = np.min(
            speed * x[..., _H, None] + acceleration * x[..., _K] + jerk * x[..., _L], axis=-1
        ).sum(axis=-1)
        waits = np.where(waiting <= 1.0 - _ROUNDING, self.e[row], -np.inf)
        # Or h is 0, and k and l drop to 0 at once.
        ends = (speed * x[..., _K[[0, -1]]] + acceleration * x[..., _L[[0, -1]]]).sum(axis=(-1, -2))
        return np.asarray(np.maximum(waits, self.times[row] - ends * (1.0 + _ROUNDING)))

    def _add(self, leg: NDArray[np.intp], times: Array, x: Array, target: Array) -> None:
        """Add rows; Newton's method raises E from multipliers x up to ``target`` (n,)."""
        cost = _Cost.of(self._distances[leg], self._limits, times)
        x, e = _improved(cost, x, target[leg])
        leg, times = np.concatenate([self.leg, leg]), np.concatenate([self.times, times])
        order = np.lexsort([times, leg])
        self.leg, self.times = leg[order], times[order]
        self.x, self.e = np.concatenate([self.x, x])[order], np.concatenate([self.e, e])[order]


def _improved(cost: _Cost, x: Array, target: Array) -> tuple[Array, Array]:
    """Multipliers (B, J, C) with the same ends and a higher E, and E (B,): nearly the highest, or about ``target``."""
    x = x.copy()
    best, highest = x.copy(), cost.exact(x, cost.arguments(x))
    rows, smoothing = np.flatnonzero(highest < target), _WARM_SMOOTHING
    for _ in range(_MOST_STEPS):
        if not len(rows):
            break
        own, here = cost.take(rows), x[rows]
        arguments = own.arguments(here)
        gradient, curvature = own.derivatives(arguments, smoothing)
        step = np.zeros(here.shape)
        inner = np.linalg.solve(curvature[..., _INNER, _INNER], gradient[..., _INNER, None])
        step[..., _INNER] = inner[..., 0]
        change, slope = own.arguments(step), np.sum(step * gradient, axis=-1)
        start, length = own.smooth(here, arguments, smoothing), np.ones(slope.shape)
        for _ in range(20):
            far = length[..., None]
            reached = own.smooth(here + far * step, arguments + far[..., None] * change, smoothing)
            short = ~(reached >= start + _ARMIJO * length * slope)
            if not short.any():
                break
            length[short] *= 0.5
        here = here + length[..., None] * step
        x[rows] = here
        e = own.exact(here, own.arguments(here))
        # E is concave: between two points it is above their chord.
        up = e - highest[rows]
        part = np.where(
            up > 0.0, np.minimum(1.0, (target - highest)[rows] / np.where(up > 0.0, up, 1.0)), 0.0
        )
        best[rows] += part[:, None, None] * (here - best[rows])
        highest[rows] += part * up
        rows = rows[e < target[rows]]
        if np.median(length) == 1.0 or np.mean(slope) < smoothing:
            if smoothing <= _LAST_SMOOTHING:
                break
            smoothing = max(_LAST_SMOOTHING, smoothing * _SMOOTHING_FACTOR)
    return best, cost.exact(best, cost.arguments(best))
