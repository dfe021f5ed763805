"""Which columns of a table are angles, parts of a pose, or times: by their names, never by their order."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest

from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.exchange import TIME_COLUMN, columns
from armtempo.model.tool_pose import WHOLE

POSITION = ("x", "y", "z")
QUATERNION = ("qw", "qx", "qy", "qz")
TIME = "time"
RESTS_DEG = 0.01
"""Allowed distance from home of a joint without a motor."""
_TIMES = ("time", "t", "times", "timestamp", "stamp", "timefromstart")
_ANGLE_WORDS = ("", "angle", "position", "pos")
_NUMBERED = ("j", "joint", "axis", "q", "theta")
_FROM_0 = {f"{word}0{angle}" for word in _NUMBERED for angle in _ANGLE_WORDS}
_DERIVED = {"speed", "velocity", "vel", "acceleration", "accel", "acc", "jerk", "effort", "torque", "current"}
_ANGLE = {
    "deg": "deg",
    "degree": "deg",
    "degrees": "deg",
    "°": "deg",
    "rad": "rad",
    "radian": "rad",
    "radians": "rad",
}
_LENGTH = {"mm": 1.0, "cm": 10.0, "m": 1000.0}
_DURATION = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_NO_UNIT = "-"
UNITS = frozenset({**_ANGLE, **_LENGTH, **_DURATION})
"""Words that may say the unit of a column after its name."""
_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]")
_GAPS = re.compile(r"[\s_\-./]+")


@dataclass(frozen=True)
class Column:
    """A column with a meaning."""

    index: int
    unit: str = ""
    """As written in the header, "" if it is not."""


@dataclass(frozen=True)
class Header:
    """The columns of a table by their meaning."""

    angles: tuple[Column, ...] = ()
    """One for each driven joint; empty for a table of poses."""
    resting: Mapping[int, Column] = field(default_factory=dict)
    """Columns of joints without a motor, by the joint's index in the arm."""
    pose: Mapping[str, Column] = field(default_factory=dict)
    """Columns of POSITION, roll, pitch, yaw, or QUATERNION."""
    time: Column | None = None
    unused: tuple[str, ...] = ()
    """Names of columns that are not read."""


def mm(column: Column) -> float:
    """Millimetres of a unit of the column (default: mm)."""
    return _LENGTH[column.unit or "mm"]


def seconds(column: Column) -> float:
    """Seconds of a unit of the column (default: s)."""
    return _DURATION[column.unit or "s"]


def is_radians(column: Column) -> bool | None:
    """Whether the column is in radians; None if its name does not say."""
    return _ANGLE[column.unit] == "rad" if column.unit else None


def expected(arm: Arm) -> str:
    """A header that the arm's table may have."""
    return ",".join(f"{joint.name} ({joint.unit.name})" if arm.slides else joint.name for joint in arm.driven)


def read(names: Sequence[str], arm: Arm, where: str) -> Header:
    """The meaning of each column; ``where`` begins the messages.

    Names count without case, spaces, underscores and units: those of the arm's joints, or ``jN``, ``joint N`` with
    the number of the joint; ``x, y, z`` with roll, pitch, yaw or ``qw, qx, qy, qz``; ``time``. Raises InputError for
    a name that occurs twice, an unknown unit, and unless all driven joints or a pose are named.
    """
    hint = f"name the columns {expected(arm)}, or x_mm,y_mm,z_mm with roll_deg,pitch_deg,yaw_deg"
    twice = [name for name, count in Counter(map(_plain, filter(None, names))).items() if count > 1]
    if twice:
        raise InputError(
            f"{where}: two columns are called {twice[0]!r}", "give each column a name of its own"
        )
    found: dict[str | int, Column] = {}
    unused = []
    for index, name in enumerate(names):
        meaning, unit = _meaning(name, arm, where)
        if meaning is None:
            unused.append(name or f"column {index + 1}")
        elif meaning in found:
            raise InputError(
                f"{where}: {names[found[meaning].index]!r} and {name!r} both name {_called(meaning, arm)}",
                "leave one of the two columns out",
            )
        else:
            found[meaning] = Column(index, unit)
    for name in unused:
        if _plain(_split(name)[0]) in _FROM_0:
            raise InputError(f"{where}: {name!r} counts the joints from 0", f"count from 1, or {hint}")
    joints = {key: column for key, column in found.items() if isinstance(key, int)}
    pose = {key: found[key] for key in (*POSITION, *WHOLE, *QUATERNION) if key in found}
    driven = [joints.pop(index) for index in arm.driven_indices if index in joints]
    time = found.get(TIME)
    if len(driven) == len(arm.driven) and not all(key in pose for key in POSITION):
        others = [name for name in unused if not _is_derived(name)]
        return Header(
            tuple(driven), joints, {}, time, tuple(others + [names[c.index] for c in pose.values()])
        )
    if driven or not all(key in pose for key in POSITION):
        raise InputError(f"{where}: the header does not name a column for each driven joint", hint)
    if unused or joints:
        other = unused[0] if unused else names[next(iter(joints.values())).index]
        raise InputError(f"{where}: {other!r} is not known as part of a pose", f"leave it out, or {hint}")
    _check_orientation([key for key in pose if key not in POSITION], where)
    return Header(pose=pose, time=time)


def with_units(names: Sequence[str], units: Sequence[str], where: str) -> list[str]:
    """The names with the units of the line below them; InputError if a name has another one."""
    found = []
    for name, unit in zip_longest(names, units[: len(names)], fillvalue=""):
        base, own = _split(name)
        if own in UNITS and unit.lower() not in ("", _NO_UNIT, own):
            raise InputError(
                f"{where}: {name!r} is in {unit} by the line below", "leave one of the two units out"
            )
        found.append(f"{base} ({unit})" if own not in UNITS and unit not in ("", _NO_UNIT) else name)
    return found


def _check_orientation(keys: list[str], where: str) -> None:
    turned = [key for key in QUATERNION if key in keys]
    if turned and (len(turned) < len(QUATERNION) or len(keys) > len(turned)):
        raise InputError(
            f"{where}: {', '.join(keys)} are not an orientation",
            "give roll, pitch and yaw, or qw, qx, qy and qz",
        )


def _meaning(name: str, arm: Arm, where: str) -> tuple[str | int | None, str]:
    """What a column is (index of a joint, or a word) and its unit; None if it is nothing that is read."""
    plain = [_plain(joint.name) for joint in arm.joints]
    if plain.count(_plain(name)) == 1:
        return plain.index(_plain(name)), ""
    base, unit = _split(name)
    key = _plain(base)
    if key in _TIMES:
        return TIME, _known(unit, _DURATION, name, where)
    if _is_derived(name):
        return None, ""
    joint = _joint(name, key, plain, arm)
    if joint is not None:
        return joint, _known(unit, _LENGTH if arm.joints[joint].slides else _ANGLE, name, where)
    if key in POSITION:
        return key, _known(unit, _LENGTH, name, where)
    if key in WHOLE:
        return key, _known(unit, _ANGLE, name, where)
    return (key, "") if key in QUATERNION else (None, "")


def _joint(name: str, key: str, plain: list[str], arm: Arm) -> int | None:
    """The index of the joint that a name without unit means."""
    for number, index in enumerate(arm.driven_indices, 1):
        position, *_ = columns(arm.joints[index].unit)
        if name == f"j{number}_{position}":  # as ``exchange.to_csv`` counts: the joints with a motor
            return index
    named = [index for index, own in enumerate(plain) if key in {own + word for word in _ANGLE_WORDS}]
    if named:
        return named[0]
    if arm.driven_indices != tuple(range(len(arm.driven))):
        return None  # numbers could count all joints, or those with a motor
    for index in range(len(arm.joints)):
        numbered = {f"{word}{index + 1}{angle}" for word in _NUMBERED for angle in _ANGLE_WORDS}
        if key in numbered:
            return index
    return None


def _split(name: str) -> tuple[str, str]:
    """A name without its unit, and the unit in brackets or after the last gap."""
    if found := _BRACKETS.fullmatch(name):
        return found[1], found[2].lower()
    base, _, last = _GAPS.sub(" ", name.strip()).rpartition(" ")
    return (base, last.lower()) if base and last.lower() in UNITS else (name, "")


def _known(unit: str, units: Mapping[str, object], name: str, where: str) -> str:
    if unit and unit not in units:
        raise InputError(f"{where}: {name!r}: the unit is not known", f"give one of {', '.join(units)}")
    return unit


def _plain(name: str) -> str:
    return _GAPS.sub("", name).lower()


def _is_derived(name: str) -> bool:
    """Whether a column is a derivative or a load, as ``exchange.to_csv`` and recordings have them."""
    return bool(_DERIVED & set(_GAPS.sub(" ", name).lower().split()))


def _called(meaning: str | int, arm: Arm) -> str:
    return arm.joints[meaning].name if isinstance(meaning, int) else meaning


def no_header(count: int, arm: Arm, where: str, rising: bool) -> Header:
    """The columns of a table without a header: one for each driven joint, in their order; else InputError.

    ``rising``: whether the first column rises in every line.
    """
    if count == len(arm.driven) and not arm.slides:
        return Header(tuple(Column(index) for index in range(count)))
    if count == len(arm.driven):
        raise InputError(
            f"{where}: no header says in which units the joints are, and not all of them turn",
            f"write one into the first line: {expected(arm)}",
        )
    timed = f"{TIME_COLUMN}," if rising and count == len(arm.driven) + 1 else ""
    looks = "; the first looks like a time" if timed else ""
    raise InputError(
        f"{where}: {count} columns without a header, but {len(arm.driven)} joints have a motor{looks}",
        f"write a header into the first line: {timed}{expected(arm)}; or x_mm,y_mm,z_mm for poses",
    )
