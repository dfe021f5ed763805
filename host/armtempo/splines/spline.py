"""A uniform B-spline: control points, values and derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from armtempo.basics.arguments import checked, checked_fields
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.splines import bspline

DEGREES = (3, 5)


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
        return cls(bspline.fit(points, degree), degree)

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
        pieces = bspline.derivative(bspline.polynomials(self.control_points, self.degree), order)
        powers = (at - segment)[..., None] ** np.arange(pieces.shape[1])
        return np.asarray(
            np.einsum("...p,...p->..." if pieces.ndim == 2 else "...p,...pj->...j", powers, pieces[segment])
        )
