"""One joint as a user describes it: the arm file's keys, defaults, and values that help to choose."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields

from armtempo_shared.limits import MAX_STEP_RATE, MAX_STEP_RATE_SUM

from armtempo.basics.errors import InputError
from armtempo.model import joint_unit
from armtempo.model.joint_unit import PRISMATIC, REVOLUTE, TYPES, JointUnit

MOTOR_RPM = 300.0
"""Speed up to which a common hybrid stepper (NEMA 17, 24 V) keeps most of its torque; only a default."""


@dataclass(frozen=True)
class JointEntry:
    """A joint: its Denavit-Hartenberg row, range, and drive; units as the names say, of a sliding one mm for deg."""

    name: str
    d_mm: float = 0.0
    a_mm: float = 0.0
    alpha_deg: float = 0.0
    theta_offset_deg: float = 0.0
    low_deg: float = -90.0
    high_deg: float = 90.0
    steps_per_rev: int = 200
    microsteps: int = 16
    gear_ratio: float = 1.0
    speed_deg_s: float | None = None
    """None: 60, or the value of ``most_speed_deg_s`` if that is less."""
    encoder_counts: int = 0
    """Counts per turn of the joint; 0: no encoder."""
    parallel_linkage: bool = False
    """A parallelogram turns it: see the arm file's key."""
    mm_per_rev: float = 8.0
    """Of a sliding joint: how far it moves for a turn of its screw or pulley."""
    type: str = REVOLUTE
    """One of TYPES."""

    @property
    def unit(self) -> JointUnit:
        """Of its position."""
        return joint_unit.of_type(self.type)

    @property
    def _per_rev(self) -> float:
        return self.mm_per_rev if self.type == PRISMATIC else 360.0

    @property
    def steps_per_deg(self) -> float:
        """Steps per degree or mm of the joint."""
        return self.steps_per_rev * self.microsteps * self.gear_ratio / self._per_rev

    def most_speed_deg_s(self, joints: int) -> float:
        """The highest speed by MOTOR_RPM and the board's step rate divided by ``joints``, degrees/s."""
        rate = min(MAX_STEP_RATE, MAX_STEP_RATE_SUM / joints)
        return min(rate / self.steps_per_deg, MOTOR_RPM / 60.0 * self._per_rev / self.gear_ratio)


NUMBERS = tuple(field.name for field in fields(JointEntry) if field.name not in ("name", "type"))
"""Fields of a joint that are a number."""
_OF_POSITION = ("low_deg", "high_deg", "speed_deg_s")
_ONLY = {PRISMATIC: ("mm_per_rev",), REVOLUTE: ("parallel_linkage",)}

INTEGERS = ("steps_per_rev", "microsteps", "encoder_counts", "parallel_linkage")


def parse(text: str, number: int) -> JointEntry:
    """The joint in ``key=value,key=value``, the keys being ``name``, ``type`` and those of its type.

    Raises InputError, naming the key, for one that is unknown or given twice, or for a value that is not a number.
    """
    parts = [part.strip() for part in text.split(",") if part.strip()]
    given = [tuple(word.strip() for word in part.partition("=")) for part in parts]
    kind = next((value for key, _, value in given if key == "type"), REVOLUTE)
    if kind not in TYPES:
        raise InputError(f"joint {number}: type = {kind!r} is not allowed", f"give {' or '.join(TYPES)}")
    fields_of = _fields_of(kind)
    values: dict[str, str] = {}
    for part, (key, equals, value) in zip(parts, given, strict=True):
        if not equals or key not in ("name", "type", *fields_of) or key in values:
            why = "is given twice" if key in values else "is not one of the keys"
            raise InputError(
                f"joint {number}: {part!r} {why}",
                f"give KEY=VALUE with {', '.join(('name', 'type', *fields_of))}",
            )
        values[key] = value
    name, _ = values.pop("name", f"joint {number}"), values.pop("type", "")
    numbers = {fields_of[key]: _number(number, key, value) for key, value in values.items()}
    if kind == PRISMATIC:
        numbers = {"low_deg": 0.0, "high_deg": 100.0, **numbers}
    return JointEntry(name, **numbers, type=kind)  # type: ignore[arg-type]


def _fields_of(kind: str) -> dict[str, str]:
    """The fields of a joint of a type, by their keys: of a sliding joint in mm."""
    others = {name for of, names in _ONLY.items() if of != kind for name in names}
    unit = joint_unit.of_type(kind)
    return {unit.key(name) if name in _OF_POSITION else name: name for name in NUMBERS if name not in others}


def _number(number: int, key: str, value: str) -> float | int:
    try:
        if key in INTEGERS:
            return int(value)
        return float(value)
    except ValueError:
        raise InputError(
            f"joint {number}: {key} = {value!r} is not a number", "write it as 12 or -3.5"
        ) from None


def table(entry: JointEntry, channel: int, joints: int) -> str:
    """The joint's ``[[joint]]`` table in an arm file of ``joints`` joints."""
    unit, slides = entry.unit, entry.type == PRISMATIC
    most = entry.most_speed_deg_s(joints)
    speed = min(60.0, float(f"{0.9 * most:.2g}")) if entry.speed_deg_s is None else entry.speed_deg_s
    lines = [
        "[[joint]]",
        f"name = {json.dumps(entry.name, ensure_ascii=False)}",
        *([f'type = "{PRISMATIC}"'] if slides else []),
        f"d_mm = {entry.d_mm!r}",
        f"a_mm = {entry.a_mm!r}",
        f"alpha_deg = {entry.alpha_deg!r}",
        f"theta_offset_deg = {entry.theta_offset_deg!r}",
        *(["parallel_linkage = true"] if entry.parallel_linkage else []),
        f"{unit.key('range_deg')} = [{entry.low_deg!r}, {entry.high_deg!r}]",
        f"# {entry.steps_per_deg:.5g} steps/{unit.name}; the board's step rate and {MOTOR_RPM:g} rpm allow {most:.4g} "
        f"{unit.name}/s",
        f"limits = {{ {unit.key('speed_deg_s')} = {speed:g}, {unit.key('acceleration_deg_s2')} = {speed:g}, "
        f"{unit.key('jerk_deg_s3')} = {4 * speed:g} }}",
        f"motor = {{ channel = {channel}, steps_per_rev = {entry.steps_per_rev}, microsteps = {entry.microsteps},"
        f" gear_ratio = {entry.gear_ratio!r}{f', mm_per_rev = {entry.mm_per_rev!r}' if slides else ''} }}",
    ]
    if entry.encoder_counts:
        counts = entry.encoder_counts
        lines.append(f'encoder = {{ channel = {channel}, counts_per_rev = {counts}, on = "joint" }}')
    return "\n".join(lines) + "\n"


def constant(name: str, a_mm: float, alpha_deg: float) -> str:
    """The table of a constant row."""
    return f'[[joint]]\nname = "{name}"\nd_mm = 0.0\na_mm = {a_mm!r}\nalpha_deg = {alpha_deg!r}\nfixed_deg = 0.0\n'
