"""The bound that multipliers prove: D of ``dual_bound``, bounded from below by Bernstein coefficients."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
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
