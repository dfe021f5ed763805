"""The time for braking to rest, or for another change of speed, as a function of its start.

The board changes the rate of the motion's own time, so the arm stays on its path: in the brake time the rate
changes from r0 to r1, by the law in ``armtempo_board/stepgen/time_law.py``. Braking and pauses have r1 = 0, and of
RAMP_SHAPES the one with the shortest time from their start; other changes of speed have separate times, and a
fixed shape.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

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
Single = NDArray[np.float32]
Shapes = NDArray[np.int64]
"""Numbers of RAMP_SHAPES."""
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

LONGEST_S = (RAMP_LENGTH << MOST_RAMP_BITS) / TICK_HZ
_MOST_S = 2.0 * LONGEST_S
_LONGER, _MUCH_LONGER = 1.01, 1.1
_REST_STARTS, _OTHER_STARTS = 2, 4  # in each part of a table
_FINER = 3  # for the check
_PHASES = 15  # of each piece of a ramp for the check,
_SOME_PHASES = 6  # for the search of lengths,
_FEW_PHASES = 4  # and where shapes are compared
_SAMPLES = 4000
_SHORTEST_S = 0.01
_LESS = 0.3  # than estimated: longer ones may suffice because the motion ends, while less do not
_SECANTS, _MOST_TRIES = 5, 7
_CLOSE = 0.015  # below the most allowed
_ABOUT, _NEARLY = 1.2, 0.9  # of the estimated time to rest, and of that to the end: where shapes are compared
_ALIKE = 1e-9  # differences of speeds over their largest
_ROOM = 1.1  # for entries to be lengthened
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
    shapes = _best_shapes(ramps)
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
    """(REST_ENTRIES - 1,): the shapes with the shortest mean time to rest from ends and middle of each part.

    Of all shapes the excess is compared at the same length, in which the motion does not end.
    """
    starts = np.linspace(0.0, 1.0, 2 * REST_ENTRIES - 1)
    left_s = np.maximum((1.0 - starts) * ramps.duration_s, _SHORTEST_S)
    length_s = np.minimum(_ABOUT * ramps.estimated_s(starts), _NEARLY * left_s)
    count = len(_SHAPES)
    every, shapes = np.tile(starts, count), np.repeat(np.arange(count), len(starts))
    found = ramps.excess(every, np.tile(length_s, count), TO_REST[:1], shapes, _FEW_PHASES)
    lengths = length_s * np.sqrt(found.reshape(count, -1))
    return np.asarray(np.argmin(lengths[:, :-2:2] + lengths[:, 1::2] + lengths[:, 2::2], axis=0))


class _Kind:
    """Changes between ``rates``, of which ``worst`` need most time, with a shape for each part of their table.

    ``needed_s``: (parts, starts + 1), durations at equidistant starts from one end of a part to the other.
    """

    def __init__(self, ramps: _Ramps, rates: Rates, worst: Rates, shapes: Shapes, starts: int) -> None:
        self._ramps, self._worst, self._shapes = ramps, worst, shapes
        self._others = tuple(rate for rate in rates if rate not in worst)
        self._starts = starts
        at, shape = self._places(starts)
        found_s = ramps.shortest_s(at.ravel(), worst, shape.ravel(), _SOME_PHASES)
        self.needed_s = found_s.reshape(at.shape)

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
        at, shape = self._places(_FINER * self._starts)
        length = np.zeros(at.shape)
        longer = np.zeros(at.shape)
        least = 1.0
        while True:
            least = min(least + _LONGER - 1.0, _MUCH_LONGER)
            before, length = length, _between(table, _FINER * self._starts)
            new = length != before
            given = at[new], unit_s * length[new]
            excess = self._ramps.excess(*given, self._worst, shape[new], _PHASES)
            others = self._ramps.excess(*given, self._others, shape[new], _SOME_PHASES)
            excess = np.maximum(excess, others)
            longer[new] = np.where(excess > 1.0, np.clip(excess, least, _MUCH_LONGER), 0.0)
            longer[length > RAMP_LENGTH - _NEGLIGIBLE] = 0.0
            if not np.any(longer):
                return table
            _lift(table, longer * length)
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
    """Acceleration and jerk of a motion during changes of its rate, relative to EXCESS times the ``limits`` (J, 3)."""

    def __init__(self, trajectory: Trajectory, limits: Array) -> None:
        self.duration_s = trajectory.duration_s
        motion = _sampled(trajectory)
        self.worst_of_motion = float(np.max(np.abs(motion[1:]) / limits.T[1:, :, None]))
        # of each joint: speed, acceleration and jerk, each over the most of the jerk, with their differences; 0 after
        # the end; and the factor for those of the acceleration
        self._joints = [
            (_with_differences(rows / (EXCESS * most[2])), most[2] / most[1])
            for rows, most in zip(*_essential(motion, limits), strict=True)
        ]

    def shortest_s(self, starts: Array, rates: Rates, shapes: Shapes, phases: int) -> Array:
        """Shortest durations, to 1 %, (N,); ``starts``: fractions of the motion, (N,), with ``shapes``, (N,)."""
        low, high = np.full(len(starts), _SHORTEST_S), np.full(len(starts), np.inf)
        below, above = np.full(len(starts), 1.0), np.zeros(len(starts))  # logarithms of the excess there
        tried = np.maximum(_LESS * self.estimated_s(starts), _SHORTEST_S)
        left = np.arange(len(starts))
        tries = 0
        while len(left):
            tries += 1
            length = tried[left]
            excess = np.log(self.excess(starts[left], length, rates, shapes[left], phases))
            enough = excess <= 0.0
            now, later = left[enough], left[~enough]
            high[now], above[now] = length[enough], excess[enough]
            low[later], below[later] = length[~enough], excess[~enough]
            close = (above[left] > -_CLOSE) | (high[left] < _LONGER * low[left])
            close |= tries >= _MOST_TRIES
            left = left[~(close & np.isfinite(high[left])) & (low[left] < _MOST_S)]
            growth = np.clip(below[left], 0.05, math.log(2.0))
            share = np.clip((below[left] + 0.5 * _CLOSE) / (below[left] - above[left]), 0.15, 0.85)
            if tries > _SECANTS:
                share[:] = 0.5
            between = np.isfinite(high[left])
            growth[between] = share[between] * np.log(high[left][between] / low[left][between])
            tried[left] = low[left] * np.exp(growth)
        return np.asarray(np.minimum(high, _MOST_S))

    def estimated_s(self, starts: Array) -> Array:
        """The shortest times to rest (N,) from ``starts`` if no joint had to stay on its path."""
        first = np.rint(starts * (_SAMPLES - 1)).astype(np.intp)
        found = np.full(len(starts), _SHORTEST_S)
        for rows, factor in self._joints:
            speed, acceleration = (rows[order][0].take(first).astype(float) for order in (0, 1))
            acceleration = np.where(speed < 0.0, -acceleration, acceleration)
            speed = (
                np.abs(speed) + 0.5 * acceleration**2
            )  # when the acceleration is 0, with the most of the jerk, 1
            phase = np.minimum(np.sqrt(speed), 1.0 / factor)
            np.maximum(found, phase + speed / np.maximum(phase, _SHORTEST_S) + acceleration, out=found)
        return np.asarray(np.minimum(found, 0.5 * _MOST_S))

    def excess(self, starts: Array, length_s: Array, rates: Rates, shapes: Shapes, phases: int) -> Array:
        """Largest ratio (N,) of acceleration or jerk to the most allowed in changes between ``rates``.

        ``starts``: (N,), fractions of the motion; ``length_s`` (N,), ``shapes`` (N,), ``phases`` of each piece.
        """
        worst = np.full(len(starts), _NEGLIGIBLE, np.float32)
        last = _SAMPLES - 1
        place, rise, slope, bend, way, whole = (part[shapes] for part in _ramp(phases))
        begin, length = (last * starts[:, None]).astype(np.float32), length_s[:, None].astype(np.float32)
        slope = slope / length
        bend = bend / (length * length)
        length = np.float32(last / self.duration_s) * length
        for before, after in rates:
            least, change = min(before, after), after - before
            rate = least + abs(change) * rise
            passed = least * place + abs(change) * way
            if change < 0.0:
                passed = least + abs(change) * whole - passed
            at = np.minimum(begin + length * passed, last + 1.0)
            first = at.astype(np.int32)
            share = at - first.astype(np.float32)
            rate1, rate2, square = change * slope, abs(change) * bend, rate * rate
            cube, thrice = square * rate, 3.0 * rate * rate1
            for rows, factor in self._joints:
                speed, acceleration, jerk = (
                    values.take(first) + share * steps.take(first) for values, steps in rows
                )
                changed = np.abs(acceleration * square + speed * rate1).max(axis=1)
                np.maximum(worst, factor * changed, out=worst)
                changed = np.abs(jerk * cube + acceleration * thrice + speed * rate2).max(axis=1)
                np.maximum(worst, changed, out=worst)
        return worst.astype(float)


def _sampled(trajectory: Trajectory) -> Array:
    """Speed, acceleration and jerk of the joints at equidistant times, (3, J, _SAMPLES)."""
    time = np.linspace(0.0, trajectory.duration_s, _SAMPLES)
    found = np.zeros((3, len(trajectory.joints), _SAMPLES))
    for number, joint in enumerate(trajectory.joints):
        if np.ptp(joint.angle_points_deg) > 0.0:
            at_s, values = joint.sampled(-(-2 * _SAMPLES // len(joint.time_polynomials)))
            for order, row in enumerate(values):
                found[order, number] = np.interp(time, at_s, row, right=0.0)
    return found


def _essential(motion: Array, limits: Array) -> tuple[list[Array], list[Array]]:
    """The joints (3, T) that matter, with their limits (3,): of those that move in proportion, one for all."""
    peaks = np.abs(motion[0]).max(axis=1)
    kept: list[Array] = []
    most: list[Array] = []
    for rows, peak, limit in zip(motion.swapaxes(0, 1), peaks, limits, strict=True):
        if peak == 0.0:
            continue
        unit = rows / peak
        for number, known in enumerate(kept):
            sign = math.copysign(1.0, float(unit[0] @ known[0]))
            if np.allclose(unit[0], sign * known[0], rtol=0.0, atol=_ALIKE):
                most[number] = np.minimum(most[number], limit / peak)
                break
        else:
            kept.append(unit)
            most.append(limit / peak)
    return kept, most


def _with_differences(rows: Array) -> list[tuple[Single, Single]]:
    """Each row (T,), followed by zeros, with the differences between its values."""
    ended = np.pad(rows.astype(np.float32), ((0, 0), (0, 2)))
    steps = np.pad(np.diff(rows.astype(np.float32)), ((0, 0), (0, 3)))
    return list(zip(ended, steps, strict=True))


@cache
def _ramp(phases: int) -> tuple[Single, ...]:
    """r, S, S', S'' and e (N, 3 * phases) at the ends of each piece and in between, and e(1) (N, 1), of all N shapes.

    As in ``armtempo_board/stepgen/time_law.py``.
    """
    second, first = np.divmod(_SHAPES[:, None], 16)
    first, second, whole = first / 16.0, second / 16.0, _WAYS[:, None] / 64.0
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
        np.concatenate(one, axis=1).astype(np.float32) for one in zip(*pieces, strict=True)
    )
    return place, rises, slope, second_slope, ways, whole.astype(np.float32)
