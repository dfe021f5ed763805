"""To and from other programs: a trajectory as CSV or as a ROS JointTrajectory, via points from CSV."""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.formats import number_table
from armtempo.formats.number_table import NumberTable
from armtempo.model import thinning
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan

CSV_COLUMNS = ("angle_deg", "speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3")
MAX_RATE_HZ = 100_000.0
TOLERANCE_DEG = 0.1
"""To which a sampled motion is thinned unless told otherwise."""
_TIME, _ROS = "time_s", "header:"
"""The column that tells a sampled motion from via points; how a ROS message begins."""


def times_s(duration_s: float, rate_hz: float) -> Array:
    """0, 1/rate, … and the end itself, seconds: (K,).

    Raises InputError for a rate that is not above 0 and at most MAX_RATE_HZ.
    """
    if not 0.0 < rate_hz <= MAX_RATE_HZ:
        raise InputError(
            f"a rate of {rate_hz:g} Hz is not allowed",
            f"give one above 0, at most {MAX_RATE_HZ:g} Hz",
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
    writer.writerow([_TIME, *(f"j{n}_{name}" for n in range(1, joints + 1) for name in CSV_COLUMNS)])
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


@dataclass(frozen=True)
class ImportedPath:
    """Via points (n, J) in degrees, and how many lines of the table they come from."""

    via_deg: Array
    lines: int
    thinned_to_deg: float | None = None
    """The tolerance they keep to where there were more; None where every line is a via point."""


def via_from_csv(
    path: Path, arm: Arm, radians: bool = False, tolerance_deg: float | None = None
) -> ImportedPath:
    """Via points from a table: a line a point, a column a driven joint; separated by commas, semicolons or tabs.

    A first line with a word in it is a header; where it names the joints (``joint 1``, or ``j1_angle_deg``
    as ``to_csv`` writes), the columns are found by name. One with a column ``time_s`` is a sampled motion: it is
    thinned to ``tolerance_deg``, without one to TOLERANCE_DEG; other tables only where a tolerance is given.
    Raises InputError with line and value.
    """
    table = number_table.read(path)
    columns = _columns(table, arm)
    points = np.array(table.numbers(columns)).reshape(-1, len(columns))
    if len(points) < 2:
        raise InputError(f"{path}: {len(points)} via points are no motion", "give at least 2 lines of angles")
    angles = np.degrees(points) if radians else points
    times = _times(table)
    if tolerance_deg is None and times is None:
        return ImportedPath(angles, len(points))
    tolerance = TOLERANCE_DEG if tolerance_deg is None else tolerance_deg
    return ImportedPath(thinning.thinned(angles, tolerance, times), len(points), tolerance)


def job_text(name: str, path: ImportedPath) -> str:
    """A job file through these via points, everything else as it is by default.

    Of a thinned path the joints pass the via points together, as they did in the table.
    """
    timing = "" if path.thinned_to_deg is None else 'timing = "shared"\n'
    rows = "".join(f"    [{', '.join(f'{angle:.10g}' for angle in row)}],\n" for row in path.via_deg)
    return f"name = {json.dumps(name)}\n{timing}via_deg = [\n{rows}]\n"


def _times(table: NumberTable) -> Array | None:
    """The column ``time_s``, (n,), which must increase; None where there is none."""
    if table.header is None or _TIME not in table.header:
        return None
    times = np.array(table.numbers([table.header.index(_TIME)]))[:, 0]
    for (line, _), step in zip(table.rows[1:], np.diff(times), strict=True):
        if not step > 0.0:
            raise InputError(
                f"{table.path}: line {line}: {_TIME} does not increase",
                f"put the lines in order, or leave the column {_TIME} out",
            )
    return times


def _columns(table: NumberTable, arm: Arm) -> list[int]:
    names = table.header
    if names is None:
        return list(range(len(arm.driven)))
    if names[0].startswith(_ROS):
        raise InputError(
            f"{table.path}: is a ROS message, not a table", "export the trajectory as CSV and import that"
        )
    found = []
    for number, joint in enumerate(arm.driven, 1):
        wanted = [name for name in (joint.name, f"j{number}_{CSV_COLUMNS[0]}") if name in names]
        if wanted:
            found.append(names.index(wanted[0]))
    if not found and len(names) == len(arm.driven):
        return list(range(len(names)))
    if len(found) != len(arm.driven):
        expected = ", ".join(joint.name for joint in arm.driven)
        raise InputError(
            f"{table.path}: line 1: the header does not name a column for each driven joint",
            f"name a column for each of {expected}",
        )
    return found


def _numbers(values: Array) -> str:
    return "[" + ", ".join(f"{value:.9f}" for value in values) + "]"


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"
