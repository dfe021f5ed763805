"""To and from other programs: a trajectory as CSV or as a ROS JointTrajectory, via points from CSV."""

from __future__ import annotations

import csv
import io
import json
import math
from pathlib import Path

import numpy as np

from armtempo.arrays import Array
from armtempo.errors import InputError
from armtempo.formats.atomic_file import why
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan

CSV_COLUMNS = ("angle_deg", "speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3")
MAX_RATE_HZ = 100_000.0


def times_s(duration_s: float, rate_hz: float) -> Array:
    """0, 1/rate, … and the end itself, seconds: (K,).

    Raises InputError for a rate that is not above 0 and at most MAX_RATE_HZ.
    """
    if not 0.0 < rate_hz <= MAX_RATE_HZ:
        raise InputError(
            f"a rate of {rate_hz:g} Hz is not allowed; it must be above 0, at most {MAX_RATE_HZ:g}"
        )
    count = max(math.ceil(duration_s * rate_hz - 1e-9), 1)
    return np.append(np.arange(count) / rate_hz, duration_s)


def to_csv(plan: Plan, rate_hz: float) -> str:
    """One line a time: ``time_s``, then ``jN_`` with each of CSV_COLUMNS for every driven joint N."""
    times = times_s(plan.trajectory.duration_s, rate_hz)
    orders = np.stack([plan.trajectory(times, order) for order in range(len(CSV_COLUMNS))], axis=-1)
    joints = orders.shape[1]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time_s", *(f"j{n}_{name}" for n in range(1, joints + 1) for name in CSV_COLUMNS)])
    for time, values in zip(times, orders.reshape(len(times), -1), strict=True):
        writer.writerow([f"{time:.9f}", *(f"{value:.9g}" for value in values)])
    return text.getvalue()


def to_ros(plan: Plan, rate_hz: float, frame_id: str = "") -> str:
    """A trajectory_msgs/JointTrajectory message in YAML, radians, as ``ros2 topic pub`` reads it."""
    times = times_s(plan.trajectory.duration_s, rate_hz)
    angle, speed, acceleration = (np.radians(plan.trajectory(times, order)) for order in range(3))
    lines = [
        "header:",
        "  stamp: {sec: 0, nanosec: 0}",
        f"  frame_id: {_quoted(frame_id)}",
        f"joint_names: [{', '.join(_quoted(joint.name) for joint in plan.arm.driven)}]",
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


def via_from_csv(path: Path, arm: Arm, radians: bool = False) -> Array:
    """Via points (n, J) in degrees from a CSV file: a line a point, a column a driven joint.

    A first line with a word in it is a header; where it names the joints (``joint 1``, or ``j1_angle_deg``
    as ``to_csv`` writes), the columns are found by name. Raises InputError with line and value.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = [
                (number, row) for number, row in enumerate(csv.reader(file), 1) if any(map(str.strip, row))
            ]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read: {why(error)}") from None
    columns = list(range(len(arm.driven)))
    if rows and not all(map(_is_float, rows[0][1])):
        columns = _columns(path, rows.pop(0)[1], arm)
    points = np.array([_point(path, number, row, columns) for number, row in rows]).reshape(-1, len(columns))
    if len(points) < 2:
        raise InputError(f"{path}: {len(points)} via points; a motion needs at least 2")
    return np.degrees(points) if radians else points


def job_text(name: str, via_deg: Array) -> str:
    """A job file through these via points, everything else as it is by default."""
    rows = "".join(f"    [{', '.join(f'{angle:.10g}' for angle in row)}],\n" for row in via_deg)
    return f"name = {json.dumps(name)}\nvia_deg = [\n{rows}]\n"


def _columns(path: Path, header: list[str], arm: Arm) -> list[int]:
    names = [name.strip() for name in header]
    found = []
    for number, joint in enumerate(arm.driven, 1):
        wanted = [name for name in (joint.name, f"j{number}_angle_deg") if name in names]
        if wanted:
            found.append(names.index(wanted[0]))
    if not found and len(names) == len(arm.driven):
        return list(range(len(names)))
    if len(found) != len(arm.driven):
        expected = ", ".join(joint.name for joint in arm.driven)
        raise InputError(f"{path}: line 1: the header must name a column for each of {expected}")
    return found


def _point(path: Path, number: int, row: list[str], columns: list[int]) -> list[float]:
    if len(row) <= max(columns):
        raise InputError(f"{path}: line {number}: {len(row)} values; at least {max(columns) + 1} are needed")
    for column in columns:
        if not _is_number(row[column]):
            raise InputError(f"{path}: line {number}: {row[column]!r} is not a finite number")
    return [float(row[column]) for column in columns]


def _is_number(text: str) -> bool:
    return _is_float(text) and math.isfinite(float(text))


def _is_float(text: str) -> bool:
    """Whether ``text`` is a number, finite or not."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def _numbers(values: Array) -> str:
    return "[" + ", ".join(f"{value:.9f}" for value in values) + "]"


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"
