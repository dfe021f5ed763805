"""Derivatives of sampled angles by local least-squares polynomials, and their noise.

The derivative at a sample is that of the polynomial of degree ``DEGREE`` fitted to the ``WINDOW`` samples
around it (Savitzky and Golay, Anal. Chem. 36 (1964) 1627). It is exact for polynomials up to ``DEGREE``. The
window is symmetric, so there is no lag, except at the ends, where it is one-sided.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from armtempo.basics.arrays import Array

WINDOW = 5
DEGREE = 3


@cache  # a sequence has thousands of runs
def weights(order: int, at: int, window: int = WINDOW, degree: int = DEGREE) -> Array:
    """Weights (window,) of the samples for the derivative at sample ``at`` of the window, for unit spacing."""
    offsets = np.arange(window) - at
    powers = np.vander(offsets, degree + 1, increasing=True).astype(float)
    fit: Array = np.linalg.pinv(powers)[order] * math.factorial(order)
    fit.flags.writeable = False
    return fit


def derivative(values: Array, step_s: float, order: int, window: int = WINDOW) -> Array:
    """Derivative of the given order (0: smoothing) of values (M, ...) sampled every ``step_s``; same shape.

    With fewer than ``window`` samples the window shrinks; NaN if there are too few for DEGREE.
    """
    count = len(values)
    window = min(window, count)
    if window <= DEGREE:
        return np.full_like(np.asarray(values, float), np.nan)
    half = window // 2
    result = np.empty_like(np.asarray(values, float))
    for at in range(window):
        row = weights(order, at, window)
        if at == half:
            blocks = np.lib.stride_tricks.sliding_window_view(values, window, axis=0)
            result[half : half + len(blocks)] = blocks @ row
        elif at < half:
            result[at] = np.tensordot(row, values[:window], 1)
        else:
            result[count - window + at] = np.tensordot(row, values[-window:], 1)
    return result / step_s**order


def of_curves(angles: Array, step_s: float, ended: bool, window: int = 0) -> Array:
    """Angle, speed, acceleration (3, K, J) of angles (K, J); intervals between gaps (NaN) are separate.

    ``window`` 0: the angle unchanged, its derivatives over WINDOW; otherwise all three smoothed over ``window``
    samples. Beyond the start, and the end of a motion that ``ended``, the window is filled with the angle at rest.
    """
    result = np.full((3, *angles.shape), np.nan)
    if not window:
        result[0] = angles
    width = window or WINDOW
    for joint in range(angles.shape[1]):
        known = ~np.isnan(angles[:, joint])
        edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False]))))
        for start, stop in edges.reshape(-1, 2):
            before = width // 2 if start == 0 else 0
            after = width // 2 if stop == len(angles) and ended else 0
            padded = np.pad(angles[start:stop, joint], (before, after), mode="edge")
            for order in range(0 if window else 1, 3):
                found = derivative(padded, step_s, order, width)
                result[order, start:stop, joint] = found[before : len(found) - after]
    return result


def noise(order: int, step_s: float, sigma: float, window: int = WINDOW) -> float:
    """Standard deviation of the derivative (not near the ends), for white noise ``sigma`` on the samples."""
    return float(sigma * np.linalg.norm(weights(order, window // 2, window)) / step_s**order)


def quantisation_sigma(resolution: float) -> float:
    """Standard deviation of rounding to multiples of ``resolution``: resolution / sqrt(12)."""
    return resolution / math.sqrt(12.0)
