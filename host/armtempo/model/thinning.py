"""Fewer via points for a motion that comes as a table of many: a spline through them keeps to the table."""

from __future__ import annotations

import numpy as np
from armtempo_shared.limits import MAX_SEGMENTS
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError

LARGEST_DEG = 90.0


def thinned(points_deg: Array, tolerance_deg: float, times_s: Array | None = None) -> Array:
    """Those of the points (n, J) through which a cubic spline passes all others within ``tolerance_deg``.

    The spline is at rest at both ends, and runs over ``times_s`` (n,), increasing; without them over the square root
    of the distance between the points. First and last point are kept. Raises InputError for a tolerance that is not
    above 0 and at most LARGEST_DEG, and where more points would be left than a motion can have.
    """
    if not 0.0 < tolerance_deg <= LARGEST_DEG:
        raise InputError(
            f"a tolerance of {tolerance_deg:g} degrees is not allowed",
            f"give one above 0, at most {LARGEST_DEG:g}",
        )
    places, points = (times_s, points_deg) if times_s is not None else _centripetal(points_deg)
    kept = _enough(places, points, tolerance_deg)
    for index in kept[1:-1]:
        fewer = kept[kept != index]
        if _errors_deg(places, points, fewer).max() <= tolerance_deg:
            kept = fewer
    return points[kept]


def _enough(places: Array, points: Array, tolerance_deg: float) -> NDArray[np.int64]:
    """Indices of enough points: always the one farthest off is added."""
    kept = np.array([0, len(points) - 1])
    while (errors := _errors_deg(places, points, kept)).max() > tolerance_deg:
        kept = np.sort(np.append(kept, int(errors.argmax())))
        if len(kept) > MAX_SEGMENTS + 1:
            raise InputError(
                f"more than {MAX_SEGMENTS + 1} via points are needed to keep within {tolerance_deg:g} degrees",
                "allow more with --tolerance-deg, or cut the table into several motions",
            )
    return kept


def _errors_deg(places: Array, points: Array, kept: NDArray[np.int64]) -> Array:
    """How far off each point is from the spline through those kept, the largest of its joints: (n,)."""
    from scipy.interpolate import CubicSpline  # here, because loading it takes longer than a plan

    spline = CubicSpline(places[kept], points[kept], bc_type="clamped")
    return np.asarray(np.abs(spline(places) - points).max(axis=1))


def _centripetal(points: Array) -> tuple[Array, Array]:
    """Centripetal parameters, (m,), of those points, (m, J), that are not the same as the one before."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    moved = np.append(True, steps > 0.0)
    return np.append(0.0, np.cumsum(np.sqrt(steps[moved[1:]]))), points[moved]
