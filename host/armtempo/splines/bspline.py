"""Uniform B-splines: interpolation of points (Eqs. 13 and 14), polynomials (Eq. 15), and a spline as an object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import comb

import numpy as np
from armtempo_shared.basis import BASIS, FACTORIAL
from numpy.typing import ArrayLike, NDArray

from armtempo.basics.arguments import checked, checked_fields
from armtempo.basics.arrays import Array as Array
from armtempo.basics.errors import InputError

_REST_ROWS: dict[int, tuple[tuple[float, ...], ...]] = {
    3: ((-1, 0, 1),),
    5: ((1, 2, -6, 2, 1), (-1, -10, 0, 10, 1)),
}
"""Rows of the derivatives that are 0 at rest: the first of the cubic; the second and the first of the quintic."""
DEGREES = (3, 5)
REST_PIECES = 8
"""Segments between two via points of a spline that rests at some of them."""


@cache
def basis(degree: int) -> Array:
    """The matrix of Eq. (15), (degree + 1, degree + 1); rows: powers of u, columns: control points.

    Raises InputError for a degree other than 3 or 5.
    """
    if degree not in BASIS:
        raise InputError(f"a spline of degree {degree} is not supported", "choose 3 (cubic) or 5 (quintic)")
    matrix = np.array(BASIS[degree], dtype=float) / FACTORIAL[degree]
    matrix.setflags(write=False)
    return matrix


def fit(points_deg: ArrayLike, degree: int, rests: Sequence[int] = ()) -> Array:
    """Control points of the spline through ``points_deg`` that starts and ends at rest.

    ``points_deg``: (n + 1,) or (n + 1, J). Returns (n + degree,) or (n + degree, J) by Eq. (13) or (14), solved
    with a full matrix, as importing scipy's banded solver takes longer than most commands. At rest the speed is 0,
    of the quintic also the acceleration. A quintic is also at rest at the points ``rests``, with any direction
    afterwards, and then only passes near the two points before and after each; ``rests`` must be at least
    ``degree`` points apart and from the ends. Raises InputError for fewer than two points or values that are not
    finite.
    """
    points = np.asarray(points_deg, dtype=float)
    row = basis(degree)[0, :-1]
    if len(points) < 2 or not np.all(np.isfinite(points)):
        raise InputError(
            "a spline through fewer than two points, or through a point that is not finite",
            "give at least two points, all of them finite",
        )
    edge = (degree - 1) // 2
    right = np.zeros((len(points) + degree - 1, *points.shape[1:]))
    right[edge : edge + len(points)] = points
    for rest in rests:
        right[rest : rest + degree] = points[rest]
    return np.asarray(np.linalg.solve(_matrix(len(right), row, degree, rests), right))


def _matrix(size: int, row: Array, degree: int, rests: Sequence[int]) -> Array:
    """The matrix of Eq. (13) or (14), (size, size)."""
    edge = (degree - 1) // 2
    matrix = np.zeros((size, size))
    for at, rest in enumerate(_REST_ROWS[degree]):
        matrix[at, :degree] = rest
        matrix[size - 1 - at, size - degree :] = rest
    for at in range(edge, size - edge):
        matrix[at, at - edge : at - edge + degree] = row
    for first in rests:
        matrix[first : first + degree] = np.eye(degree, size, first)
    return matrix


def polynomials(control_points: Array, degree: int) -> Array:
    """Power coefficients of each segment over u in [0, 1].

    ``control_points``: (n + degree, ...). Returns (n, degree + 1, ...).
    """
    windows = np.lib.stride_tricks.sliding_window_view(control_points, degree + 1, axis=0)
    middle = windows[..., degree // 2]
    pieces = np.einsum("pc,s...c->sp...", basis(degree), windows - middle[..., None])
    pieces[:, 0] += middle  # subtracted before, so that a small motion far from 0 keeps its precision
    return np.asarray(pieces)


def refined(control_points: Array, parts: int, degree: int) -> Array:
    """Control points of the same spline with each segment divided into ``parts``.

    ``control_points``: (n + degree, ...). Returns (n * parts + degree, ...). Method: ``degree`` + 1 moving
    sums over ``parts`` neighbours.
    """
    mask = np.full(1, float(parts))
    for _ in range(degree + 1):
        mask = np.convolve(mask, np.full(parts, 1.0 / parts))
    count = (len(control_points) - degree) * parts + degree
    spread = np.zeros((len(control_points) * parts, *control_points.shape[1:]))
    spread[::parts] = control_points
    first = degree * (parts - 1)
    full = np.apply_along_axis(np.convolve, 0, spread, mask)
    return np.asarray(full[first : first + count])


def subdivide(coefficients: Array, parts: int) -> Array:
    """The same curve with each segment divided into ``parts`` equal ones, each over [0, 1].

    ``coefficients``: (n, k + 1, ...), power basis. Returns (n * parts, k + 1, ...).
    """
    if parts == 1:
        return coefficients
    pieces = np.einsum("rpc,sc...->srp...", _shifts(coefficients.shape[1] - 1, parts), coefficients)
    return np.asarray(pieces.reshape(-1, *coefficients.shape[1:]))


@cache
def _shifts(degree: int, parts: int) -> Array:
    """Power coefficients of p((r + v) / parts) from those of p(u): (parts, degree + 1, degree + 1)."""
    matrix = np.zeros((parts, degree + 1, degree + 1))
    for part in range(parts):
        for power in range(degree + 1):
            for low in range(power + 1):
                matrix[part, low, power] = comb(power, low) * part ** (power - low) / parts**power
    return matrix


def derivative(coefficients: Array, order: int = 1) -> Array:
    """Power coefficients of the derivative with respect to u: (n, k + 1 - order, ...)."""
    for _ in range(order):
        powers = np.arange(1, coefficients.shape[1], dtype=float)
        coefficients = coefficients[:, 1:] * powers.reshape(-1, *([1] * (coefficients.ndim - 2)))
    return coefficients


def evaluate(coefficients: Array, segment: NDArray[np.intp], u: Array) -> Array:
    """Values at ``u`` in [0, 1] of the given ``segment``, arrays of the same shape; ``coefficients``: (n, k + 1)."""
    value = coefficients[segment, -1]
    for power in range(coefficients.shape[1] - 2, -1, -1):
        value = value * u + coefficients[segment, power]
    return np.asarray(value)


@checked
@checked_fields
@dataclass(frozen=True, eq=False)
class Spline:
    """A uniform B-spline of degree 3 or 5 over u from 0 to n, with n segments.

    ``control_points`` has the shape (n + degree,) or (n + degree, J).
    """

    control_points: Array
    degree: int = 5

    def __post_init__(self) -> None:
        """Raise InputError if the control points do not make a spline."""
        object.__setattr__(self, "control_points", np.asarray(self.control_points, dtype=float))
        if self.degree not in DEGREES or self.control_points.ndim not in (1, 2) or self.segments < 1:
            raise InputError(
                f"control points of shape {self.control_points.shape} do not make a spline of degree {self.degree}",
                "give more of them than the degree, which is 3 or 5; Spline.through takes points to pass",
            )

    @classmethod
    def through(cls, points: ArrayLike, degree: int = 5) -> Spline:
        """The spline through ``points``, (n + 1,) or (n + 1, J), at u = 0, 1, … n, at rest at both ends.

        At the ends the first derivative is 0, of the quintic also the second (Eqs. 13 and 14). Raises InputError for
        another degree, fewer than two points or values that are not finite.
        """
        if degree not in DEGREES or np.ndim(points) not in (1, 2):
            raise InputError(
                f"no spline of degree {degree} through an array of {np.ndim(points)} dimensions",
                "give degree 3 or 5, and points (n + 1,) or (n + 1, J)",
            )
        return cls(fit(points, degree), degree)

    @property
    def segments(self) -> int:
        """Number of polynomial pieces."""
        return len(self.control_points) - self.degree

    def __call__(self, u: ArrayLike, order: int = 0) -> Array:
        """Value at ``u``, or its derivative of the given ``order`` with respect to u.

        Returns the shape of ``u``, and (..., J) if the points have joints. Raises InputError for a u outside of
        0 to n.
        """
        if not 0 <= order <= self.degree:
            raise InputError(
                f"there is no derivative of order {order}",
                f"give 0 for the value, 1 for the slope, up to {self.degree}",
            )
        at = np.asarray(u, dtype=float)
        if not np.all((at >= 0.0) & (at <= self.segments)):
            raise InputError(
                "u is outside of the spline",
                f"a spline of {self.segments} segments is defined for u from 0 to {self.segments}",
            )
        segment = np.minimum(at.astype(np.intp), self.segments - 1)
        pieces = derivative(polynomials(self.control_points, self.degree), order)
        powers = (at - segment)[..., None] ** np.arange(pieces.shape[1])
        return np.asarray(
            np.einsum("...p,...p->..." if pieces.ndim == 2 else "...p,...pj->...j", powers, pieces[segment])
        )
