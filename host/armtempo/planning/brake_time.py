"""The time for braking to rest, or for another change of speed, as a function of its start.

The board changes the rate of the motion's own time, so the arm stays on its path: in the brake time the rate
changes from r0 to r1, by the law in ``armtempo_board/stepgen/time_law.py``. Braking and pauses have r1 = 0, and of
RAMP_SHAPES the one with the shortest time from their start; other changes of speed have separate times, and a
fixed shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from armtempo_shared.limits import TICK_HZ
from armtempo_shared.motion import (
    EVEN_RAMP,
    LEAST_RAMP_BITS,
    MOST_RAMP_BITS,
    OTHER_ENTRIES,
    RAMP_LENGTH,
    RAMP_SHAPES,
    RAMP_WAYS,
    REST_ENTRIES,
)
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model.parts import Limits
from armtempo.splines.trajectory import Trajectory

EXCESS = 1.25
"""Multiple of the acceleration and jerk limits that braking and changes of speed may reach. A motion at its
limits could brake only very slowly within them, as braking adds to the acceleration and jerk of the path."""

Rates = tuple[tuple[float, float], ...]
Shapes = NDArray[np.int64]
"""Numbers of RAMP_SHAPES."""
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
"""Rates before and after for which the times are computed; all others need less time. The first of TO_REST and the
first two of OTHERS need most, except if the motion ends within a ramp from 1: then from 0.5 to rest."""
_WORST_TO_REST = TO_REST[:3:2]
_WORST_OTHERS = OTHERS[:2]

LONGEST_S = (RAMP_LENGTH << MOST_RAMP_BITS) / TICK_HZ
_LONGER = 1.01
_REST_STARTS, _OTHER_STARTS = 3, 6  # in each part of a table
_PHASES = 15  # of each piece of a ramp,
_FEW_PHASES = 8  # and where shapes are compared
_SAMPLES = 4000
_SHORTEST_S = 0.01
_ROOM = 1.1  # for entries to be lengthened
_HALVINGS = 7
_NEGLIGIBLE = 1e-6  # of the unit of lengths
_SHAPES, _WAYS = np.frombuffer(RAMP_SHAPES, np.uint8), np.frombuffer(RAMP_WAYS, np.uint8)


@dataclass(frozen=True, eq=False)
class BrakeTimes:
    """Durations of changes at equidistant starts in a motion's time, in 2**``unit_bits`` ticks; interpolated linearly.

    ``to_rest``: (REST_ENTRIES,), ``others``: (OTHER_ENTRIES,), integers. ``shapes``: (REST_ENTRIES - 1,), of ramps to
    rest that start between two entries (``armtempo_shared.motion``).
    """

    duration_s: float
    to_rest: Array
    others: Array
    shapes: Shapes
    unit_bits: int

    def rest_s(self, time_s: float | Array) -> Array:
        """Brake time from given times of the motion, seconds, of the same shape."""
        return self._at(self.to_rest, time_s)

    def change_s(self, time_s: float | Array) -> Array:
        """Duration of other changes of speed from given times of the motion, seconds."""
        return self._at(self.others, time_s)

    def _at(self, table: Array, time_s: float | Array) -> Array:
        return np.asarray(
            self._unit_s * np.interp(time_s, np.linspace(0.0, self.duration_s, len(table)), table)
        )

    def rest_shapes(self, time_s: Array) -> Shapes:
        """Shapes of ramps to rest that start at given times of the motion."""
        place = (np.asarray(time_s) * (len(self.shapes) / self.duration_s)).astype(int)
        return np.asarray(self.shapes[np.clip(place, 0, len(self.shapes) - 1)])

    @property
    def _unit_s(self) -> float:
        return float((1 << self.unit_bits) / TICK_HZ)

    @property
    def longest_rest_s(self) -> float:
        """The longest brake time."""
        return self._unit_s * float(self.to_rest.max())


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
    shapes = _best_shapes(ramps.with_few_phases())
    kinds = (
        _Kind(ramps, TO_REST, _WORST_TO_REST, shapes, _REST_STARTS),
        _Kind(ramps, OTHERS, _WORST_OTHERS, np.full(OTHER_ENTRIES - 1, EVEN_RAMP), _OTHER_STARTS),
    )
    longest = _ROOM * TICK_HZ * max(float(kind.needed_s.max()) for kind in kinds)
    bits = LEAST_RAMP_BITS
    while True:
        while bits < MOST_RAMP_BITS and longest > RAMP_LENGTH << bits:
            bits += 1
        to_rest, others = (kind.table((1 << bits) / TICK_HZ) for kind in kinds)
        if bits == MOST_RAMP_BITS or max(to_rest.max(), others.max()) < RAMP_LENGTH:
            return BrakeTimes(trajectory.duration_s, to_rest, others, shapes, bits)
        bits += 1


def _best_shapes(ramps: _Ramps) -> Shapes:
    """(REST_ENTRIES - 1,): the shapes with the shortest mean time to rest from ends and middle of each part."""
    starts = np.linspace(0.0, 1.0, 2 * REST_ENTRIES - 1)
    even_s = ramps.shortest_s(starts, _WORST_TO_REST, np.full(len(starts), _SHORTEST_S), EVEN_RAMP)
    lengths = np.array(
        [ramps.shorter_s(starts, _WORST_TO_REST, even_s, shape) for shape in range(len(_SHAPES))]
    )
    return np.asarray(np.argmin(lengths[:, :-2:2] + lengths[:, 1::2] + lengths[:, 2::2], axis=0))


class _Kind:
    """Changes between ``rates``, of which ``worst`` need most time, with a shape for each part of their table.

    ``needed_s``: (parts, starts + 1), durations at equidistant starts from one end of a part to the other.
    """

    def __init__(self, ramps: _Ramps, rates: Rates, worst: Rates, shapes: Shapes, starts: int) -> None:
        self._ramps, self._rates, self._shapes = ramps, rates, shapes
        self._starts = starts
        at, shape = self._places(starts)
        least_s = np.full(at.size, _SHORTEST_S)
        self.needed_s = ramps.shortest_s(at.ravel(), worst, least_s, shape.ravel()).reshape(at.shape)

    def _places(self, starts: int) -> tuple[Array, Shapes]:
        """Starts as fractions of the motion's time, and their shapes."""
        parts = len(self._shapes)
        at = (np.arange(parts)[:, None] + np.linspace(0.0, 1.0, starts + 1)) / parts
        return at, np.repeat(self._shapes, starts + 1).reshape(at.shape)

    def table(self, unit_s: float) -> Array:
        """The entries, in units; one of RAMP_LENGTH may be too short."""
        needed = self.needed_s / unit_s
        table: Array = np.append(needed[:, 0], 0.0)
        table[1:] = np.maximum(table[1:], needed[:, -1])
        _lift(table, needed)
        table = np.minimum(np.ceil(table), RAMP_LENGTH)
        at, shape = self._places(2 * self._starts)
        length = np.zeros(at.shape)
        found = np.zeros(at.shape, bool)
        while True:
            before, length = length, _between(table, 2 * self._starts)
            new = length != before
            excess = self._ramps.excess(at[new], unit_s * length[new], self._rates, shape[new])
            found[new] = excess > EXCESS
            found &= length < RAMP_LENGTH - _NEGLIGIBLE
            if not np.any(found):
                return table
            _lift(table, np.where(found, _LONGER * length, 0.0))
            table = np.minimum(np.ceil(table), RAMP_LENGTH)


def _between(table: Array, starts: int) -> Array:
    """(parts, starts + 1): a table, interpolated between its entries."""
    weight = np.linspace(0.0, 1.0, starts + 1)
    return np.asarray((1.0 - weight) * table[:-1, None] + weight * table[1:, None])


def _lift(table: Array, needed: Array) -> None:
    """Lengthen the entries around values of the table that are less than ``needed``, by as little as possible."""
    starts = needed.shape[1] - 1
    while True:
        missing = needed - _between(table, starts)
        part, start = divmod(int(np.argmax(missing)), starts + 1)
        most = missing[part, start]
        if most <= _NEGLIGIBLE:
            return
        share = np.array([1.0 - start / starts, start / starts])
        table[part : part + 2] += most * share / np.sum(share**2)


class _Ramps:
    """Acceleration and jerk of a motion during changes of its rate, relative to the limits (J, 3)."""

    def __init__(self, trajectory: Trajectory, allowed: Array) -> None:
        self._phases = _PHASES
        self._duration_s = trajectory.duration_s
        self._allowed = allowed
        time = np.linspace(0.0, trajectory.duration_s, _SAMPLES)
        # speeds, accelerations and jerks over their limits' units; rest after the end
        # (3, J, T): the time axis last, which is fastest in NumPy
        self._motion = np.stack([trajectory(time, order).T for order in (1, 2, 3)])
        self.worst_of_motion = float(np.max(np.abs(self._motion[1:]) / allowed.T[1:, :, None]))

    def with_few_phases(self) -> _Ramps:
        """The same, evaluated at fewer points of each ramp."""
        found = copy(self)
        found._phases = _FEW_PHASES
        return found

    def shortest_s(self, starts: Array, rates: Rates, least_s: Array, shapes: Shapes | int) -> Array:
        """Shortest durations from ``least_s`` on, to 1 %; ``starts``: fractions of the motion, with ``shapes``."""
        shapes = np.broadcast_to(shapes, starts.shape)
        low, high = least_s.copy(), least_s.copy()
        left = np.arange(len(starts))
        while len(left := left[self.excess(starts[left], high[left], rates, shapes[left]) > EXCESS]):
            low[left], high[left] = high[left], 2.0 * high[left]
            left = left[high[left] < 2.0 * LONGEST_S]
        return self._halved(starts, rates, low, high, shapes)

    def shorter_s(self, starts: Array, rates: Rates, most_s: Array, shape: int) -> Array:
        """As ``shortest_s``, but between half of ``most_s`` and ``most_s``; twice ``most_s`` if that is not enough."""
        shapes = np.full(len(starts), shape)
        enough = self.excess(starts, most_s, rates, shapes) <= EXCESS
        low = np.where(enough, 0.5 * most_s, most_s)
        return np.where(enough, self._halved(starts, rates, low, most_s, shapes), 2.0 * most_s)

    def _halved(self, starts: Array, rates: Rates, low: Array, high: Array, shapes: Shapes) -> Array:
        """Bisect between ``low``, which is too short, and ``high``, which is long enough."""
        low, high = low.copy(), high.copy()
        left = np.flatnonzero(high > low)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low[left] + high[left])
            fails = self.excess(starts[left], middle, rates, shapes[left]) > EXCESS
            low[left] = np.where(fails, middle, low[left])
            high[left] = np.where(fails, high[left], middle)
        return high

    def excess(self, starts: Array, length_s: Array, rates: Rates, shapes: Shapes | int) -> Array:
        """Largest ratio of acceleration or jerk to its limit in changes between ``rates``, for each start."""
        worst = np.zeros(len(starts))
        if not len(starts):
            return worst
        length = length_s[:, None]
        place, rise, slope, bend, way, whole = _ramp(np.atleast_1d(shapes), self._phases)
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


def _ramp(shapes: Shapes, phases: int) -> tuple[Array, Array, Array, Array, Array, Array]:
    """r, S, S', S'' and e (N, 3 * phases) at the ends of each piece and in between, and e(1) (N, 1), of shapes (N,).

    As in ``armtempo_board/stepgen/time_law.py``.
    """
    second, first = np.divmod(_SHAPES[shapes][:, None], 16)
    first, second, whole = first / 16.0, second / 16.0, _WAYS[shapes][:, None] / 64.0
    late = 3 * (1 - whole) - first - second
    slopes = (0.0 * first, 2 * (1 - late) / second, 2 * late / (1 - first), 0.0 * first)
    at = np.linspace(0.0, 1.0, phases)
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
