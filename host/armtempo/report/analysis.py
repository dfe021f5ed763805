"""Analysis of a run's samples: mean and scatter over repetitions, deviation from theory, lag."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from armtempo_shared.limits import SAMPLE_TICKS, TICK_HZ
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.report import replayed
from armtempo.report.run_folder import COMPLETE
from armtempo.report.run_reader import RepetitionData
from armtempo.splines.trajectory import Trajectory

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


SAMPLE_S = SAMPLE_TICKS / TICK_HZ
"""Time between two samples, by the board's motion clock."""
ORDERS = ("angle", "speed", "acceleration")
_SAME_S = 1e-3
EDGE_S = 1.0
"""Length of the intervals at start and end over which the lag is estimated."""


@dataclass(frozen=True)
class Curves:
    """Angle, speed and acceleration on the common time grid.

    ``times_s`` (K,); ``each`` (R, 3, K, J): each repetition, NaN if samples are missing; each of (3, K, J):
    ``mean``, ``sem`` (standard error of the mean; NaN with one repetition), ``theory``, and ``shown``, the numerical
    derivatives of theory's angles. Deviations are from ``shown``, so that they do not contain the error of the
    differentiation. ``measured`` (J,): whether the joint has an encoder; otherwise its curves are those of the
    step pulses.
    """

    times_s: Array
    each: Array
    mean: Array
    sem: Array
    theory: Array
    shown: Array
    path_s: Array
    """(K,): the motion's own time; less than ``times_s`` if the speed was below 100 %."""
    measured: NDArray[np.bool_]


@dataclass(frozen=True)
class Deviation:
    """Deviation of the mean curve from ``Curves.shown``, of one joint and one of ORDERS."""

    rms: float
    largest: float


def curves(repetitions: Sequence[RepetitionData], trajectory: Trajectory) -> Curves:
    """Mean, scatter and theory of the repetitions of one trajectory.

    Theory is the plan at the speed of the repetition that went furthest; those at another speed are left out.
    Raises ValueError if there is no sample.
    """
    count = max((_grid_size(repetition) for repetition in repetitions), default=0)
    if count == 0:
        raise ValueError("no samples to analyse")
    times: Array = np.arange(count, dtype=np.float64) * SAMPLE_S
    measured = np.any([~np.isnan(one.angle_deg).all(axis=0) for one in repetitions], axis=0)
    paths = [replayed.path_times(one, times) for one in repetitions]
    path_s = max(paths, key=lambda path: float(path[-1]))
    each = np.stack(
        [
            of_curves(_on_grid(one, count, measured), SAMPLE_S, one.state == COMPLETE)
            for one, path in zip(repetitions, paths, strict=True)
            if _same_speed(one, path, path_s)
        ]
    )
    theory: Array = replayed.theory(trajectory, times, path_s)
    shown = of_curves(theory[0], SAMPLE_S, ended=True)
    present = np.sum(~np.isnan(each), axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean: Array = np.nansum(each, axis=0) / present
        spread = np.sqrt(np.nansum((each - mean) ** 2, axis=0) / (present - 1))
        sem: Array = np.where(present > 1, spread / np.sqrt(present), np.nan)
    return Curves(times, each, mean, sem, theory, shown, path_s, measured)


def has_grid(repetition: RepetitionData) -> bool:
    """Whether it has samples that ``curves`` can use."""
    return _grid_size(repetition) > 0


def deviations(found: Curves) -> list[list[Deviation]]:
    """``[order][joint]``: the deviation of the mean curve from theory."""
    error = found.mean - found.shown
    return [[_deviation(error[order, :, joint]) for joint in range(error.shape[2])] for order in range(3)]


def final_errors(repetition: RepetitionData, trajectory: Trajectory) -> Array:
    """Measured minus planned angle (J,) at the last sample, in degrees."""
    planned: Array = trajectory(repetition.path_s[-1], 0)
    return np.asarray(repetition.angle_deg[-1] - planned)


def lags_s(found: Curves, trajectory: Trajectory) -> Array:
    """Lag of the mean speed, seconds: (2, J), over the first and the last EDGE_S.

    The least-squares time shift to first order; positive: the arm is late.
    """
    ends = np.array([spline.duration_s for spline in trajectory.joints])
    lags = np.full((2, len(ends)), np.nan)
    for joint, end in enumerate(ends):
        for row, (low, high) in enumerate(((0.0, EDGE_S), (end - EDGE_S, end))):
            inside = (found.path_s >= low) & (found.path_s <= high) & ~np.isnan(found.mean[1, :, joint])
            slope = found.theory[2, inside, joint]
            error = found.mean[1, inside, joint] - found.shown[1, inside, joint]
            if slope @ slope > 0.0:
                lags[row, joint] = -(error @ slope) / (slope @ slope)
    return lags


def _same_speed(repetition: RepetitionData, path_s: Array, reference_s: Array) -> bool:
    """Whether a repetition has the speed of another, for as long as it has samples."""
    known = _indices(repetition)
    known = known[known >= 0]
    return bool(np.all(np.abs(path_s[known] - reference_s[known]) < _SAME_S))


def _deviation(error: Array) -> Deviation:
    known = error[~np.isnan(error)]
    if not len(known):
        return Deviation(np.nan, np.nan)
    return Deviation(float(np.sqrt(np.mean(known**2))), float(np.abs(known).max()))


def _indices(repetition: RepetitionData) -> NDArray[np.int64]:
    """Index of each sample on the 0.1 s grid; -1 for the last one, which is not on it."""
    place = repetition.time_s / SAMPLE_S
    index = np.rint(place).astype(np.int64)
    return np.where(np.abs(place - index) < 1e-3, index, -1)


def _grid_size(repetition: RepetitionData) -> int:
    return int(_indices(repetition).max(initial=-1)) + 1


def _on_grid(repetition: RepetitionData, count: int, measured: NDArray[np.bool_]) -> Array:
    """Angles (count, J), measured or else commanded; NaN if a sample is missing."""
    index = _indices(repetition)
    angles = np.where(measured, repetition.angle_deg, repetition.commanded_deg)
    grid = np.full((count, angles.shape[1]), np.nan)
    grid[index[index >= 0]] = angles[index >= 0]
    return grid
