"""Ramps of the rate of a motion's own time, by SciPy's splines: what the board's law is compared with."""

from __future__ import annotations

import numpy as np
from armtempo_shared.motion import EVEN_RAMP, RAMP_SHAPES, RAMP_WAYS
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline, make_interp_spline


def rise(shape: int = EVEN_RAMP) -> BSpline:
    """S of one of RAMP_SHAPES: its slope is linear between 0, p/16, q/16 and 1, its integral from 0 to 1 is given."""
    ends, way = RAMP_SHAPES[shape], RAMP_WAYS[shape]
    places = np.array([0, ends & 15, ends >> 4, 16]) / 16
    hats = np.array([places[2], 1 - places[1]]) / 2  # S(1) and e(1) by the slopes at p and q
    ways = hats * (1 - np.array([sum(places[:3]), sum(places[1:])]) / 3)
    return make_interp_spline(
        places, [0, *np.linalg.solve([hats, ways], [1, way / 64]), 0], k=1
    ).antiderivative()


def rate(x: ArrayLike, before: float, after: float, shape: int = EVEN_RAMP) -> NDArray[np.float64]:
    """The rate at parts x of a ramp."""
    x = np.asarray(x)
    return np.asarray(
        before + (after - before) * (rise(shape)(x) if after > before else 1 - rise(shape)(1 - x))
    )


def passed(x: ArrayLike, before: float, after: float, shape: int = EVEN_RAMP) -> NDArray[np.float64]:
    """The motion's time from the beginning of a ramp to parts x of it, in ramp lengths."""
    x, way = np.asarray(x), rise(shape).antiderivative()
    change = abs(after - before)
    return np.asarray(
        before * x + change * way(x) if after > before else after * x + change * (way(1) - way(1 - x))
    )
