"""The time for braking to rest, or for another change of speed, as a function of the time at which it begins.

The board lets the motion's own time run at another rate, so the arm stays on its path: in the brake time the
rate goes from r0 to r1, by the law in ``armtempo_board/stepgen/time_law.py``. Braking and pauses have r1 = 0,
and the ramp shape that makes them shortest for the motion; other changes of speed have separate times, and
one fixed shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from armtempo_shared.limits import TICK_HZ
from armtempo_shared.motion import EVEN_RAMP, RAMP_ENTRIES, RAMP_UNIT_TICKS

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model.parts import Limits
from armtempo.splines.trajectory import Trajectory

EXCESS = 1.25
"""Multiple of the acceleration and jerk limits that braking and changes of speed may reach. A motion at its
limits could brake only very slowly within them, as braking adds to the acceleration and jerk of the path."""

Rates = tuple[tuple[float, float], ...]
TO_REST: Rates = ((1.0, 0.0), (0.75, 0.0), (0.5, 0.0), (0.25, 0.0), (0.1, 0.0))
OTHERS: Rates = (
    (0.0, 1.0),
    (1.0, 0.01),
    (1.0, 0.5),
    (0.5, 1.0),
    (1.0, 0.75),
    (0.75, 1.0),
    (0.9, 0.2),
    (0.2, 0.9),
)
"""Rates before and after for which the times are computed; all others need less. The first of TO_REST and the
first two of OTHERS need the most."""

UNIT_S = RAMP_UNIT_TICKS / TICK_HZ
_LONGEST = 65535
_LONGER = 1.02
_STARTS = 6  # in each part of the table
_PHASES = 15  # of each piece of a ramp
_SHAPES = [p + 16 * q for p in (1, 2, 3, 4, 5, 6, 7) for q in (5, 6, 7, 8, 9, 10, 12, 14) if p < q]
_SHAPE_STARTS = 12
_SAMPLES = 4000
_SHORTEST_S = 0.01
_HALVINGS = 6
_NEGLIGIBLE = 1e-6  # of RAMP_UNIT_TICKS


@dataclass(frozen=True, eq=False)
class BrakeTimes:
    """Durations of changes that begin at RAMP_ENTRIES equidistant times of a motion, in RAMP_UNIT_TICKS.

    Linearly interpolated. ``to_rest``, ``others``: (RAMP_ENTRIES,), integers. ``shape``: of ramps to rest, as
    in the record of a motion (``armtempo_shared.motion``).
    """

    duration_s: float
    to_rest: Array
    others: Array
    shape: int = EVEN_RAMP

    def rest_s(self, time_s: float | Array) -> Array:
        """Brake time from given times of the motion, seconds, of the same shape."""
        return self._at(self.to_rest, time_s)

    def change_s(self, time_s: float | Array) -> Array:
        """Duration of other changes of speed from given times of the motion, seconds."""
        return self._at(self.others, time_s)

    def _at(self, table: Array, time_s: float | Array) -> Array:
        return np.asarray(UNIT_S * np.interp(time_s, np.linspace(0.0, self.duration_s, RAMP_ENTRIES), table))

    @property
    def longest_rest_s(self) -> float:
        """The longest brake time."""
        return UNIT_S * float(self.to_rest.max())


def of_motion(trajectory: Trajectory, limits: Sequence[Limits]) -> BrakeTimes:
    """The shortest times (within 2 %) that keep EXCESS times the ``limits`` of each joint.

    Speed never rises. Computed on a grid of starts and times, and checked on a finer one. Raises InputError
    if the motion itself exceeds EXCESS times the limits.
    """
    ramps = _Ramps(trajectory, np.array([limit.values for limit in limits]))
    if ramps.worst_of_motion > EXCESS:
        raise InputError(
            f"the motion {trajectory.name!r} goes beyond the arm's acceleration or jerk limits",
            "plan it again",
        )
    shape = _best_shape(ramps)
    to_rest = _table(ramps, TO_REST, TO_REST[:1], np.full(RAMP_ENTRIES, _SHORTEST_S / UNIT_S), shape)
    others = _table(ramps, OTHERS, OTHERS[:2], to_rest, EVEN_RAMP)
    return BrakeTimes(trajectory.duration_s, to_rest, others, shape)


def _best_shape(ramps: _Ramps) -> int:
    """The ramp shape with the smallest mean ratio of the brake time to that of the best shape at each start."""
    starts = np.tile((np.arange(_SHAPE_STARTS) + 0.5) / _SHAPE_STARTS, len(_SHAPES))
    shapes = np.repeat(_SHAPES, _SHAPE_STARTS)
    lengths = ramps.shortest_s(starts, TO_REST[:1], np.full(len(starts), _SHORTEST_S), shapes)
    lengths = lengths.reshape(len(_SHAPES), -1)
    return _SHAPES[int(np.argmin(np.mean(lengths / lengths.min(axis=0), axis=1)))]


def _table(ramps: _Ramps, rates: Rates, worst: Rates, least: Array, shape: int) -> Array:
    """The table's entries, at least ``least``; ``worst``: the rates that need the most time."""
    parts = RAMP_ENTRIES - 1
    place = np.arange(_STARTS * parts + 1) / _STARTS
    needed = (
        ramps.shortest_s(
            place / parts, worst, UNIT_S * np.interp(place, np.arange(RAMP_ENTRIES), least), shape
        )
        / UNIT_S
    )
    table = np.maximum(needed[::_STARTS], least)
    _lift(table, place, needed)
    table = np.minimum(np.ceil(table), _LONGEST)
    place = np.arange(2 * _STARTS * parts + 1) / (2 * _STARTS)
    length_s = np.zeros(len(place))
    found = np.zeros(len(place), bool)
    while True:
        before_s, length_s = length_s, UNIT_S * np.interp(place, np.arange(RAMP_ENTRIES), table)
        new = np.flatnonzero(length_s != before_s)
        found[new] = ramps.excess(place[new] / parts, length_s[new], rates, shape) > EXCESS
        found &= length_s < UNIT_S * _LONGEST
        if not np.any(found):
            return table
        _lift(table, place, np.where(found, _LONGER * length_s / UNIT_S, 0.0))
        table = np.minimum(np.ceil(table), _LONGEST)


def _lift(table: Array, place: Array, needed: Array) -> None:
    """Increase entries as little as possible so that the interpolated table is at least ``needed``."""
    part = np.minimum(place.astype(int), len(table) - 2)
    weight = place - part
    while True:
        missing = needed - (1.0 - weight) * table[part] - weight * table[part + 1]
        worst = int(np.argmax(missing))
        if missing[worst] <= _NEGLIGIBLE:
            return
        share = np.array([1.0 - weight[worst], weight[worst]])
        table[part[worst] : part[worst] + 2] += missing[worst] * share / np.sum(share**2)


class _Ramps:
    """Acceleration and jerk of a motion during changes of its rate, relative to the limits (J, 3)."""

    def __init__(self, trajectory: Trajectory, allowed: Array) -> None:
        self._duration_s = trajectory.duration_s
        self._allowed = allowed
        time = np.linspace(0.0, trajectory.duration_s, _SAMPLES)
        # speeds, accelerations and jerks over their limits' units; rest after the end
        # (3, J, T): the time axis last, which is fastest in NumPy
        self._motion = np.stack([trajectory(time, order).T for order in (1, 2, 3)])
        self.worst_of_motion = float(np.max(np.abs(self._motion[1:]) / allowed.T[1:, :, None]))

    def shortest_s(self, starts: Array, rates: Rates, least_s: Array, shapes: Array | int) -> Array:
        """Shortest durations, at least ``least_s``, within 1 %, for ``starts`` (fractions of the motion's time)."""
        shapes = np.broadcast_to(shapes, starts.shape)
        low, high = least_s.copy(), least_s.copy()
        left = np.arange(len(starts))
        while len(left := left[self.excess(starts[left], high[left], rates, shapes[left]) > EXCESS]):
            low[left], high[left] = high[left], 2.0 * high[left]
            left = left[high[left] < 2.0 * UNIT_S * _LONGEST]
        left = np.flatnonzero(high > low)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low[left] + high[left])
            fails = self.excess(starts[left], middle, rates, shapes[left]) > EXCESS
            low[left] = np.where(fails, middle, low[left])
            high[left] = np.where(fails, high[left], middle)
        return high

    def excess(self, starts: Array, length_s: Array, rates: Rates, shapes: Array | int) -> Array:
        """The largest ratio of acceleration or jerk to its limit in changes between ``rates``, for each start."""
        worst = np.zeros(len(starts))
        if not len(starts):
            return worst
        length = length_s[:, None]
        place, rise, slope, bend, way, whole = _ramp(np.atleast_1d(shapes))
        for before, after in rates:
            least, change = min(before, after), after - before
            rate = least + abs(change) * rise
            rate1 = change * slope / length
            rate2 = abs(change) * bend / length**2
            passed = least * place + abs(change) * way
            if change < 0.0:
                passed = least + abs(change) * whole - passed
            speed, acceleration, jerk = self._at(self._duration_s * starts[:, None] + length * passed)
            changed2 = acceleration * rate**2 + speed * rate1
            changed3 = jerk * rate**3 + 3 * acceleration * rate * rate1 + speed * rate2
            for changed, limit in ((changed2, self._allowed[:, 1]), (changed3, self._allowed[:, 2])):
                over = np.max(np.abs(changed), axis=2) / limit[:, None]
                worst = np.maximum(worst, np.max(over, axis=0))
        return worst

    def _at(self, time_s: Array) -> tuple[Array, Array, Array]:
        """Speed, acceleration and jerk at times, each (J, ...)."""
        place = time_s * ((_SAMPLES - 1) / self._duration_s)
        before = np.minimum(place.astype(int), _SAMPLES - 2)
        values = self._motion.take(before, axis=2)
        values += (place - before) * (self._motion.take(before + 1, axis=2) - values)
        np.copyto(values, 0.0, where=place > _SAMPLES - 1)
        return values[0], values[1], values[2]


def _ramp(shapes: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """r, S, S', S'' and e (N, 3 * _PHASES) at the ends of each piece and in between, and e(1) (N, 1), of shapes (N,).

    As in ``armtempo_board/stepgen/time_law.py``.
    """
    second, first = np.divmod(shapes[:, None], 16.0)
    first, second = first / 16.0, second / 16.0
    whole = np.rint(64 * (3 - first - second - (1 - first) / (1 + second - first)) / 3) / 64
    late = 3 * (1 - whole) - first - second
    slopes = (0.0 * first, 2 * (1 - late) / second, 2 * late / (1 - first), 0.0 * first)
    at = np.linspace(0.0, 1.0, _PHASES)
    rise = way = start = 0.0 * first
    pieces = []
    for width, before, after in zip(
        (first, second - first, 1 - second), slopes[:-1], slopes[1:], strict=True
    ):
        gain, bend = width * before, width * (after - before)
        pieces.append(
            (
                start + width * at,
                rise + at * (gain + at * bend / 2),
                before + at * (after - before),
                (after - before) / width + 0.0 * at,
                way + width * at * (rise + at * (gain / 2 + at * bend / 6)),
            )
        )
        start = start + width
        rise, way = pieces[-1][1][:, -1:], pieces[-1][4][:, -1:]
    place, rises, slope, second_slope, ways = (
        np.concatenate(one, axis=1) for one in zip(*pieces, strict=True)
    )
    return place, rises, slope, second_slope, ways, whole
