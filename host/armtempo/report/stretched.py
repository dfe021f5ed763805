"""Runs at another speed than planned: theory over real time, by the motion's own time of the samples."""

from __future__ import annotations

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.report.run_reader import RepetitionData
from armtempo.splines.trajectory import Trajectory

_EQUAL_S = 1e-6
"""Times that differ by less are the same: a tick is 12 ns."""
_SHORT_S = 0.01
NOTE = "of the planned speed"
"""In every text of ``note``."""


def is_stretched(repetition: RepetitionData) -> bool:
    """Whether the motion's own time ever was slower than the clock."""
    return bool(np.any(np.abs(repetition.time_s - repetition.path_s) > _EQUAL_S))


def path_times(repetition: RepetitionData, times_s: Array) -> Array:
    """The motion's own time (K,) at real times (K,); between samples and after the last by straight lines."""
    if len(repetition.time_s) < 2 or not is_stretched(repetition):
        return times_s
    inside = np.interp(times_s, repetition.time_s, repetition.path_s)
    return np.where(times_s > repetition.time_s[-1], repetition.path_s[-1], inside)


def theory(trajectory: Trajectory, times_s: Array, path_s: Array) -> Array:
    """Angle, speed and acceleration of a trajectory over real time, (3, K, J).

    ``path_s`` (K,): the motion's own time at the evenly spaced ``times_s`` (K,). By the chain rule; its rate and
    the change of that by differences.
    """
    orders = [trajectory(path_s, order) for order in range(3)]
    if len(times_s) > 1 and np.any(np.abs(path_s - times_s) > _EQUAL_S):
        rate = np.gradient(path_s, times_s)[:, None]
        change = np.gradient(rate[:, 0], times_s)[:, None]
        orders = [orders[0], orders[1] * rate, orders[2] * rate**2 + orders[1] * change]
    return np.stack(orders)


def note(repetition: RepetitionData) -> str:
    """At what speed a repetition ran, in words; "" for the planned one."""
    if not is_stretched(repetition):
        return ""
    passed_s = np.diff(repetition.time_s)
    whole = passed_s > _SHORT_S  # the last sample may come right after another
    rates = 100 * np.diff(repetition.path_s)[whole] / passed_s[whole]
    low, high = round(float(rates.min()), 1), round(float(rates.max()), 1)
    speed = f"at {high:g} %" if high - low < 1.0 else f"between {low:g} and {high:g} %"
    return f"{repetition.file}: ran {speed} {NOTE}; it is checked against the plan at that speed"
