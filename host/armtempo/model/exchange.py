"""A trajectory as CSV or as a ROS JointTrajectory."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model.joint_unit import DEG, JointUnit
from armtempo.splines.trajectory import Trajectory

CSV_COLUMNS = ("angle_deg", "speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3")
SLIDING_COLUMNS = ("position_mm", "speed_mm_s", "acceleration_mm_s2", "jerk_mm_s3")
"""The same of a sliding joint."""
_MM = 1000.0
"""In a metre."""
MAX_RATE_HZ = 100_000.0
TIME_COLUMN = "time_s"
_LEAST_GAP = 0.01
"""Least time between the last two points, of a period: 100 ns at the highest rate, which no stamp rounds off."""


def times_s(duration_s: float, rate_hz: float) -> Array:
    """0, 1/rate, … and the end of the motion, seconds: (K,).

    Raises InputError for a rate of 0 or less, or above MAX_RATE_HZ.
    """
    if not 0.0 < rate_hz <= MAX_RATE_HZ:
        raise InputError(
            f"a rate of {rate_hz:g} Hz is not allowed",
            f"give one above 0, at most {MAX_RATE_HZ:g} Hz",
        )
    count = max(math.ceil(duration_s * rate_hz - _LEAST_GAP), 1)
    return np.append(np.arange(count) / rate_hz, duration_s)


def columns(unit: JointUnit) -> tuple[str, ...]:
    """Those of a joint, after its number."""
    return CSV_COLUMNS if unit is DEG else SLIDING_COLUMNS


def from_si(values: ArrayLike, units: Sequence[JointUnit]) -> Array:
    """Positions or their derivatives (..., J) in the joints' units, from those in rad and m, as ROS has them."""
    given = np.asarray(values, dtype=float)
    return np.where([unit is DEG for unit in units], np.degrees(given), _MM * given)


def to_si(values: ArrayLike, units: Sequence[JointUnit]) -> Array:
    """The inverse of ``from_si``."""
    given = np.asarray(values, dtype=float)
    return np.where([unit is DEG for unit in units], np.radians(given), given / _MM)


def to_csv(trajectory: Trajectory, units: Sequence[JointUnit], rate_hz: float) -> str:
    """CSV with one line per time: ``time_s``, then ``jN_`` with each of ``columns`` for every driven joint N."""
    times = times_s(trajectory.duration_s, rate_hz)
    orders = np.stack([trajectory(times, order) for order in range(len(CSV_COLUMNS))], axis=-1)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = [f"j{n}_{name}" for n, unit in enumerate(units, 1) for name in columns(unit)]
    writer.writerow([TIME_COLUMN, *names])
    for time, values in zip(times, orders.reshape(len(times), -1), strict=True):
        writer.writerow([repr(value) for value in (float(time), *values.tolist())])
    return text.getvalue()


def to_ros(
    trajectory: Trajectory,
    joints: Sequence[str],
    units: Sequence[JointUnit],
    rate_hz: float,
    frame_id: str = "",
) -> str:
    """A trajectory_msgs/JointTrajectory message in YAML, radians and metres, as ``ros2 topic pub`` reads it."""
    times = times_s(trajectory.duration_s, rate_hz)
    angle, speed, acceleration = (to_si(trajectory(times, order), units) for order in range(3))
    lines = [
        "header:",
        "  stamp: {sec: 0, nanosec: 0}",
        f"  frame_id: {_quoted(frame_id)}",
        f"joint_names: [{', '.join(_quoted(name) for name in joints)}]",
        "points:",
    ]
    for index, time in enumerate(times):
        seconds, nanoseconds = divmod(round(time * 1e9), 10**9)
        lines += [
            f"- positions: {_numbers(angle[index])}",
            f"  velocities: {_numbers(speed[index])}",
            f"  accelerations: {_numbers(acceleration[index])}",
            "  effort: []",
            f"  time_from_start: {{sec: {seconds}, nanosec: {nanoseconds}}}",
        ]
    return "\n".join(lines) + "\n"


def _numbers(values: Array) -> str:
    return "[" + ", ".join(map(repr, values.tolist())) + "]"


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"
