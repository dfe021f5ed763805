"""Acceleration and jerk of a motion while the rate of its own time changes, relative to what is allowed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from armtempo_shared.limits import TICK_HZ
from armtempo_shared.motion import (
    LEAST_EDGE_BITS,
    MOST_EDGE_BITS,
    MOST_RAMP_BITS,
    RAMP_LENGTH,
    RAMP_SHAPES,
    RAMP_WAYS,
    edge_parts,
)
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.splines.trajectory import JointSpline, Trajectory

EXCESS = 1.25
"""Multiple of the acceleration and jerk limits that braking and changes of speed may reach. A motion at its
limits could brake only very slowly within them, as braking adds to the acceleration and jerk of the path."""

Rates = tuple[tuple[float, float], ...]
Single = NDArray[np.float32]
Shapes = NDArray[np.int64]
"""Numbers of RAMP_SHAPES."""

LONGEST_S = (RAMP_LENGTH << MOST_RAMP_BITS) / TICK_HZ
MOST_S = 2.0 * LONGEST_S
SHORTEST_S = 0.01
_LONGER, _MUCH_LONGER = 1.01, 1.1
_SAMPLES_PER_SEGMENT, _LEAST_SAMPLES, _MOST_SAMPLES = 50, 1000, 4000
_SECANTS, _MOST_TRIES = 4, 6
_FEW_LEFT = 0.15  # of the starts, which may be _MUCH_LONGER
_CLOSE = 0.015  # below the most allowed
_ALIKE = 1e-9  # differences of control points over their largest distance
_LEAST_EXCESS = 1e-6
_QUIET = 0.1  # of the largest acceleration and jerk: between the ramps at a motion's ends there is no more
_AROUND = 1.2  # times those ramps is where a table's entries are close
_SHAPES, _WAYS = np.frombuffer(RAMP_SHAPES, np.uint8), np.frombuffer(RAMP_WAYS, np.uint8)


def entry_times_s(parts: int, duration_s: float, edge_bits: int) -> Array:
    """Times of a table's entries in a motion, (parts + 1,) (``armtempo_shared.motion``)."""
    if not edge_bits:
        return np.linspace(0.0, duration_s, parts + 1)
    side, edge_s = edge_parts(parts), duration_s / 2**edge_bits
    ends_s = [0.0, edge_s, duration_s - edge_s, duration_s]
    return np.asarray(np.interp(np.arange(parts + 1), [0, side, parts - side, parts], ends_s))


class Ramps:
    """Acceleration and jerk of a motion during changes of its rate, relative to EXCESS times the ``limits`` (J, 3).

    ``edge_bits``: where entries are close, from the motion; ``worst_of_motion``: its own largest ratio to the limits.
    """

    def __init__(self, trajectory: Trajectory, limits: Array) -> None:
        self.duration_s = trajectory.duration_s
        splines, most = _essential(trajectory, limits)
        segments = max((len(spline.time_polynomials) for spline in splines), default=1)
        count = min(max(_SAMPLES_PER_SEGMENT * segments, _LEAST_SAMPLES), _MOST_SAMPLES)
        sampled = [spline.sampled(-(-count // len(spline.time_polynomials))) for spline in splines]
        loads = [
            np.max(np.abs(rows[1:]) / limit[1:, None], axis=0)
            for (_, rows), limit in zip(sampled, most, strict=True)
        ]
        self.worst_of_motion = max((float(load.max()) for load in loads), default=0.0)
        self.edge_bits = _edge_bits([at_s for at_s, _ in sampled], loads, self.duration_s)
        self._last = count - 1
        side, edge_s = edge_parts(self._last), self.duration_s / 2**self.edge_bits
        self._edge_s, self._middle_s = np.float32(edge_s), np.float32(self.duration_s - 2.0 * edge_s)
        self._per_s, self._less_per_s = self._last / self.duration_s, 0.0  # samples
        if self.edge_bits:
            self._per_s = side / edge_s
            self._less_per_s = (self._last - 2 * side) / float(self._middle_s) - self._per_s
        time_s = entry_times_s(self._last, self.duration_s, self.edge_bits)
        # speed, acceleration and jerk of each joint, (3, J, T), over the most of the jerk, and their differences; 0
        # after the end; and the factors for those of the acceleration, (J, 1, 1)
        scaled = np.zeros((3, len(splines), len(time_s)))
        for number, ((at_s, rows), limit) in enumerate(zip(sampled, most, strict=True)):
            for kind, row in enumerate(rows):
                scaled[kind, number] = np.interp(time_s, at_s, row, right=0.0) / (EXCESS * limit[2])
        self._values, self._steps = _with_differences(scaled)
        self._factors = np.array([limit[2] / limit[1] for limit in most], np.float32)[:, None, None]

    def _places(self, time_s: Single) -> Single:
        """Numbers of samples at times of the motion, float32."""
        at = time_s * np.float32(self._per_s)
        if self.edge_bits:
            beyond = np.clip(time_s - self._edge_s, np.float32(0.0), self._middle_s)
            at += beyond * np.float32(self._less_per_s)
        return np.asarray(np.minimum(at, np.float32(self._last + 1.0)))

    def shortest_s(self, starts_s: Array, guess_s: Array, rates: Rates, shapes: Shapes, phases: int) -> Array:
        """Shortest lengths, to 1 %, (N,), of ramps from ``starts_s`` with ``shapes``, found from a guess, all (N,)."""
        low, high = np.full(len(starts_s), SHORTEST_S), np.full(len(starts_s), np.inf)
        below, above = np.full(len(starts_s), 1.0), np.zeros(len(starts_s))  # logarithms of the excess there
        tried = np.clip(guess_s, SHORTEST_S, MOST_S)
        left = np.arange(len(starts_s))
        tries = 0
        while len(left):
            tries += 1
            length = tried[left]
            excess = np.log(self.excess(starts_s[left], length, rates, shapes[left], phases))
            enough = excess <= 0.0
            now, later = left[enough], left[~enough]
            high[now], above[now] = length[enough], excess[enough]
            low[later], below[later] = length[~enough], excess[~enough]
            close = (above[left] > -_CLOSE) | (high[left] < _LONGER * low[left])
            close |= tries >= _MOST_TRIES
            left = left[~(close & np.isfinite(high[left])) & (low[left] < MOST_S)]
            if len(left) < _FEW_LEFT * len(starts_s):
                left = left[high[left] > _MUCH_LONGER * low[left]]
            growth = np.clip(below[left], 0.05, math.log(2.0))
            share = np.clip((below[left] + 0.5 * _CLOSE) / (below[left] - above[left]), 0.15, 0.85)
            if tries > _SECANTS:
                share[:] = 0.5
            between = np.isfinite(high[left])
            growth[between] = share[between] * np.log(high[left][between] / low[left][between])
            tried[left] = low[left] * np.exp(growth)
        return np.asarray(np.minimum(high, MOST_S))

    def estimated_s(self, starts_s: Array) -> Array:
        """The shortest times to rest (N,) from ``starts_s`` if no joint had to stay on its path."""
        first = np.minimum(np.rint(self._places(starts_s.astype(np.float32))), self._last).astype(np.intp)
        found = np.full(len(starts_s), SHORTEST_S)
        speeds, accelerations, _ = self._values.take(first, axis=2).astype(float)
        for speed, acceleration, factor in zip(speeds, accelerations, self._factors[:, 0, 0], strict=True):
            acceleration = np.where(speed < 0.0, -acceleration, acceleration)
            # when the acceleration is 0, with the most of the jerk, 1
            speed = np.abs(speed) + 0.5 * acceleration**2
            phase = np.minimum(np.sqrt(speed), 1.0 / factor)
            np.maximum(found, phase + speed / np.maximum(phase, SHORTEST_S) + acceleration, out=found)
        return np.asarray(np.minimum(found, 0.5 * MOST_S))

    def excess(self, starts_s: Array, length_s: Array, rates: Rates, shapes: Shapes, phases: int) -> Array:
        """Largest ratio (N,) of acceleration or jerk to the most allowed in changes between ``rates``.

        ``starts_s``, ``length_s``, ``shapes``: (N,); ``phases`` of each piece of a ramp.
        """
        table = _ramp(phases)
        if len(shapes) and np.all(shapes == shapes[0]):
            shapes = shapes[:1]
        place, rise, slope, bend, distance, whole = table.take(shapes, axis=2)[:, :, None]
        begin, length = starts_s.astype(np.float32), length_s.astype(np.float32)
        before, after = np.array(rates, np.float32).T[:, :, None]  # the axes: phases, rates, starts
        least, change = np.minimum(before, after), after - before
        size = np.abs(change)
        rate = size * rise
        rate += least
        time_s = size * distance
        time_s += least * place
        np.copyto(time_s, least + size * whole - time_s, where=change < 0.0)
        time_s = length * time_s
        time_s += begin
        share = self._places(time_s)
        whole_places = np.floor(share)
        share -= whole_places
        first = whole_places.astype(np.intp)
        rate1, rate2 = change * (slope / length), size * (bend / (length * length))
        square = rate * rate
        cube, thrice = square * rate, np.float32(3.0) * rate * rate1
        # every number is inside; "wrap" is the quickest of numpy's modes
        rows = self._steps.take(first, axis=2, mode="wrap")
        rows *= share
        rows += self._values.take(first, axis=2, mode="wrap")
        speed, acceleration, jerk = rows
        jerk *= cube
        jerk += acceleration * thrice
        jerk += speed * rate2
        acceleration *= square
        speed *= rate1
        acceleration += speed
        found, of_jerk = np.abs(rows[1:], out=rows[1:]).max(axis=2)
        found *= self._factors
        worst = np.maximum(found, of_jerk).max(axis=(0, 1), initial=_LEAST_EXCESS)
        return np.asarray(worst, dtype=float)


def _essential(trajectory: Trajectory, limits: Array) -> tuple[list[JointSpline], list[Array]]:
    """The joints that matter, with their limits (3,): of those that move in proportion, one for all."""
    kept: list[JointSpline] = []
    units: list[Array] = []
    spans: list[float] = []
    most: list[Array] = []
    for spline, limit in zip(trajectory.joints, limits, strict=True):
        distance = spline.angle_points_deg - spline.angle_points_deg[0]
        span = float(np.max(np.abs(distance)))
        if span == 0.0:
            continue
        unit = distance / distance[np.argmax(np.abs(distance))]
        for number, known in enumerate(units):
            axis = kept[number].time_points_s
            alike = known.shape == unit.shape and np.abs(unit - known).max() <= _ALIKE
            if alike and (spline.time_points_s is axis or np.array_equal(spline.time_points_s, axis)):
                most[number] = np.minimum(most[number], limit * spans[number] / span)
                break
        else:
            kept.append(spline)
            units.append(unit)
            spans.append(span)
            most.append(limit)
    return kept, most


def _edge_bits(times_s: Sequence[Array], loads: Sequence[Array], duration_s: float) -> int:
    """So that the closer entries are where the ramps at the ends of a motion are, and its middle is quiet; or 0.

    ``loads``: at the ``times_s`` of each joint, the larger ratio of its acceleration and jerk to its limits.
    """
    if not loads:
        return 0
    time_s, load = np.concatenate(times_s), np.concatenate(loads)
    busy_s = time_s[load > _QUIET * load.max()]
    edge_s = _AROUND * float(np.max(np.minimum(busy_s, duration_s - busy_s)))
    bits = min(int(math.log2(duration_s / edge_s)), MOST_EDGE_BITS) if edge_s > 0.0 else 0
    return bits if bits >= LEAST_EDGE_BITS else 0


def _with_differences(rows: Array) -> tuple[Single, Single]:
    """The rows (..., T), followed by zeros, and the differences between their values."""
    found = np.zeros((2, *rows.shape[:-1], rows.shape[-1] + 2), np.float32)
    found[0, ..., :-2] = rows
    found[1, ..., :-3] = np.diff(found[0, ..., :-2])
    return found[0], found[1]


@cache
def _ramp(phases: int) -> Single:
    """r, S, S', S'', e and e(1), (6, 3 * phases, N), at the ends of each piece and in between, of all N shapes.

    As in ``armtempo_board/stepgen/time_law.py``.
    """
    second, first = np.divmod(_SHAPES[:, None], 16)
    first, second, whole = first / 16.0, second / 16.0, _WAYS[:, None] / 64.0
    late = 3 * (1 - whole) - first - second
    slopes = (0.0 * first, 2 * (1 - late) / second, 2 * late / (1 - first), 0.0 * first)
    at = np.linspace(0.0, 1.0, phases)
    rise = distance = start = 0.0 * first
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
                distance + width * at * (rise + at * (gain / 2 + at * bend / 6)),
            )
        )
        start = start + width
        rise, distance = pieces[-1][1][:, -1:], pieces[-1][4][:, -1:]
    parts = [np.concatenate(one, axis=1).T for one in zip(*pieces, strict=True)]
    return np.array([*parts, np.broadcast_to(whole.T, parts[0].shape)], np.float32)
