"""A trajectory as CSV or as a ROS JointTrajectory."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.splines.trajectory import Trajectory

CSV_COLUMNS = ("angle_deg", "speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3")
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


def to_csv(trajectory: Trajectory, rate_hz: float) -> str:
    """CSV with one line per time: ``time_s``, then ``jN_`` with each of CSV_COLUMNS for every driven joint N."""
    times = times_s(trajectory.duration_s, rate_hz)
    orders = np.stack([trajectory(times, order) for order in range(len(CSV_COLUMNS))], axis=-1)
    joints = orders.shape[1]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([TIME_COLUMN, *(f"j{n}_{name}" for n in range(1, joints + 1) for name in CSV_COLUMNS)])
    for time, values in zip(times, orders.reshape(len(times), -1), strict=True):
        writer.writerow([repr(value) for value in (float(time), *values.tolist())])
    return text.getvalue()


def to_ros(trajectory: Trajectory, joints: Sequence[str], rate_hz: float, frame_id: str = "") -> str:
    """A trajectory_msgs/JointTrajectory message in YAML, radians, as ``ros2 topic pub`` reads it."""
    times = times_s(trajectory.duration_s, rate_hz)
    angle, speed, acceleration = (np.radians(trajectory(times, order)) for order in range(3))
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
