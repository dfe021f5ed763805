"""Proven lower bounds of the motion time, for comparison with a plan: of one joint, and of several on a path."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.progress import stage
from armtempo.model.parts import Limits
from armtempo.planning import dual_bound, rest_to_rest, via_bound
from armtempo.planning.dual_bound import MINIMUM_FACTOR, Cells, Multipliers
from armtempo.splines import bernstein, bspline

_HALVINGS = 4
"""Number of halvings of cells; the loss is proportional to the square of the pieces' length."""
_ROUNDING = 1e-9
"""Relative reduction of the bound for the rounding of its sums."""


def value(cells: Cells, multipliers: Multipliers) -> float:
    """A lower bound of the motion time along the path, in the cells' unit of time; 0 if the multipliers prove nothing.

    The minimum over x is concave and increases with w and c. On a piece, w and c are at least their chords
    minus the largest distance of the Bernstein coefficients below them, and by concavity the trapezoidal rule
    is a lower bound.
    """
    multipliers = _scaled(multipliers)
    w, c = _forms(cells, multipliers)
    cost = float(multipliers.speed.sum() + _trapezoid(multipliers.acceleration))
    highest = np.repeat(_highest_x(cells), 2**_HALVINGS)
    for _ in range(_HALVINGS):
        w, c = (bernstein.halves(form).reshape(-1, form.shape[-1]) for form in (w, c))
    low_w, low_c = np.maximum(w.min(axis=1), 0.0), c.min(axis=1)
    (w0, w1), (c0, c1) = _lowered_chord(w), _lowered_chord(c)
    chord = (np.minimum(w0, w1) >= 0.0) & (np.minimum(c0, c1) >= 0.0)
    flat = _least(low_w, np.maximum(low_c, 0.0)) + np.where(low_c < 0.0, low_c * highest, 0.0)
    with np.errstate(invalid="ignore"):
        sloped = 0.5 * (_least(w0, c0) + _least(w1, c1))
    total = float(np.sum(np.where(chord, sloped, flat))) / 2**_HALVINGS - cost
    return max(total * (1.0 - _ROUNDING), 0.0) if np.isfinite(total) else 0.0


def _scaled(multipliers: Multipliers) -> Multipliers:
    """All multipliers scaled so that w, 1 minus the sum of the jerk multipliers, is >= 0 everywhere."""
    jerk = multipliers.jerk.sum(axis=(0, 2))
    # the Bernstein coefficients of a cell are the middle coefficient and its means with both neighbours
    most = float(max(np.max(jerk[1:-1]), np.max(0.5 * (jerk[1:] + jerk[:-1]))))
    part = min(1.0, (1.0 - _ROUNDING) / most) if most > 0.0 else 1.0
    return Multipliers(multipliers.jerk * part, multipliers.acceleration * part, multipliers.speed * part)


def _forms(cells: Cells, multipliers: Multipliers) -> tuple[Array, Array]:
    """Bernstein coefficients of w (N, 3) and c (N, 9) on the cells."""
    multiply, elevate = bernstein.multiply, bernstein.elevate
    q1, q2 = (
        bernstein.from_power(np.moveaxis(bspline.derivative(cells.pieces, order), 1, 2)) for order in (1, 2)
    )
    whole = multipliers.jerk.sum(axis=(0, 2))
    w = np.stack(
        [1.0 - 0.5 * (whole[:-2] + whole[1:-1]), 1.0 - whole[1:-1], 1.0 - 0.5 * (whole[1:-1] + whole[2:])], 1
    )
    jerk = (multipliers.jerk[0] - multipliers.jerk[1]) / cells.limits[:, 2]
    slope = np.diff(jerk, axis=0)
    first = np.stack([slope[:-1], slope[1:]], axis=-1)
    second = np.diff(slope, axis=0)[..., None]
    acceleration = (multipliers.acceleration[0] - multipliers.acceleration[1]) / cells.limits[:, 1]
    level = np.stack([acceleration[:-1], acceleration[1:]], axis=-1)
    change = np.diff(acceleration, axis=0)[..., None]
    speed = (multipliers.speed / cells.limits[:, 0] ** 2)[..., None]
    degree = 2 * (q1.shape[-1] - 1)
    terms = (
        elevate(multiply(q1, second), degree) - elevate(multiply(q2, first), degree)
        + elevate(multiply(q2, level), degree) - elevate(multiply(q1, change), degree)
    )  # fmt: skip
    c = speed * multiply(q1, q1) + 0.5 * terms
    return w, bernstein.unscale(c.sum(axis=1))


def _trapezoid(coefficients: Array) -> float:
    """Integral of functions that are linear on cells of length 1, from values at the ends (2, N + 1, J)."""
    return float(coefficients[:, 1:-1].sum() + 0.5 * coefficients[:, [0, -1]].sum())


def _lowered_chord(form: Array) -> tuple[Array, Array]:
    """Ends of a line below each piece (P, d + 1)."""
    first, last = form[:, 0], form[:, -1]
    chord = np.linspace(first, last, form.shape[1], axis=1)
    below = np.max(chord - form, axis=1)
    return first - below, last - below


def _least(w: Array, c: Array) -> Array:
    """The minimum over x for w and c of 0 or more."""
    return np.asarray(MINIMUM_FACTOR * np.cbrt(w) ** 2 * np.cbrt(c))


def _highest_x(cells: Cells) -> Array:
    """Upper bound of x on each cell, (N,); infinite without a simple bound.

    Bounds: a joint's speed limit; after a turn of a joint in the cell, its acceleration limit, v^2 <= 2 A
    |dq|; after a rest, its jerk limit, v <= J / 2 (6 dq / J)^(2/3).
    """
    speed, acceleration, jerk = cells.limits.T
    first, second, third = (_extent(cells.pieces, order) for order in (1, 2, 3))
    turns = (second.least > 0.0) & _changes(cells.pieces)
    with np.errstate(divide="ignore", invalid="ignore"):
        by_speed = (speed / first.least) ** 2
        by_turn = np.where(turns, acceleration * second.most / second.least**2, np.inf)
        by_rest = np.full(by_speed.shape, np.inf)
        if cells.rests:
            ends = [0, -1]
            by_rest[ends] = (np.cbrt(jerk) ** 2 * np.cbrt(third.most) ** 4 / third.least**2)[ends]
    found = np.minimum(np.minimum(by_speed, by_turn), by_rest)
    return np.asarray(np.nan_to_num(found, nan=np.inf, posinf=np.inf).min(axis=1))


class _Extent(NamedTuple):
    """Bounds of a magnitude on each cell, (N, J); the lower bound is 0 if the sign is not known."""

    least: Array
    most: Array


def _extent(pieces: Array, order: int) -> _Extent:
    """Bounds of the derivative of the given order, of each joint."""
    plain = bernstein.unscale(bernstein.from_power(np.moveaxis(bspline.derivative(pieces, order), 1, 2)))
    low, high = plain.min(axis=2), plain.max(axis=2)
    least = np.maximum(np.maximum(low, -high), 0.0)
    return _Extent(least, np.maximum(np.abs(low), np.abs(high)))


def _changes(pieces: Array) -> NDArray[np.bool_]:
    """Cells with opposite signs of the first derivative at their ends: (N, J)."""
    slopes = bspline.derivative(pieces, 1)
    return np.asarray(slopes[:, 0] * slopes.sum(axis=1) <= 0.0, dtype=bool)


_WIGGLE = 1e-9
"""Reversals smaller than this fraction of the joint's way are rounding."""
_ROUNDED = 1.0 - 1e-9
"""Factor on the bounds, for the rounding of angles and sums."""
_MOST_CELLS, _LEAST_CELLS = 16, 4
"""Cells per segment of the path, most and least."""
_WORK = 10_000
"""Bound of segments times the square of the number of joints; above it, fewer cells are used."""


@dataclass(frozen=True)
class LowerBound:
    """A proven lower bound of a motion time under speed, acceleration and jerk limits.

    ``kind``: ``"rests"``: of one joint between its reversals; ``"path"``: along the common path; through the via
    points, for any path, ``"vias"``: of one joint, ``"together"``: of all of them.
    """

    time_s: float
    kind: str


def of_path(angle_points_deg: Array, degree: int, limits: Sequence[Limits], about_s: float) -> LowerBound:
    """The highest lower bound for joints that move together on a path; ``about_s``: approximate motion time.

    ``angle_points_deg``: (n + degree, J). Bounds: each joint between its reversals, where it stands still; for
    several joints, also the dual bound of all time laws along the path.
    """
    found = []
    # Exact for a short way, for which it is the larger bound
    angle_points_deg = angle_points_deg - angle_points_deg[0]
    for joint, limit in enumerate(limits):
        reached = turns(angle_points_deg[:, joint], degree)
        found.append(
            LowerBound(_ROUNDED * rest_to_rest.lower_bound_s(reached, limit, from_rest=degree == 5), "rests")
        )
    if len(limits) > 1:
        found.append(LowerBound(_path_s(angle_points_deg, degree, limits, about_s), "path"))
    return max(found, key=lambda bound: bound.time_s)


def _path_s(angle_points_deg: Array, degree: int, limits: Sequence[Limits], about_s: float) -> float:
    """The dual bound, on more cells if few prove nothing; 0 if that does not help."""
    stage("proving the lower bound")
    segments = len(angle_points_deg) - degree
    parts = min(max(_WORK // (segments * len(limits) ** 2), _LEAST_CELLS), _MOST_CELLS)
    found = _by_cells(angle_points_deg, degree, limits, about_s, parts)
    while found <= 0.0 and parts < _MOST_CELLS:
        parts *= 2
        found = _by_cells(angle_points_deg, degree, limits, about_s, parts)
    return found


def _by_cells(points_deg: Array, degree: int, limits: Sequence[Limits], about_s: float, parts: int) -> float:
    """The dual bound with ``parts`` cells per segment of the path."""
    pieces = bspline.subdivide(bspline.polynomials(points_deg, degree), parts)
    cell_s = about_s / len(pieces)
    values = np.array([limit.values for limit in limits]) * cell_s ** np.arange(1, 4)
    cells = Cells(pieces, values, degree == 5)
    return value(cells, dual_bound.best_multipliers(cells)) * cell_s


def turns(angle_points_deg: Array, degree: int) -> Array:
    """Start, turning points and end of one joint's path, in order; ``angle_points_deg``: (n + degree,)."""
    pieces = bspline.polynomials(angle_points_deg, degree)
    angles = np.concatenate([_stationary(piece) for piece in pieces] + [[pieces[-1].sum()]])
    wiggle = _WIGGLE * float(np.ptp(angles))
    return np.array(_turning(angles, wiggle))


def _stationary(piece: Array) -> Array:
    """Angles at the start of a segment and at zeros of its slope, in order of u."""
    slope = (piece[1:] * np.arange(1, len(piece)))[::-1]
    roots = np.roots(slope) if np.any(slope) else np.empty(0)
    u = np.sort(roots.real[(np.abs(roots.imag) < 1e-7) & (roots.real > 0) & (roots.real < 1)])
    return np.polyval(piece[::-1], np.concatenate([[0.0], u]))


def of_vias(
    via_deg: Array,
    limits: Sequence[Limits],
    stops: Mapping[int, float],
    loose: Collection[int] = (),
    times_s: Array | None = None,
) -> LowerBound:
    """A lower bound for all motions through via angles (n + 1, J), on any path.

    The sum over legs between stops (dwells in seconds by via point) of the largest, over joints, of the
    least time through its turning via angles under its three limits: at a turning via angle the joint stands
    still there or beyond. With several joints and ``times_s`` (n + 1,), when a plan arrives at the via points, or
    what ``via_bound`` proves for the joints together, if that is more. ``loose`` via points, which may be passed at
    other angles, are ignored.
    """
    last = len(via_deg) - 1
    ends = [0, *sorted(set(stops) - set(loose)), last]
    total, kind = sum(stops.values()), "vias"
    values = np.array([limit.values for limit in limits])
    for first, end in pairwise(ends):
        exact = [via for via in range(first, end + 1) if via not in loose]
        rests = end not in loose
        alone = max(
            rest_to_rest.lower_bound_s(_stood_at(via_deg[exact, joint], rests), limit, to_rest=rests)
            for joint, limit in enumerate(limits)
        )
        together = 0.0
        if times_s is not None and len(limits) > 1 and len(exact) > 1:
            stage("proving the lower bound")
            lasts_s = np.diff(times_s[exact]) - [
                sum(dwell for via, dwell in stops.items() if here <= via < there)
                for here, there in pairwise(exact)
            ]
            together = via_bound.lower_bound_s(via_deg[exact], values, lasts_s, rests)
        kind = "together" if together > alone else kind
        total += _ROUNDED * max(alone, together)
    return LowerBound(total, kind)


def _turning(angles: Array, wiggle: float = 0.0) -> list[float]:
    """The first and last angle, and those at which the direction changes by more than ``wiggle``."""
    kept = [float(angles[0])]
    for angle in angles[1:]:
        if abs(angle - kept[-1]) <= wiggle:
            continue
        if len(kept) > 1 and (angle - kept[-1]) * (kept[-1] - kept[-2]) > 0:
            kept[-1] = float(angle)
        else:
            kept.append(float(angle))
    return kept


def _stood_at(angles: Array, rests: bool) -> Array:
    """As ``_turning``, without the last if the joint does not rest there."""
    kept = _turning(angles)
    return np.array(kept if rests or len(kept) == 1 else kept[:-1])
