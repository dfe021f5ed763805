"""Few via points for a sampled path, so that the spline that is planned through them stays near it, which is proven."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from armtempo_shared.limits import MAX_SEGMENTS
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model import point_groups
from armtempo.model.joint_unit import DEG, JointUnit
from armtempo.splines import bspline, extremes
from armtempo.splines.bspline import REST_PIECES

DEGREE = 5
LARGEST_DEG = 90.0
REST_S = 0.2
"""A recording that stands still this long has a rest."""
_STILL = 0.1
"""Movement in a rest, as a fraction of the tolerance."""
_CHORDS = 32
"""Chords of a segment of the spline, each compared with the path."""
_NEARBY = 5
"""Segments on which a via point more or less has an effect worth checking."""
_GRADE = 2.1
"""Largest ratio of neighbouring segments at first."""
_TRIES = 5
_INSIDE = 1.5
"""Distance from the end of a range, for a spline that was beyond it by 1."""
_ROUNDING = 1e-9


Tolerance = float | Sequence[float]
"""One for all joints, or one for each, (J,), each in its joint's unit."""


@dataclass(frozen=True, eq=False)
class JointTolerance:
    """The tolerance of each joint of an arm as one number, in which positions are divided by ``scale``."""

    one: float
    """Of the turning joints in degrees; of an arm whose joints all slide in mm."""
    scale: Array
    """(J,): 1 for turning joints."""
    units: tuple[JointUnit, ...]

    @classmethod
    def of(cls, tolerance: Tolerance, units: Sequence[JointUnit]) -> JointTolerance:
        """Of joints with these units; raises InputError for one outside (0, LARGEST_DEG]."""
        each = np.broadcast_to(np.asarray(tolerance, dtype=float), (len(units),))
        for value, unit in zip(each.tolist(), units, strict=True):
            _check(value, unit.word)
        first = next((value for value, unit in zip(each, units, strict=True) if unit is DEG), each[0])
        return cls(float(first), each / first, tuple(units))

    def format(self, off: float) -> str:
        """A distance in which positions are divided by ``scale``, in the joints' units."""
        values = dict.fromkeys(
            (f"{off * factor:.2g}", unit.name) for factor, unit in zip(self.scale, self.units, strict=True)
        )
        if len({value for value, _ in values}) == 1:
            return f"{next(iter(values))[0]} {' or '.join(name for _, name in values)}"
        return " and ".join(f"{value} {name}" for value, name in values)


@dataclass(frozen=True, eq=False)
class Thinned:
    """Via points (n, J) in degrees, and the seconds of rest at some of them, by their number from 0."""

    via_deg: Array
    rests_s: dict[int, float]
    off_deg: float
    """Bound of the distance between the planned spline and the path, the largest over the joints."""
    left_out_s: tuple[float, float] = (0.0, 0.0)
    """Rests at the beginning and at the end."""


def thinned(
    points_deg: Array,
    tolerance_deg: float,
    times_s: Array | None = None,
    ranges_deg: Array | None = None,
    unit_words: str = DEG.word,
    steps: Callable[[Array], Array] | None = None,
) -> Thinned:
    """Via points such that the spline through them (degree 5, shared timing) and the points' polyline are near.

    To each place on one there is one on the other within ``tolerance_deg``, in the same order (Fréchet distance), the
    largest over the joints. ``points_deg``: (n, J); ``times_s``: (n,), increasing; with times, rests are kept.
    ``ranges_deg``: (J, 2), which the spline keeps if the points do, by a path that is a little inside where it would
    swing out; points beyond them by less than half of the tolerance, as recordings have them, count as at their ends.
    ``steps``: the motors' positions (n, J) of points; no two via points of a leg are then less than a step apart.
    Raises InputError for a tolerance outside (0, LARGEST_DEG], points that do not move, and if more via points are
    needed than a motion can have.
    """
    _check(tolerance_deg, unit_words)
    legs, waits_s = _at_rests(points_deg, times_s, _STILL * tolerance_deg)
    if not legs:
        raise InputError("all points are the same within the tolerance", "give a path that moves")
    cut_deg = 0.0 if steps is None else _cut(legs, waits_s, tolerance_deg, unit_words, steps)
    low, high = (
        np.full((2, points_deg.shape[1]), np.inf) * [[-1.0], [1.0]] if ranges_deg is None else ranges_deg.T
    )
    beyond_deg = float(np.abs(points_deg - np.clip(points_deg, low, high)).max())
    if beyond_deg > 0.5 * tolerance_deg:
        raise InputError(
            f"a point is {beyond_deg:.3g} {unit_words} beyond the range of its joint", "correct it"
        )
    wanted, inside = tolerance_deg - beyond_deg, np.zeros(2)
    for _ in range(_TRIES):
        lines = [
            _Polyline.of(np.clip(points, low + inside[0], high - inside[1]), times) for points, times in legs
        ]
        places = [_apart(line, _enough(line, wanted, unit_words), steps) for line in lines]
        via = [line.at(place) for line, place in zip(lines, places, strict=True)]
        whole = _whole(via)
        off_deg = _off_whole(whole, lines, places) + float(inside.max()) + beyond_deg
        out = _excess(whole, low, high)
        if off_deg <= tolerance_deg and not out.any():
            break
        inside = np.where(out > 0.0, inside + _INSIDE * out, inside)
        wanted *= 0.5
    else:
        raise InputError(
            f"its rests, slow parts and the ends of ranges cannot be kept within {tolerance_deg:g} {unit_words}",
            "allow more with --tolerance-deg or --tolerance-mm",
        )
    numbers = np.cumsum([len(each) - 1 for each in via]).tolist()
    rests = dict(zip(numbers[:-1], waits_s[1:-1], strict=True))
    points = np.concatenate([via[0], *(each[1:] for each in via[1:])])
    return Thinned(points, rests, max(off_deg, cut_deg), (waits_s[0], waits_s[-1]))


def _check(tolerance: float, unit_words: str) -> None:
    if not 0.0 < tolerance <= LARGEST_DEG:
        raise InputError(
            f"a tolerance of {tolerance:g} {unit_words} is not allowed",
            f"give one above 0, at most {LARGEST_DEG:g}",
        )


def _excess(whole: Array, low: Array, high: Array) -> Array:
    """How far the spline is below and above the ranges, the most of any joint: (2,); 0 inside."""
    least, most = extremes.range_of(np.moveaxis(bspline.polynomials(whole, DEGREE), 2, 0))
    beyond = np.array([np.max(low - least), np.max(most - high)])
    return np.where(beyond > _ROUNDING, beyond, 0.0)


@dataclass(frozen=True, eq=False)
class _Polyline:
    """Points (n, J) at increasing places (n,)."""

    points: Array
    places: Array

    @classmethod
    def of(cls, points: Array, times_s: Array | None) -> _Polyline:
        """Places: the times, or the centripetal parameter; repeated points are left out."""
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        moved = np.append(True, steps > 0.0)
        if times_s is not None:
            return cls(points[moved], times_s[moved])
        return cls(points[moved], np.append(0.0, np.cumsum(np.sqrt(steps[moved[1:]]))))

    def at(self, places: Array) -> Array:
        """Points at places (m,): (m, J)."""
        return np.stack([np.interp(places, self.places, column) for column in self.points.T], axis=1)

    def between(self, first: float, last: float) -> Array:
        """The points from one place to another, (m, J), both included."""
        inside = (self.places > first) & (self.places < last)
        return np.concatenate([self.at(np.array([first])), self.points[inside], self.at(np.array([last]))])


def _at_rests(
    points: Array, times_s: Array | None, still_deg: float
) -> tuple[list[tuple[Array, Array | None]], list[float]]:
    """The legs between rests, points and times each, and the seconds of rest before, between and after them."""
    if times_s is None:
        return [(points, None)] if np.ptp(points, axis=0).max() > 0.0 else [], [0.0, 0.0]
    runs = _runs(points, times_s, still_deg)
    if not runs or runs[0][0] > 0:
        runs.insert(0, (0, 0))
    if runs[-1][1] < len(points) - 1:
        runs.append((len(points) - 1, len(points) - 1))
    legs: list[tuple[Array, Array | None]] = []
    for (before, first), (last, after) in pairwise(runs):
        part = points[first : last + 1].copy()
        part[0], part[-1] = points[(before + first) // 2], points[(last + after) // 2]
        legs.append((part, times_s[first : last + 1]))
    return legs, [float(times_s[last] - times_s[first]) for first, last in runs]


def _cut(
    legs: list[tuple[Array, Array | None]],
    waits_s: list[float],
    tolerance_deg: float,
    unit_words: str,
    steps: Callable[[Array], Array],
) -> float:
    """Take first and last legs away that end less than a step from where they begin, as the planner cannot keep the
    rest behind them; returns how far from there they went. Raises InputError if that is more than the tolerance."""
    most_deg = 0.0
    for outer in (0, -1):
        while len(legs) > 1:
            points, times_s = legs[outer]
            inner = points[-1 - outer]
            off_deg = float(np.abs(points - inner).max())
            off_steps = np.abs(steps(points) - steps(inner[None]))
            if times_s is None or np.any(off_steps[outer] >= 1.0):
                break
            if off_deg > tolerance_deg:
                if np.any(off_steps >= 1.0):
                    break
                raise InputError(
                    f"its {'last' if outer else 'first'} move, of {off_deg:.2g} {unit_words} at most, is less than a "
                    "step, and the rest beside it cannot be kept",
                    "allow that much with --tolerance-deg or --tolerance-mm, or cut it from the table",
                )
            legs.pop(outer)
            rest_s = waits_s.pop(outer) + float(times_s[-1] - times_s[0])
            waits_s[outer] += rest_s
            most_deg = max(most_deg, off_deg)
    return most_deg


def _runs(points: Array, times_s: Array, still_deg: float) -> list[tuple[int, int]]:
    """First and last index of each rest."""
    runs = []
    first = 0
    while first < len(points):
        last = first
        low = high = points[first]
        while last + 1 < len(points):
            low, high = np.minimum(low, points[last + 1]), np.maximum(high, points[last + 1])
            if (high - low).max() > still_deg:
                break
            last += 1
        if times_s[last] - times_s[first] >= REST_S:
            runs.append((first, last))
            first = last + 1
        else:
            first += 1
    return runs


def _enough(line: _Polyline, tolerance_deg: float, unit_words: str) -> Array:
    """Places of via points: segments are halved until each is near the path, then points left out again."""
    places = line.places[[0, -1]]
    while True:
        bad = _offs(line, places, range(len(places) - 1)) > tolerance_deg
        if not bad.any():
            return _fewer(line, places, tolerance_deg)
        places = _graded(_halved(places, bad))
        if len(places) > MAX_SEGMENTS + 1:
            raise InputError(
                f"more than {MAX_SEGMENTS + 1} via points are needed to keep within {tolerance_deg:g} {unit_words}",
                "allow more with --tolerance-deg or --tolerance-mm, or cut the table into several motions",
            )


def _apart(line: _Polyline, places: Array, steps: Callable[[Array], Array] | None) -> Array:
    """The places without those less than a step beside another, which the planner takes for one."""
    if steps is None:
        return places
    found = point_groups.groups(steps(line.at(places)))
    return places[[point_groups.kept(group, len(places) - 1) for group in found]]


def _halved(places: Array, which: NDArray[np.bool_]) -> Array:
    return np.sort(np.append(places, 0.5 * (places[:-1] + places[1:])[which]))


def _graded(places: Array) -> Array:
    """The places with segments halved that are more than twice as long as one beside them, next to which a spline on
    even knots swings out."""
    while True:
        lengths = np.diff(places)
        beside = np.minimum(np.append(np.inf, lengths[:-1]), np.append(lengths[1:], np.inf))
        if not (long := lengths > _GRADE * beside).any():
            return places
        places = _halved(places, long)


def _fewer(line: _Polyline, places: Array, tolerance_deg: float) -> Array:
    """The places without those that are not needed."""
    tried = places
    for place in places[1:-1]:
        at = int(np.searchsorted(tried, place))
        without = np.delete(tried, at)
        near = range(max(at - _NEARBY, 0), min(at + _NEARBY, len(without) - 1))
        if _offs(line, without, near).max() <= tolerance_deg:
            tried = without
    whole = _offs(line, tried, range(len(tried) - 1)).max()
    return tried if whole <= tolerance_deg else places


def _offs(line: _Polyline, places: Array, segments: Sequence[int]) -> Array:
    """Bounds of the distance between spline and path on some segments between via points."""
    control = bspline.fit(line.at(places), DEGREE)
    return np.array(
        [
            _off(control[first : first + DEGREE + 1], line.between(places[first], places[first + 1]))
            for first in segments
        ]
    )


def _whole(via: Sequence[Array]) -> Array:
    """Control points of the spline through the via points of all legs, as the planner joins them at rests."""
    if len(via) == 1:
        return bspline.fit(via[0], DEGREE)
    rows: list[Array] = []
    knots = [0]
    for each in via:
        pieces = bspline.polynomials(bspline.refined(bspline.fit(each, DEGREE), REST_PIECES, DEGREE), DEGREE)
        ends = np.concatenate([pieces[:, 0], pieces[-1:].sum(axis=1)])
        ends[[0, -1]] = each[[0, -1]]
        rows.append(ends if not rows else ends[1:])
        knots.append(knots[-1] + len(pieces))
    if knots[-1] > MAX_SEGMENTS - DEGREE * (len(via) - 1):
        raise InputError(
            f"{sum(map(len, via))} via points with {len(via) - 1} rests do not fit the board",
            "allow more with --tolerance-deg or --tolerance-mm, or cut the table into several motions",
        )
    return bspline.fit(np.concatenate(rows), DEGREE, knots[1:-1])


def _off_whole(control: Array, lines: Sequence[_Polyline], places: Sequence[Array]) -> float:
    """The bound of the distance between the spline with all rests and the path."""
    pieces = 1 if len(lines) == 1 else REST_PIECES
    worst, at = 0.0, 0
    for line, own in zip(lines, places, strict=True):
        for first, last in pairwise(own):
            worst = max(worst, _off(control[at : at + pieces + DEGREE], line.between(first, last)))
            at += pieces
    return worst


def _off(control: Array, path: Array) -> float:
    """A bound of the Fréchet distance between a part of a spline and a part of the path, (m, J), with the same ends.

    ``control``: (S + 5, J). The spline is cut into chords; each is compared with the polyline from the place nearest to
    its start to that nearest to its end. A chord of parameter length h is off its curve by h^2 / 8 times the largest
    second derivative, which is within its control points.
    """
    pieces = bspline.polynomials(control, DEGREE)
    count = max(_CHORDS // len(pieces), 4)
    powers = (np.arange(count) / count)[:, None] ** np.arange(DEGREE + 1)
    curve = np.concatenate(
        [np.einsum("up,spj->suj", powers, pieces).reshape(-1, path.shape[1]), pieces[-1:].sum(axis=1)]
    )
    bent = np.abs(np.diff(control, 2, axis=0)).max() / (8.0 * count**2)
    places = _nearest(curve, path)
    edges = np.arange(len(path), dtype=float)
    met = np.stack([np.interp(places, edges, column) for column in path.T], axis=1)
    away = np.abs(curve - met).max(axis=1)
    return float(np.maximum(away[:-1], away[1:]).max() + bent + _cut_off(places, met, path))


def _nearest(curve: Array, path: Array) -> Array:
    """The places on the path nearest to points of the curve, increasing: (K,); the path's points are at 0, 1, ...."""
    starts, chords = path[:-1], np.diff(path, axis=0)
    squares = np.maximum(np.sum(chords**2, axis=1), 1e-300)
    part = np.clip(((curve @ chords.T) - np.sum(starts * chords, axis=1)) / squares, 0.0, 1.0)
    gaps = (
        np.sum(curve**2, axis=1)[:, None]
        + np.sum(starts**2, axis=1)
        + part * (2.0 * np.sum(starts * chords, axis=1) + part * squares)
        - 2.0 * (curve @ starts.T)
        - 2.0 * part * (curve @ chords.T)
    )
    edge = gaps.argmin(axis=1)
    found = np.maximum.accumulate(edge + part[np.arange(len(curve)), edge])
    found[0], found[-1] = 0.0, len(chords)
    return np.asarray(found)


def _cut_off(places: Array, met: Array, path: Array) -> float:
    """How far the path is from its chords between places (K,), where it is at ``met``, (K, J)."""
    points = np.arange(1, len(path) - 1)
    if not points.size:
        return 0.0
    chord = np.clip(np.searchsorted(places, points, side="right") - 1, 0, len(places) - 2)
    starts, chords = met[chord], met[chord + 1] - met[chord]
    squares = np.maximum(np.sum(chords**2, axis=1), 1e-300)
    part = np.clip(np.sum((path[points] - starts) * chords, axis=1) / squares, 0.0, 1.0)
    part = _rising(chord, part)
    return float(np.abs(path[points] - starts - part[:, None] * chords).max())


def _rising(chord: NDArray[np.intp], part: Array) -> Array:
    """The parts of each chord, increasing along it."""
    return np.asarray(np.maximum.accumulate(chord + part) - chord)
