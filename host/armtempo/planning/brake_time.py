"""The time for braking to rest, or for another change of speed, as a function of its start.

The board changes the rate of the motion's own time, so the arm stays on its path: in the brake time the rate
changes from r0 to r1, by the law in ``armtempo_board/stepgen/time_law.py``. Braking and pauses have r1 = 0, and of
RAMP_SHAPES the one with the shortest time from their start; other changes of speed have separate times, and a
fixed shape.
"""

from __future__ import annotations

from collections.abc import Sequence
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
    REST_ENTRIES,
)
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model.parts import Limits
from armtempo.planning.ramp_excess import EXCESS, SHORTEST_S, Ramps, Rates, Shapes, entry_times_s
from armtempo.splines.trajectory import Trajectory

TO_REST: Rates = ((1.0, 0.0), (0.75, 0.0), (0.5, 0.0), (0.35, 0.0), (0.2, 0.0))
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

_LEAST_LONGER, _MOST_LONGER = 0.02, 0.1  # parts of what is too short; the least doubles
_STARTS = 2  # parts of each part of a table between starts
_FINER = 4  # for the check
_PHASES = 10  # of each piece of a ramp for the check,
_SOME_PHASES = 5  # for the search of lengths and for rates that seldom matter,
_FEW_PHASES = 4  # and where shapes are compared
_BETWEEN = 0.995  # of the most allowed in the check: as much may be missed between its phases
_COMPARED, _OF = np.array([1, 2, 3, 4, 5, 6, 8, 10, 14, 20, 28, 40, 52, 64, 76, 88, 100, 112, 120, 125]), 126
"""Starts at which all shapes are compared; elsewhere only those that are the best there. More of them where the speed
rises from rest, as the best shape changes most there."""
_ABOUT, _NEARLY = 1.2, 0.9  # of the estimated time to rest, and of that to the end: where shapes are compared
_LEAST_FIRST, _POWERS = 0.01, (-3.0, -0.5)  # where lengths of shapes are estimated
_SPARE = 1.01  # so that few of them have to be lengthened
_MARGIN = 1.1  # for entries to be lengthened
_FEW_STARTS = 64  # for which one call with all rates is quicker than two
_NEGLIGIBLE = 1e-6  # of the unit of lengths


@dataclass(frozen=True, eq=False)
class BrakeTimes:
    """Durations of changes that start at some times of a motion, in 2**``unit_bits`` ticks; interpolated linearly.

    ``to_rest``: (REST_ENTRIES,), ``others``: (OTHER_ENTRIES,), integers. ``shapes``: (REST_ENTRIES - 1,), of ramps to
    rest that start between two entries. ``edge_bits``: where the entries lie. All as in ``armtempo_shared.motion``.
    """

    duration_s: float
    to_rest: Array
    others: Array
    shapes: Shapes
    unit_bits: int
    edge_bits: int = 0

    def rest_s(self, time_s: float | Array) -> Array:
        """Brake time from given times of the motion, seconds, of the same shape."""
        return self._at(self.to_rest, time_s)

    def change_s(self, time_s: float | Array) -> Array:
        """Duration of other changes of speed from given times of the motion, seconds."""
        return self._at(self.others, time_s)

    def _at(self, table: Array, time_s: float | Array) -> Array:
        return np.asarray(self._unit_s * np.interp(time_s, self._times_s(len(table) - 1), table))

    def _times_s(self, parts: int) -> Array:
        return entry_times_s(parts, self.duration_s, self.edge_bits)

    def rest_shapes(self, time_s: Array) -> Shapes:
        """Shapes of ramps to rest that start at given times of the motion."""
        inner_s = self._times_s(len(self.shapes))[1:-1]
        return np.asarray(self.shapes[np.searchsorted(inner_s, time_s, side="right")])

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
    ramps = Ramps(trajectory, np.array([limit.values for limit in limits]))
    if ramps.worst_of_motion > EXCESS:
        raise InputError(
            f"the motion {trajectory.name!r} goes beyond the arm's acceleration or jerk limits",
            "plan it again",
        )
    rests = _Kind(ramps, TO_REST, _WORST_TO_REST, REST_ENTRIES - 1)
    others = _Kind(ramps, OTHERS, _WORST_OTHERS, OTHER_ENTRIES - 1)
    shapes, about_s = _best_shapes(ramps, rests.starts_s)
    rests.search(shapes, about_s)
    others.search(np.full(OTHER_ENTRIES - 1, EVEN_RAMP), ramps.estimated_s(others.starts_s.ravel()))
    longest = _MARGIN * TICK_HZ * max(float(kind.needed_s.max()) for kind in (rests, others))
    bits = LEAST_RAMP_BITS
    while True:
        while bits < MOST_RAMP_BITS and longest > RAMP_LENGTH << bits:
            bits += 1
        to_rest, changes = (kind.table((1 << bits) / TICK_HZ) for kind in (rests, others))
        if bits == MOST_RAMP_BITS or max(to_rest.max(), changes.max()) < RAMP_LENGTH:
            return BrakeTimes(trajectory.duration_s, to_rest, changes, shapes, bits, ramps.edge_bits)
        bits += 1


def _best_shapes(ramps: Ramps, starts_s: Array) -> tuple[Shapes, Array]:
    """(parts,): the shapes with the shortest mean time to rest from the starts, (parts, S + 1), and about those times.

    Neighbouring parts have a start in common.
    """
    parts, last = len(starts_s), starts_s.shape[1] - 1
    at_s = np.append(starts_s[:, :-1].ravel(), starts_s[-1, -1])
    some = last * parts * _COMPARED // _OF
    every = np.arange(len(RAMP_SHAPES))
    best_of_some = np.argmin(_lengths_s(ramps, at_s[some], every), axis=0)
    shapes = np.flatnonzero(np.bincount(best_of_some))  # np.unique imports numpy.ma, and a goto would wait
    found_s = _lengths_s(ramps, at_s, shapes)
    found_s = found_s[:, last * np.arange(parts)[:, None] + np.arange(last + 1)]
    best = np.argmin(found_s.sum(axis=2), axis=0)
    return shapes[best], found_s[best, np.arange(parts)].ravel()


def _lengths_s(ramps: Ramps, starts_s: Array, shapes: Shapes) -> Array:
    """(N, S): about the lengths of ramps to rest with ``shapes``, (N,), from ``starts_s``, (S,).

    As if the excess were a power of the length: -2 where the rate's second derivative matters most. It is computed for
    lengths within which the motion does not end.
    """
    most_s = _NEARLY * np.maximum(ramps.duration_s - starts_s, SHORTEST_S)
    about_s = np.minimum(_ABOUT * ramps.estimated_s(starts_s), most_s)
    at, first_s, most_s = (np.tile(row, len(shapes)) for row in (starts_s, about_s, most_s))
    tried = np.repeat(shapes, len(starts_s))
    first = ramps.excess(at, first_s, TO_REST[:1], tried, _FEW_PHASES)
    next_s = np.minimum(first_s * np.sqrt(np.maximum(first, _LEAST_FIRST)), most_s)
    second = ramps.excess(at, next_s, TO_REST[:1], tried, _FEW_PHASES)
    power = np.log(second / first) / (np.log(next_s / first_s) - _NEGLIGIBLE)
    found_s = next_s * second ** (-1.0 / np.clip(power, *_POWERS))
    return np.asarray(found_s.reshape(len(shapes), -1))


class _Kind:
    """Changes between ``rates``, of which ``worst`` need most time, with a table of so many ``parts``.

    ``starts_s``: (parts, starts + 1), from one end of a part to the other; ``needed_s``: the durations there.
    """

    def __init__(self, ramps: Ramps, rates: Rates, worst: Rates, parts: int) -> None:
        self._ramps, self._worst = ramps, worst
        self._others = tuple(rate for rate in rates if rate not in worst)
        self._times_s = entry_times_s(parts, ramps.duration_s, ramps.edge_bits)
        self.starts_s = self._starts(_STARTS)
        self._shapes = np.full(parts, EVEN_RAMP)
        self.needed_s = np.zeros(self.starts_s.shape)

    def _starts(self, starts: int) -> Array:
        return np.asarray(np.linspace(self._times_s[:-1], self._times_s[1:], starts + 1, axis=1))

    def search(self, shapes: Shapes, about_s: Array) -> None:
        """Find ``needed_s`` with a shape for each part, (parts,), from about these times, one for each start."""
        self._shapes = shapes
        every = np.repeat(shapes, _STARTS + 1)
        found_s = self._ramps.shortest_s(self.starts_s.ravel(), about_s, self._worst, every, _SOME_PHASES)
        self.needed_s = _SPARE * found_s.reshape(self.starts_s.shape)

    def table(self, unit_s: float) -> Array:
        """The entries, in units; one of RAMP_LENGTH may be too short."""
        needed = self.needed_s / unit_s
        table: Array = np.zeros(len(needed) + 1)
        _lift(table, needed)
        table = np.minimum(np.ceil(table), RAMP_LENGTH)
        at = self._starts(_FINER)
        length = np.zeros(at.shape)
        longer = np.zeros(at.shape)
        least = _LEAST_LONGER
        while True:
            before, length = length, _between(table, _FINER)
            new = length != before
            excess = self._excess(new, at[new], unit_s * length[new])
            longer[new] = np.where(
                excess > 1.0, np.clip(excess, 1.0 + least, 1.0 + max(least, _MOST_LONGER)), 0.0
            )
            longer[length > RAMP_LENGTH - _NEGLIGIBLE] = 0.0
            if not np.any(longer):
                return table
            least *= 2.0
            _lift(table, longer * length)
            table = np.minimum(np.ceil(table), RAMP_LENGTH)

    def _excess(self, where: NDArray[np.bool_], starts_s: Array, length_s: Array) -> Array:
        """As of ``Ramps``, (N,), of all rates; ``where``: the starts among (parts, ...)."""
        shapes = self._shapes[np.nonzero(where)[0]]
        if len(starts_s) < _FEW_STARTS:
            return (
                self._ramps.excess(starts_s, length_s, self._worst + self._others, shapes, _PHASES) / _BETWEEN
            )
        excess = self._ramps.excess(starts_s, length_s, self._worst, shapes, _PHASES)
        others = self._ramps.excess(starts_s, length_s, self._others, shapes, _SOME_PHASES)
        return np.asarray(np.maximum(excess, others) / _BETWEEN)


def _between(table: Array, starts: int) -> Array:
    """(parts, starts + 1): a table, interpolated between its entries."""
    weight = np.linspace(0.0, 1.0, starts + 1)
    return np.asarray((1.0 - weight) * table[:-1, None] + weight * table[1:, None])


def _lift(table: Array, needed: Array) -> None:
    """Lengthen the entries around values of the table that are less than ``needed``, (parts, starts + 1)."""
    np.maximum(table[:-1], needed[:, 0], out=table[:-1])
    np.maximum(table[1:], needed[:, -1], out=table[1:])
    missing = np.max((needed - _between(table, needed.shape[1] - 1))[:, 1:-1], axis=1, initial=0.0)
    more = np.append(missing, 0.0)
    np.maximum(more[1:], missing, out=more[1:])
    table += more
