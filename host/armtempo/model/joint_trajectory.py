"""Trajectories of ROS programs: trajectory_msgs/JointTrajectory as JSON, or as YAML with PyYAML (extra ``ros``)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, MissingPackageError
from armtempo.basics.kinds import is_number
from armtempo.model import table_header
from armtempo.model.arm import Arm
from armtempo.model.exchange import from_si
from armtempo.model.joint_unit import DEG

_KEYS = ("joint_names", "points")
_SUFFIXES = (".json", ".yaml", ".yml")
_INSIDE = ("trajectory", "joint_trajectory", "goal", "msg", "message")
"""Keys under which other messages have a trajectory: DisplayTrajectory, FollowJointTrajectory's goal."""
_DEEPEST = 8
"""Levels of messages and lists in which a trajectory is looked for."""
_BEFORE = "\ufeff \t\r\n"
"""What may stand before JSON."""
_TIMES_S = {"sec": 1.0, "secs": 1.0, "nanosec": 1e-9, "nsecs": 1e-9, "nsec": 1e-9}
"""Keys of a time, and their seconds."""
_TURN_DEG = 360.0
"""Positions that are farther beyond a range than this may be in degrees."""
_STEP_S = 0.01
"""Largest step of the points of a trajectory with speeds."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """A motion with its times."""

    times_s: Array
    """(n,), increasing."""
    angles_deg: Array
    """(n, J), of the driven joints."""
    notes: tuple[str, ...] = ()


def is_ros(text: str, path: Path | str) -> bool:
    """Whether a text is a message, and no table: by the name of its file, or by what it says."""
    return Path(path).suffix.lower() in _SUFFIXES or _is_json(text) or _KEYS[0] in text


def of_text(text: str, path: Path | str, arm: Arm) -> Recorded:
    """The JointTrajectory in a text, also within another message, for the driven joints of an arm.

    Joints are found by their names as in tables; others are named in the notes. Between points with speeds the motion
    is the cubic that controllers follow, with accelerations too the quintic, given in steps of 10 ms. Raises
    InputError, with the point, for what is missing or not a number, and MissingPackageError for YAML without PyYAML.
    """
    return of_content(_content(text, path), path, arm)


def names_all(names: Sequence[str], arm: Arm) -> bool:
    """Whether these are names of all driven joints, and maybe of others."""
    try:
        return len(table_header.read([str(name) for name in names], arm, "").angles) == len(arm.driven)
    except InputError:
        return False


def of_content(content: Mapping[str, Any], path: Path | str, arm: Arm) -> Recorded:
    """The same, of a message with ``joint_names`` and ``points``."""
    names, points = (content.get(key) for key in _KEYS)
    if not isinstance(names, list) or not isinstance(points, list) or len(points) < 2:
        raise InputError(
            f"{path}: is not a JointTrajectory with at least 2 points", "it has joint_names and points"
        )
    header = table_header.read([str(name) for name in names], arm, f"{path}: joint_names")
    if header.pose or header.time is not None:
        raise InputError(f"{path}: joint_names are not joints", f"name {table_header.expected(arm)}")
    columns = [column.index for column in header.angles]
    times = np.array([_time_s(_entry(point, n, path), n, path) for n, point in enumerate(points)])
    if np.any(np.diff(times) <= 0.0):
        late = int(np.flatnonzero(np.diff(times) <= 0.0)[0]) + 1
        raise InputError(
            f"{path}: point {late}: time_from_start does not increase", "put the points in order"
        )
    units = [DEG] * len(names)  # of columns that are not read, nothing is said
    of_columns = dict(zip((column.index for column in header.angles), arm.driven_indices, strict=True))
    of_columns |= {column.index: index for index, column in header.resting.items()}
    for place, joint_index in of_columns.items():
        units[place] = arm.joints[joint_index].unit
    angles = from_si(
        [_numbers(point, "positions", len(names), n, path) for n, point in enumerate(points)], units
    )
    for index, column in header.resting.items():
        joint = arm.joints[index]
        if np.abs(angles[:, column.index] - joint.home_deg).max() > table_header.RESTS_DEG:
            raise InputError(
                f"{path}: {joint.name} has no motor, it stays at {joint.home_deg:g} {joint.unit.word}",
                "leave it out, or give it a motor in the arm file",
            )
    notes = (f"joints that were not used: {', '.join(header.unused)}",) if header.unused else ()
    angles = angles[:, columns]
    _check_radians(angles, arm, path)
    derived = []
    for key in ("velocities", "accelerations"):
        given = [bool(point.get(key)) for point in points]
        rows = [_numbers(point, key, len(names), n, path) for n, point in enumerate(points) if point.get(key)]
        if all(given):
            derived.append(from_si(rows, units)[:, columns])
            continue
        if any(given):
            notes = (*notes, f"{key} were not used, as not all points have them")
        break
    if derived:
        times, angles = _between(times, angles, derived)
    return Recorded(times, angles, notes)


def _check_radians(angles_deg: Array, arm: Arm, path: Path | str) -> None:
    """Refuse positions (n, J) that leave the ranges, and would not if they were in degrees."""
    turning = [index for index, joint in enumerate(arm.driven) if not joint.slides]
    low, high = np.array([arm.driven[index].range_deg for index in turning]).reshape(-1, 2).T
    given_deg = angles_deg[:, turning]
    values = np.radians(given_deg)
    if np.any((given_deg < low - _TURN_DEG) | (given_deg > high + _TURN_DEG)) and np.all(
        (values >= low) & (values <= high)
    ):
        raise InputError(
            f"{path}: positions up to {np.abs(values).max():.4g} leave the joints' ranges: are they in degrees?",
            "a JointTrajectory has radians; convert them",
        )


def _content(text: str, path: Path | str) -> Mapping[str, Any]:
    try:
        found = _json(text)
    except ValueError as no_json:
        try:
            found = _yaml(text)  # which may begin like JSON
        except ValueError as error:
            raise InputError(
                f"{path}: is neither JSON nor YAML: {no_json if _is_json(text) else error}",
                "give a whole message",
            ) from None
        except MissingPackageError as error:
            if _is_json(text):
                raise InputError(
                    f"{path}: is not JSON: {no_json}", f"for YAML PyYAML is needed, {error.hint}"
                ) from None
            raise
    return _trajectory(found, path)


def _json(text: str) -> Any:
    return json.loads(text.lstrip(_BEFORE))


def _is_json(text: str) -> bool:
    return text.lstrip(_BEFORE).startswith(("{", "["))


def _yaml(text: str) -> Any:
    """Its documents that are not empty."""
    try:
        import yaml
    except ImportError:
        raise MissingPackageError("reading YAML", "PyYAML", "ros") from None
    try:
        return [each for each in yaml.safe_load_all(text) if each is not None]
    except yaml.YAMLError as error:
        raise ValueError(str(error).replace("\n", " ")) from None


def _trajectory(found: Any, path: Path | str) -> Mapping[str, Any]:
    for _ in range(_DEEPEST):
        if isinstance(found, list):
            if len(found) > 1 and all(isinstance(each, Mapping) for each in found):
                raise InputError(f"{path}: has {len(found)} messages", "give a file with one trajectory")
            found = found[0] if len(found) == 1 else None
            continue
        if not isinstance(found, Mapping):
            break
        if all(key in found for key in _KEYS):
            return found
        found = next((found[key] for key in _INSIDE if key in found), None)
    raise InputError(f"{path}: has no JointTrajectory", "it has joint_names and points")


def _entry(point: Any, number: int, path: Path | str) -> Mapping[str, Any]:
    if not isinstance(point, Mapping):
        raise InputError(f"{path}: point {number} is no point", "give positions and time_from_start")
    return point


def _time_s(point: Mapping[str, Any], number: int, path: Path | str) -> float:
    given = point.get("time_from_start")
    if isinstance(given, Mapping):
        if given and given.keys() <= _TIMES_S.keys() and all(map(is_number, given.values())):
            return sum(float(value) * _TIMES_S[key] for key, value in given.items())
    elif given is not None and is_number(given):
        return float(given)
    raise InputError(
        f"{path}: point {number}: time_from_start {given!r} is no time", "give {sec: …, nanosec: …}"
    )


def _numbers(point: Mapping[str, Any], key: str, count: int, number: int, path: Path | str) -> list[float]:
    given = point.get(key)
    if not isinstance(given, Sequence) or len(given) != count or not all(map(is_number, given)):
        raise InputError(
            f"{path}: point {number}: {key} must be {count} numbers, one for each of joint_names",
            "correct the point",
        )
    return [float(value) for value in given]


def _between(times: Array, angles: Array, derived: Sequence[Array]) -> tuple[Array, Array]:
    """Times and angles with points between, on the cubics of positions and speeds, or the quintics of these and
    accelerations; each (n, J)."""
    found_s, found = [times[:1]], [angles[:1]]
    for n, step in enumerate(np.diff(times)):
        u = np.linspace(0.0, 1.0, max(int(np.ceil(step / _STEP_S)), 1) + 1)[1:]
        powers = u[:, None] ** np.arange(2 * len(derived) + 2)
        ends = [
            step**order * values[at] for at in (n, n + 1) for order, values in enumerate((angles, *derived))
        ]
        found_s.append(times[n] + step * u)
        found.append(powers @ np.linalg.solve(_HERMITE[len(derived)], ends))
        found[-1][-1] = angles[n + 1]
    found_s[-1][-1] = times[-1]
    return np.concatenate(found_s), np.concatenate(found)


def _hermite(derivatives: int) -> Array:
    """What the coefficients of a polynomial on 0 to 1 make of its ends: value and derivatives at 0, then at 1."""
    size = 2 * derivatives + 2
    rows = [
        [
            math.perm(power, order) * float(at) ** (power - order) if power >= order else 0.0
            for power in range(size)
        ]
        for at in (0, 1)
        for order in range(derivatives + 1)
    ]
    return np.array(rows)


_HERMITE = {1: _hermite(1), 2: _hermite(2)}
