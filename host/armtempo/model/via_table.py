"""Via points from a table of another program: CSV; fewer, on a spline that keeps to the table, if it has many."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from armtempo.basics import number_table
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.basics.number_table import NumberTable
from armtempo.model import joint_trajectory, ros_bag, table_header
from armtempo.model.arm import Arm
from armtempo.model.joint_trajectory import Recorded
from armtempo.model.joint_unit import DEG, NEUTRAL
from armtempo.model.parts import DrivenJoint, Joint
from armtempo.model.table_header import Column, Header
from armtempo.model.tool_pose import BASE, WHOLE

if TYPE_CHECKING:
    from armtempo.model.thinning import JointTolerance, Tolerance

TOLERANCE_DEG = 0.1
"""Default tolerance for thinning a sampled motion."""
_RADIANS, _WIDE_DEG = 7.0, 100.0
"""Angles below this may be radians, if the joints turn further than that many degrees."""
_METRES = 2.0
"""Positions below this may be in metres."""
_SLOWEST = 0.02
"""A motion in whole seconds that is always below this part of the speed limits may have its times in milliseconds."""
_ALIKE = 2.0
"""A step of a recording is as its neighbours if it is no faster than this factor."""
_MOST_BEYOND = 0.499
"""Part of the tolerance by which points may be outside of a range, less than ``thinning`` allows."""
_SPEED_MARGIN = 1.05
"""Recordings may be faster than the limit by this factor, as their times scatter."""


@dataclass(frozen=True)
class ImportedPath:
    """The via points of a table: angles, or poses."""

    via_deg: Array
    """(n, J), degrees; (0, J) for poses."""
    lines: int
    poses: tuple[Mapping[str, Sequence[float] | float], ...] = ()
    """The keys of each pose, as in a job file."""
    thinned_to_deg: float | None = None
    """How far the planned spline is from the table at most, of turning joints; None if every line is a via point."""
    thinned_to: str = ""
    """The same in words, of sliding joints too."""
    rests_s: Mapping[int, float] = field(default_factory=dict)
    """Seconds of rest at via points, by their number from 0."""
    notes: tuple[str, ...] = ()
    """How the columns were taken, for the user."""
    neutral: bool = False
    """Whether the arm has a sliding joint, so that the keys of a job say nothing of units."""

    def key(self, name: str) -> str:
        """The key of a list of positions in a job file."""
        return NEUTRAL[name] if self.neutral else name

    @property
    def count(self) -> int:
        """Number of via points."""
        return len(self.poses) or len(self.via_deg)


def of_text(
    text: str, path: Path | str, arm: Arm, radians: bool | None = None, tolerance_deg: Tolerance | None = None
) -> ImportedPath:
    """Via points from the text of a table, as ``via_points``; ``path`` names it in messages."""
    if joint_trajectory.is_ros(text, path):
        return _of_recording(joint_trajectory.of_text(text, path, arm), path, arm, tolerance_deg)
    return via_points(number_table.of_text(text, path, table_header.UNITS), arm, radians, tolerance_deg)


def is_recording(path: Path) -> bool:
    """Whether a file is a table or a recording of ROS, by its name, or of JSON by its content."""
    if ros_bag.is_bag(path):
        return True
    if path.suffix.lower() != ".json":
        return path.suffix.lower() in (".csv", ".tsv", ".yaml", ".yml")
    try:
        return '"joint_names"' in path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return False


def _of_recording(
    found: Recorded, path: Path | str, arm: Arm, tolerance_deg: Tolerance | None
) -> ImportedPath:
    where = [f"{path}: at {time:g} s" for time in found.times_s]
    angles, notes = _unwound(found.angles_deg, found.times_s, arm, where)
    return _thinned(angles, found.times_s, arm, tolerance_deg, (*found.notes, *notes), where)


def recorded(
    path: Path, arm: Arm, radians: bool | None = None, tolerance_deg: Tolerance | None = None
) -> Recorded:
    """A motion with its times, from a table with a time or a JointTrajectory; errors as in ``read``."""
    text = "" if ros_bag.is_bag(path) else number_table.text_of(path)
    if not text or joint_trajectory.is_ros(text, path):
        found = ros_bag.read(path, arm) if not text else joint_trajectory.of_text(text, path, arm)
        where = [f"{path}: at {time:g} s" for time in found.times_s]
    else:
        table = number_table.of_text(text, path, table_header.UNITS)
        header = _header(table, arm)
        times = _times(table, header)
        if times is None or header.pose or len(times) < 2:
            raise InputError(
                f"{path}: has no times of a motion of the joints",
                "give a column time_s, and one for each joint",
            )
        _check_resting(table, header, arm, radians)
        found = Recorded(times, _angles(table, header, arm, radians), _notes(table, header, arm))
        _check_seconds(table, header, found.angles_deg, arm)
        where = [f"{path}: line {line}" for line, _ in table.rows]
    angles, notes = _unwound(found.angles_deg, found.times_s, arm, where)
    _check_ranges(where, angles, arm, _tolerance(arm, tolerance_deg))
    return Recorded(found.times_s, angles, (*found.notes, *notes))


def read(
    path: Path, arm: Arm, radians: bool | None = None, tolerance_deg: Tolerance | None = None
) -> ImportedPath:
    """Via points from a file, as ``of_text``; raises InputError if it cannot be read."""
    if ros_bag.is_bag(path):
        return _of_recording(ros_bag.read(path, arm), path, arm, tolerance_deg)
    return of_text(number_table.text_of(path), path, arm, radians, tolerance_deg)


def via_points(
    table: NumberTable, arm: Arm, radians: bool | None = None, tolerance_deg: Tolerance | None = None
) -> ImportedPath:
    """Via points from a table: one line per point, its columns as ``table_header`` describes.

    ``radians``: unit of angles whose column does not name one; None: degrees, unless all are so small that they may be
    radians, which is refused. A table with a time is a sampled motion, thinned to ``tolerance_deg`` (default
    TOLERANCE_DEG); other tables are only thinned if a tolerance is given. Raises InputError with line and value.
    """
    header = _header(table, arm)
    if len(table.rows) < 2:
        raise InputError(
            f"{table.path}: {len(table.rows)} via points are not a motion", "give at least 2 lines of angles"
        )
    if header.pose:
        return _poses(table, header, radians, tolerance_deg)
    angles = _angles(table, header, arm, radians)
    _check_resting(table, header, arm, radians)
    times, notes = _times(table, header), _notes(table, header, arm)
    where = [f"{table.path}: line {line}" for line, _ in table.rows]
    if times is not None:
        _check_seconds(table, header, angles, arm)
        angles, jumps = _unwound(angles, times, arm, where)
        notes += jumps
    if tolerance_deg is None and times is None:
        return ImportedPath(angles, len(angles), notes=notes, neutral=arm.slides)
    return _thinned(angles, times, arm, tolerance_deg, notes, where)


def _tolerance(arm: Arm, given: Tolerance | None) -> JointTolerance:
    from armtempo.model.thinning import JointTolerance  # here, as a goto reads no recording

    units = [joint.unit for joint in arm.driven]
    return JointTolerance.of(TOLERANCE_DEG if given is None else given, units)


def _thinned(
    angles: Array, times_s: Array | None, arm: Arm, tolerance_deg: Tolerance | None, notes: tuple[str, ...],
    where: Sequence[str],
) -> ImportedPath:  # fmt: skip
    from armtempo.model import thinning

    tolerance = _tolerance(arm, tolerance_deg)
    _check_ranges(where, angles, arm, tolerance, _MOST_BEYOND)
    scale = tolerance.scale
    ranges = np.array([joint.range_deg for joint in arm.driven]) / scale[:, None]
    words = DEG.word if np.any(scale != 1.0) else arm.texts.unit_words
    found = thinning.thinned(
        angles / scale,
        tolerance.one,
        times_s,
        ranges,
        words,
        lambda points: arm.transmission.steps(points * scale),
    )
    for place, left_out_s in zip(("beginning", "end"), found.left_out_s, strict=True):
        if left_out_s:
            notes += (f"{left_out_s:.3g} s of rest at the {place} are left out",)
    return ImportedPath(
        found.via_deg * scale,
        len(angles),
        thinned_to_deg=found.off_deg,
        thinned_to=tolerance.format(found.off_deg),
        rests_s=found.rests_s,
        notes=notes,
        neutral=arm.slides,
    )


def job_text(name: str, path: ImportedPath, frame: str = BASE) -> str:
    """The text of a job file through these via points, with default settings; ``frame``: that of poses.

    A thinned path is the spline through its points, with shared timing, as its joints pass them together.
    """
    timing = "" if path.thinned_to_deg is None else 'path = "through"\ntiming = "shared"\n'
    placed = "" if frame == BASE else f"frame = {json.dumps(frame)}\n"
    head = f"name = {json.dumps(name)}\n{placed}{timing}"
    if path.poses:
        return head + "".join(
            "\n[[via]]\n" + "".join(f"{key} = {_value(value)}\n" for key, value in pose.items())
            for pose in path.poses
        )
    if path.rests_s:
        return head + "".join(
            f"\n[[via]]\n{path.key('angles_deg')} = {_value(row)}\n" + _rest(path.rests_s.get(number))
            for number, row in enumerate(path.via_deg.tolist())
        )
    rows = "".join(f"    {_value(row)},\n" for row in path.via_deg.tolist())
    return f"{head}{path.key('via_deg')} = [\n{rows}]\n"


def _rest(rest_s: float | None) -> str:
    return "" if rest_s is None else f"stop = true\ndwell_s = {rest_s:.10g}\n"


def _value(value: Sequence[float] | float) -> str:
    if isinstance(value, Sequence):
        return f"[{', '.join(f'{number:.10g}' for number in value)}]"
    return f"{value:.10g}"


def _header(table: NumberTable, arm: Arm) -> Header:
    if table.header is not None:
        where = f"{table.path}: line 1"
        names = table_header.with_units(table.header, table.units or (), where)
        return table_header.read(names, arm, where)
    columns = len(table.rows[0][1]) if table.rows else len(arm.driven)
    for least in (0, 1):
        if columns > 1 and table.rows and table.rows[0][1] == [str(least + n) for n in range(columns)]:
            raise InputError(
                f"{table.path}: line {table.rows[0][0]}: {','.join(table.rows[0][1])} are the numbers of columns, or "
                "a point?",
                f"write a header in their place, or above the point: {table_header.expected(arm)}",
            )
    first = np.array(table.numbers([0]))
    rising = len(first) > 1 and bool(np.all(np.diff(first[:, 0]) > 0.0))
    return table_header.no_header(columns, arm, f"{table.path}: line 1", rising)


def _notes(table: NumberTable, header: Header, arm: Arm) -> tuple[str, ...]:
    notes = []
    if table.header is None:
        notes.append(f"no header: the columns were taken as {table_header.expected(arm)}")
    if header.unused:
        notes.append(f"columns that were not used: {', '.join(header.unused)}")
    return tuple(notes)


def _angles(table: NumberTable, header: Header, arm: Arm, radians: bool | None) -> Array:
    """The driven joints' positions, (n, J)."""
    points = np.array(table.numbers([column.index for column in header.angles]))
    for joint, column in zip(arm.driven, header.angles, strict=True):
        if joint.slides and not column.unit:
            raise InputError(
                f"{table.path}: line 1: the column of {joint.name}, which slides, does not say its unit",
                f"name it in the header: {joint.name} (mm)",
            )
    unnamed = [
        number
        for number, (joint, column) in enumerate(zip(arm.driven, header.angles, strict=True))
        if not joint.slides and not column.unit
    ]
    wide = [np.ptp(arm.driven[n].range_deg) > _WIDE_DEG and np.ptp(points[:, n]) > 0.0 for n in unnamed]
    if radians is None and any(wide):
        _check_degrees(points[:, unnamed], table, arm.driven[unnamed[0]].name)
    return np.column_stack(
        [
            _in_unit(joint, points[:, n], column, radians, table)
            for n, (joint, column) in enumerate(zip(arm.driven, header.angles, strict=True))
        ]
    )


def _check_degrees(angles: Array, table: NumberTable, name: str) -> None:
    """Refuse angles without a unit, whose first column is ``name``, that may as well be radians."""
    if (most := float(np.abs(angles).max())) < _RADIANS:
        raise InputError(
            f"{table.path}: no angle without a unit is beyond {most:.3g}: degrees or radians?",
            f"give --degrees or --radians, or name the unit in the header: {name} (rad)",
        )


def _in_unit(
    joint: Joint | DrivenJoint, values: Array, column: Column, radians: bool | None, table: NumberTable
) -> Array:
    """Positions of a joint in its unit."""
    if joint.slides:
        return values * table_header.mm(column)
    return _degrees(values, column, radians, table)


def _degrees(values: Array, column: Column, radians: bool | None, table: NumberTable) -> Array:
    own = table_header.is_radians(column)
    if own is not None and radians is not None and own != radians:
        asked = "--radians" if radians else "--degrees"
        raise InputError(
            f"{table.path}: line 1: its header has other units than {asked}", f"leave {asked} out"
        )
    return np.degrees(values) if own or (own is None and radians) else values


def _check_resting(table: NumberTable, header: Header, arm: Arm, radians: bool | None) -> None:
    """Refuse angles of joints without a motor other than their home angle."""
    for index, column in header.resting.items():
        joint = arm.joints[index]
        angles = _in_unit(joint, np.array(table.numbers([column.index]))[:, 0], column, radians, table)
        for (line, _), angle in zip(table.rows, angles, strict=True):
            if abs(angle - joint.home_deg) > table_header.RESTS_DEG:
                raise InputError(
                    f"{table.path}: line {line}: {joint.name} at {angle:g} {joint.unit.word} has no motor, it stays at "
                    f"{joint.home_deg:g}",
                    "leave its column out, or give it a motor in the arm file",
                )


def _check_ranges(
    where: Sequence[str], angles: Array, arm: Arm, tolerance: JointTolerance, share: float = 1.0
) -> None:
    for joint, column, factor in zip(arm.driven, angles.T, tolerance.scale, strict=True):
        low, high = joint.range_deg
        allowed_deg = share * tolerance.one * factor
        for place, angle in zip(where, column.tolist(), strict=True):
            if not low - allowed_deg <= angle <= high + allowed_deg:
                raise InputError(
                    f"{place}: {joint.name} at {angle:g} {joint.unit.word} is outside of its range {low:g} to {high:g}",
                    f"correct the table, or {joint.unit.key('range_deg')} in the arm file",
                )


def _poses(
    table: NumberTable, header: Header, radians: bool | None, tolerance_deg: Tolerance | None
) -> ImportedPath:
    """Via points from columns of positions and orientations."""
    if header.time is not None or tolerance_deg is not None:
        raise InputError(
            f"{table.path}: poses are not thinned: every line becomes a via point, and times are planned anew",
            "leave the time, --tolerance-deg and --tolerance-mm out, and give only the poses to pass",
        )
    columns = {key: np.array(table.numbers([column.index]))[:, 0] for key, column in header.pose.items()}
    position = np.column_stack([columns[key] for key in table_header.POSITION])
    units = [header.pose[key].unit for key in table_header.POSITION]
    if not any(units) and np.abs(position).max() < _METRES:
        raise InputError(
            f"{table.path}: no position is beyond {np.abs(position).max():.3g}: mm or metres?",
            "name the unit in the header: x_mm,y_mm,z_mm or x_m,y_m,z_m",
        )
    unnamed = [key for key in WHOLE if key in columns and not header.pose[key].unit]
    if radians is None and unnamed and any(columns[key].any() for key in unnamed):
        _check_degrees(np.column_stack([columns[key] for key in unnamed]), table, unnamed[0])
    position = position * [table_header.mm(header.pose[key]) for key in table_header.POSITION]
    turned = {
        f"{key}_deg": _degrees(columns[key], header.pose[key], radians, table)
        for key in WHOLE
        if key in columns
    }
    quaternion = [columns[key] for key in table_header.QUATERNION if key in columns]
    poses = []
    for number, row in enumerate(position.tolist()):
        pose: dict[str, Sequence[float] | float] = {"position_mm": row}
        pose |= {key: float(values[number]) for key, values in turned.items()}
        if quaternion:
            pose["quaternion"] = [float(values[number]) for values in quaternion]
        poses.append(pose)
    return ImportedPath(np.empty((0, 0)), len(poses), tuple(poses))


def _times(table: NumberTable, header: Header) -> Array | None:
    """The time of each line in seconds, (n,), which must increase; None if there is none."""
    if header.time is None:
        return None
    times = np.array(table.numbers([header.time.index]))[:, 0] * table_header.seconds(header.time)
    for (line, _), step in zip(table.rows[1:], np.diff(times), strict=True):
        if not step > 0.0:
            raise InputError(
                f"{table.path}: line {line}: the time does not increase",
                "put the lines in order, or leave the column of times out",
            )
    return times


def _check_seconds(table: NumberTable, header: Header, angles_deg: Array, arm: Arm) -> None:
    """Refuse whole numbers as times without a unit at which positions (n, J) move so slowly that they may be
    milliseconds or less."""
    times_s = _times(table, header)
    if times_s is None or header.time is None or header.time.unit or np.any(times_s != np.round(times_s)):
        return
    limits = np.array([joint.limits.speed_deg_s for joint in arm.driven])
    share = float(np.max(np.abs(np.diff(angles_deg, axis=0)) / np.diff(times_s)[:, None] / limits))
    if 0.0 < share < _SLOWEST:
        raise InputError(
            f"{table.path}: line 1: no time has a fraction, and no joint reaches {_SLOWEST:.0%} of its speed limit: "
            "seconds or milliseconds?",
            "name the unit in the header: time_s, time_ms, time_us or time_ns",
        )


def _unwound(
    angles_deg: Array, times_s: Array, arm: Arm, where: Sequence[str]
) -> tuple[Array, tuple[str, ...]]:
    """A recording (n, J) with its jumps of a turn taken out, and a note for each joint that had some.

    A joint that moves by more than half a turn between two points, faster than its speed limit, has been recorded
    within a turn: it goes on by the short way. So it does if only that way goes on as before and after the two points,
    and the range allows it. Raises InputError, with ``where`` of the point, if it is faster than its
    limit, and than before and after, that way too, or leaves its range. ``times_s``: (n,), increasing.
    """
    found = angles_deg.copy()
    notes = []
    for number, joint in enumerate(arm.driven):
        if joint.slides:
            continue
        column = found[:, number]
        steps = np.diff(column)
        turns = -360.0 * np.round(steps / 360.0)
        limit = joint.limits.speed_deg_s * np.diff(times_s) * _SPEED_MARGIN
        jumps = np.flatnonzero((np.abs(steps) > 180.0) & (np.abs(steps) > limit))
        as_beside = _likely(steps, turns, times_s)
        likely = np.union1d(jumps, as_beside)
        whole = column + np.concatenate(
            ([0.0], np.cumsum(np.where(np.isin(np.arange(len(steps)), likely), turns, 0.0)))
        )
        if joint.range_deg[0] <= whole.min() and whole.max() <= joint.range_deg[1]:
            jumps = likely
        for jump in jumps.tolist():
            turn = turns[jump]
            if abs(steps[jump] + turn) > limit[jump] and jump not in as_beside:
                raise InputError(
                    f"{where[jump + 1]}: {joint.name} jumps from {angles_deg[jump, number]:g} to "
                    f"{angles_deg[jump + 1, number]:g} degrees, faster than its speed limit",
                    "correct the line, or leave the time out: then every line is a via point",
                )
            column[jump + 1 :] += turn
        low, high = joint.range_deg
        if not jumps.size:
            continue
        if (outside := np.flatnonzero((column < low) | (column > high))).size:
            raise InputError(
                f"{where[int(outside[0])]}: {joint.name} is recorded within a turn, and goes on to "
                f"{column[outside[0]]:g} degrees, outside of its range {low:g} to {high:g}",
                "widen range_deg if the joint can turn that far, or cut the recording before that",
            )
        notes.append(
            f"{joint.name}: recorded within a turn; it goes on from {column[jumps[0]]:g} to {column[-1]:g} degrees"
        )
    return found, tuple(notes)


def _likely(steps: Array, turns: Array, times_s: Array) -> Array:
    """Which steps (n,) go on at the speed of their neighbours, and in their direction, only with their turns added."""
    speeds = (steps + turns) / np.diff(times_s)
    found = []
    for step in np.flatnonzero((turns != 0.0) & (steps * speeds < 0.0)).tolist():
        beside = speeds[[each for each in (step - 1, step + 1) if 0 <= each < len(speeds)]]
        if (
            beside.size
            and np.all(beside * speeds[step] > 0.0)
            and abs(speeds[step]) <= _ALIKE * np.abs(beside).max()
        ):
            found.append(step)
    return np.array(found, dtype=np.intp)
