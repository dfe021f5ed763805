"""Via points from a table of another program: CSV; fewer, on a spline that keeps to the table, if it has many."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
from armtempo_shared.limits import MAX_SEGMENTS
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.basics.number_table import NumberTable
from armtempo.model.arm import Arm
from armtempo.model.exchange import CSV_COLUMNS, TIME_COLUMN

TOLERANCE_DEG = 0.1
"""Default tolerance for thinning a sampled motion."""
_ROS = "header:"
"""Beginning of a ROS message."""
LARGEST_DEG = 90.0


@dataclass(frozen=True)
class ImportedPath:
    """Via points (n, J) in degrees, and the number of lines of their table."""

    via_deg: Array
    lines: int
    thinned_to_deg: float | None = None
    """The tolerance of the thinning; None if every line is a via point."""


def via_points(
    table: NumberTable, arm: Arm, radians: bool = False, tolerance_deg: float | None = None
) -> ImportedPath:
    """Via points from a table: one line per point, one column per driven joint.

    A first line with a word is a header; if it names the joints (``joint 1``, or ``j1_angle_deg`` as
    ``exchange.to_csv`` writes), the columns are found by name. A table with ``time_s`` is a sampled motion,
    thinned to ``tolerance_deg`` (default TOLERANCE_DEG); other tables are only thinned if a tolerance is
    given. Raises InputError with line and value.
    """
    columns = _columns(table, arm)
    points = np.array(table.numbers(columns)).reshape(-1, len(columns))
    if len(points) < 2:
        raise InputError(
            f"{table.path}: {len(points)} via points are not a motion", "give at least 2 lines of angles"
        )
    angles = np.degrees(points) if radians else points
    times = _times(table)
    if tolerance_deg is None and times is None:
        return ImportedPath(angles, len(points))
    tolerance = TOLERANCE_DEG if tolerance_deg is None else tolerance_deg
    return ImportedPath(thinned(angles, tolerance, times), len(points), tolerance)


def job_text(name: str, path: ImportedPath) -> str:
    """The text of a job file through these via points, with default settings.

    A thinned path gets shared timing, as its joints pass the points together.
    """
    timing = "" if path.thinned_to_deg is None else 'timing = "shared"\n'
    rows = "".join(f"    [{', '.join(f'{angle:.10g}' for angle in row)}],\n" for row in path.via_deg)
    return f"name = {json.dumps(name)}\n{timing}via_deg = [\n{rows}]\n"


def _times(table: NumberTable) -> Array | None:
    """The column ``time_s``, (n,), which must increase; None if there is none."""
    if table.header is None or TIME_COLUMN not in table.header:
        return None
    times = np.array(table.numbers([table.header.index(TIME_COLUMN)]))[:, 0]
    for (line, _), step in zip(table.rows[1:], np.diff(times), strict=True):
        if not step > 0.0:
            raise InputError(
                f"{table.path}: line {line}: {TIME_COLUMN} does not increase",
                f"put the lines in order, or leave the column {TIME_COLUMN} out",
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


def thinned(points_deg: Array, tolerance_deg: float, times_s: Array | None = None) -> Array:
    """A subset of the points (n, J) such that a cubic spline through it passes all others within ``tolerance_deg``.

    The spline rests at both ends. Its parameter is ``times_s`` (n,), increasing, else the square root of the
    distance between points. The first and the last point are kept. Raises InputError for a tolerance outside
    (0, LARGEST_DEG], and if more points are needed than a motion can have.
    """
    if not 0.0 < tolerance_deg <= LARGEST_DEG:
        raise InputError(
            f"a tolerance of {tolerance_deg:g} degrees is not allowed",
            f"give one above 0, at most {LARGEST_DEG:g}",
        )
    places, points = (times_s, points_deg) if times_s is not None else _centripetal(points_deg)
    kept = _enough(places, points, tolerance_deg)
    for index in kept[1:-1]:
        fewer = kept[kept != index]
        if _errors_deg(places, points, fewer).max() <= tolerance_deg:
            kept = fewer
    return points[kept]


def _enough(places: Array, points: Array, tolerance_deg: float) -> NDArray[np.int64]:
    """Indices of enough points; each step adds the point with the largest error."""
    kept = np.array([0, len(points) - 1])
    while (errors := _errors_deg(places, points, kept)).max() > tolerance_deg:
        kept = np.sort(np.append(kept, int(errors.argmax())))
        if len(kept) > MAX_SEGMENTS + 1:
            raise InputError(
                f"more than {MAX_SEGMENTS + 1} via points are needed to keep within {tolerance_deg:g} degrees",
                "allow more with --tolerance-deg, or cut the table into several motions",
            )
    return kept


def _errors_deg(places: Array, points: Array, kept: NDArray[np.int64]) -> Array:
    """Distance of each point from the spline through the kept points, the largest over its joints: (n,)."""
    from scipy.interpolate import CubicSpline  # imported here, because that takes longer than a plan

    spline = CubicSpline(places[kept], points[kept], bc_type="clamped")
    return np.asarray(np.abs(spline(places) - points).max(axis=1))


def _centripetal(points: Array) -> tuple[Array, Array]:
    """Centripetal parameters, (m,), and the points, (m, J), without repeated ones."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    moved = np.append(True, steps > 0.0)
    return np.append(0.0, np.cumsum(np.sqrt(steps[moved[1:]]))), points[moved]
