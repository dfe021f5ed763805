"""What the samples of a run say: mean and scatter over repetitions, deviation from theory, limits, lag."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from armtempo_shared.limits import SAMPLE_TICKS, TICK_HZ
from numpy.typing import NDArray

from armtempo.arrays import Array
from armtempo.model.arm import Limits
from armtempo.runs.differentiation import WINDOW, derivative, noise, quantisation_sigma
from armtempo.runs.reader import RepetitionData
from armtempo.runs.run_folder import COMPLETE
from armtempo.splines.trajectory import Trajectory

SAMPLE_S = SAMPLE_TICKS / TICK_HZ
"""Time between two samples, by the board's motion clock."""
ORDERS = ("angle", "speed", "acceleration")
EDGE_S = 1.0
"""Length of the intervals at start and end over which the lag is estimated."""


@dataclass(frozen=True)
class Curves:
    """Angle, speed and acceleration on the common time grid.

    ``times_s`` (K,); ``each`` (R, 3, K, J) for every repetition, NaN where samples are missing; ``mean``,
    ``sem`` (standard error of the mean; NaN with one repetition), ``theory``, and ``shown``, what the same
    differentiation shows of theory's angles, each (3, K, J). Deviations are taken from ``shown``, so that
    they show the arm's errors and not those of the differentiation.
    """

    times_s: Array
    each: Array
    mean: Array
    sem: Array
    theory: Array
    shown: Array


@dataclass(frozen=True)
class Deviation:
    """Mean curve against theory as differentiation shows it, for one joint and one of ORDERS."""

    rms: float
    largest: float


@dataclass(frozen=True)
class LimitCheck:
    """A measured peak beside its limit; ``sigma`` is the peak's uncertainty from encoder rounding.

    NaN for a joint without an encoder.
    """

    peak: float
    limit: float
    sigma: float

    @property
    def verdict(self) -> str:
        """``"kept"``, ``"kept within uncertainty"`` (3 sigma), ``"exceeded"``, or ``"not measured"``."""
        if np.isnan(self.peak):
            return "not measured"
        if self.peak <= self.limit:
            return "kept"
        return "kept within uncertainty" if self.peak <= self.limit + 3.0 * self.sigma else "exceeded"


def curves(repetitions: Sequence[RepetitionData], trajectory: Trajectory) -> Curves:
    """Mean, scatter and theory of the repetitions of one trajectory.

    Raises ValueError where there is no sample at all.
    """
    count = max((_grid_size(repetition) for repetition in repetitions), default=0)
    if count == 0:
        raise ValueError("no samples to analyse")
    times: Array = np.arange(count, dtype=np.float64) * SAMPLE_S
    each = np.stack([_differentiated(_on_grid(one, count), one.state == COMPLETE) for one in repetitions])
    theory: Array = np.stack([trajectory(times, order) for order in range(3)])
    shown = _differentiated(theory[0], ended=True)
    present = np.sum(~np.isnan(each), axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean: Array = np.nansum(each, axis=0) / present
        spread = np.sqrt(np.nansum((each - mean) ** 2, axis=0) / (present - 1))
        sem: Array = np.where(present > 1, spread / np.sqrt(present), np.nan)
    return Curves(times, each, mean, sem, theory, shown)


def deviations(found: Curves) -> list[list[Deviation]]:
    """``[order][joint]``: how far the mean curve is from theory."""
    error = found.mean - found.shown
    return [[_deviation(error[order, :, joint]) for joint in range(error.shape[2])] for order in range(3)]


def final_errors(repetition: RepetitionData, trajectory: Trajectory) -> Array:
    """Measured minus planned angle (J,) at the last sample, in degrees."""
    planned: Array = trajectory(repetition.time_s[-1], 0)
    return np.asarray(repetition.angle_deg[-1] - planned)


def limit_checks(
    found: Curves, limits: Sequence[Limits], resolutions_deg: Sequence[float]
) -> list[list[LimitCheck]]:
    """``[joint]``: speed and acceleration peaks of the mean curve beside the limits.

    ``resolutions_deg``: degrees per encoder count; its rounding, averaged over the repetitions that are
    there, gives the uncertainty.
    """
    runs = len(found.each)
    checks = []
    for joint, (limit, resolution) in enumerate(zip(limits, resolutions_deg, strict=True)):
        sigma = quantisation_sigma(resolution) / np.sqrt(runs)
        allowed = (limit.speed_deg_s, limit.acceleration_deg_s2)
        checks.append(
            [
                LimitCheck(
                    _peak(found.mean[order, :, joint]),
                    allowed[order - 1],
                    noise(order, SAMPLE_S, float(sigma)),
                )
                for order in (1, 2)
            ]
        )
    return checks


def lags_s(found: Curves, trajectory: Trajectory) -> Array:
    """How far the mean speed lags behind theory, in seconds: (2, J), over the first and the last EDGE_S.

    The shift that fits best in the sense of least squares, to first order: positive is late.
    """
    ends = np.array([spline.duration_s for spline in trajectory.joints])
    lags = np.full((2, len(ends)), np.nan)
    for joint, end in enumerate(ends):
        for row, (low, high) in enumerate(((0.0, EDGE_S), (end - EDGE_S, end))):
            inside = (found.times_s >= low) & (found.times_s <= high) & ~np.isnan(found.mean[1, :, joint])
            slope = found.theory[2, inside, joint]
            error = found.mean[1, inside, joint] - found.shown[1, inside, joint]
            if slope @ slope > 0.0:
                lags[row, joint] = -(error @ slope) / (slope @ slope)
    return lags


def _peak(values: Array) -> float:
    """Largest magnitude of the measured values; NaN where there are none."""
    known = np.abs(values[~np.isnan(values)])
    return float(known.max()) if known.size else np.nan


def _deviation(error: Array) -> Deviation:
    known = error[~np.isnan(error)]
    if not len(known):
        return Deviation(np.nan, np.nan)
    return Deviation(float(np.sqrt(np.mean(known**2))), float(np.abs(known).max()))


def _indices(repetition: RepetitionData) -> NDArray[np.int64]:
    """Index of each sample on the 0.1 s grid; -1 for the one at the end, which falls between."""
    place = repetition.time_s / SAMPLE_S
    index = np.rint(place).astype(np.int64)
    return np.where(np.abs(place - index) < 1e-3, index, -1)


def _grid_size(repetition: RepetitionData) -> int:
    return int(_indices(repetition).max(initial=-1)) + 1


def _on_grid(repetition: RepetitionData, count: int) -> Array:
    """Measured angles (count, J), NaN where a sample is missing."""
    index = _indices(repetition)
    grid = np.full((count, repetition.angle_deg.shape[1]), np.nan)
    grid[index[index >= 0]] = repetition.angle_deg[index >= 0]
    return grid


def _differentiated(angles: Array, ended: bool) -> Array:
    """(3, K, J): angle, speed, acceleration; each interval without a gap by itself.

    The arm rests before a motion and after one that ``ended``, so there the window is filled with the angle at rest.
    """
    result = np.full((3, *angles.shape), np.nan)
    result[0] = angles
    for joint in range(angles.shape[1]):
        known = ~np.isnan(angles[:, joint])
        edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False]))))
        for start, stop in edges.reshape(-1, 2):
            before = WINDOW // 2 if start == 0 else 0
            after = WINDOW // 2 if stop == len(angles) and ended else 0
            padded = np.pad(angles[start:stop, joint], (before, after), mode="edge")
            for order in (1, 2):
                found = derivative(padded, SAMPLE_S, order)
                result[order, start:stop, joint] = found[before : len(found) - after]
    return result
