"""Measured peaks of speed and acceleration, compared with the limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.model.parts import Limits
from armtempo.report import replayed
from armtempo.report.analysis import SAMPLE_S, Curves, noise, of_curves, quantisation_sigma, weights
from armtempo.splines.trajectory import Trajectory

PEAK_WINDOW = 11
"""Samples over which the deviation from theory is smoothed when peaks are estimated: 1.1 s."""
TOLERANCE = 0.05
"""Tolerance above a limit, as a fraction of it: a time-optimal motion reaches its limits."""
KEPT, WITHIN = "kept", f"kept within {TOLERANCE:.0%}"
EXCEEDED, UNDECIDED, NOT_MEASURED = "exceeded", "cannot be decided at this resolution", "not measured"
_PEAK_STEP_S = 0.01


@dataclass(frozen=True)
class LimitCheck:
    """A measured peak and its limit; ``sigma`` is the peak's standard uncertainty.

    NaN for a joint without an encoder.
    """

    peak: float
    limit: float
    sigma: float

    @property
    def verdict(self) -> str:
        """KEPT, WITHIN or EXCEEDED if that holds within 3 sigma, else UNDECIDED; or NOT_MEASURED."""
        if np.isnan(self.peak):
            return NOT_MEASURED
        lowest, highest = self.peak - 3.0 * self.sigma, self.peak + 3.0 * self.sigma
        if highest <= self.limit:
            return KEPT
        if highest <= self.limit * (1.0 + TOLERANCE):
            return WITHIN
        return EXCEEDED if lowest > self.limit * (1.0 + TOLERANCE) else UNDECIDED


def limit_checks(
    found: Curves, trajectory: Trajectory, limits: Sequence[Limits], resolutions_deg: Sequence[float]
) -> list[list[LimitCheck]]:
    """``[joint]``: speed and acceleration peaks of the mean curve, with the limits.

    The peak of a noisy derivative is too high. So only the deviation from theory, which is slow, is differentiated,
    over PEAK_WINDOW samples, and theory, which is exact, is added: the sum has the arm's peak with a fraction of the
    noise. The noise is estimated from the residual of the smoothing, and is at least the rounding to
    ``resolutions_deg``, degrees per encoder count; both are averaged over the repetitions.
    """
    error = np.where(found.measured, found.mean[0] - found.theory[0], np.nan)
    ended = bool(found.path_s[-1] > trajectory.duration_s - SAMPLE_S)
    smooth = of_curves(error, SAMPLE_S, ended, PEAK_WINDOW)
    rounding = [quantisation_sigma(resolution) / np.sqrt(len(found.each)) for resolution in resolutions_deg]
    sigmas = np.fmax(rounding, _scatter(error - smooth[0]))
    times = np.arange(0.0, found.times_s[-1] + _PEAK_STEP_S / 2, _PEAK_STEP_S)
    path_s = np.interp(times, found.times_s, found.path_s)
    theory = replayed.theory(trajectory, times, path_s)
    peaks = [
        [_peak(theory[order, :, joint] + _interpolated(smooth[order, :, joint], times)) for order in (1, 2)]
        for joint in range(len(limits))
    ]
    return [
        [
            LimitCheck(
                peaks[joint][order - 1], limit.values[order - 1], noise(order, SAMPLE_S, sigma, PEAK_WINDOW)
            )
            for order in (1, 2)
        ]
        for joint, (limit, sigma) in enumerate(zip(limits, sigmas, strict=True))
    ]


def _scatter(residual: Array) -> Array:
    """Standard deviation (J,) of the noise from the residual (K, J) of the smoothing polynomials."""
    kept = 1.0 - weights(0, PEAK_WINDOW // 2, PEAK_WINDOW)[PEAK_WINDOW // 2]
    known = np.maximum(np.sum(~np.isnan(residual), axis=0), 1)
    return np.asarray(np.sqrt(np.nansum(residual**2, axis=0) / known / kept))


def _interpolated(values: Array, times_s: Array) -> Array:
    """Values (K,) of the sample grid at other times (T,); NaN next to gaps, where a one-sided window has more noise."""
    missing = np.isnan(values)
    if missing.all():
        return np.full(len(times_s), np.nan)
    beside = np.convolve(missing, np.ones(PEAK_WINDOW // 2 * 2 + 1), "same") > 0
    nearest = np.minimum(np.rint(times_s / SAMPLE_S).astype(int), len(values) - 1)
    found = np.interp(times_s, np.flatnonzero(~missing) * SAMPLE_S, values[~missing])
    return np.where(beside[nearest], np.nan, found)


def _peak(values: Array) -> float:
    """Largest magnitude of the measured values; NaN if there are none."""
    known = np.abs(values[~np.isnan(values)])
    return float(known.max()) if known.size else np.nan
