"""The parts of an arm in its file: the tables of joints, drivers and safety; ranges are with the fields (parts.py)."""

from __future__ import annotations

from typing import Any

from armtempo.basics import toml_section
from armtempo.basics.arguments import fits
from armtempo.basics.errors import InputError
from armtempo.basics.toml_table import Table
from armtempo.model import joint_unit, outputs_file
from armtempo.model.joint_unit import DEG, MM, JointUnit
from armtempo.model.parts import (
    CURVE,
    END_STEPS,
    LEAST_MM_PER_REV,
    LEAST_RATIO,
    LIMIT_INPUTS,
    MOST_MM_PER_REV,
    MOST_RATIO,
    Curve,
    Driver,
    Dynamics,
    Encoder,
    Joint,
    JointModel,
    Limits,
    LimitSwitches,
    Load,
    Motor,
    Safety,
    is_curve,
)

MAX_ANGLE_DEG = 36_000.0
"""Largest angle, either way, that an arm file may give: a hundred turns; of a sliding joint that many mm."""

MAX_LENGTH_MM = 1e6
"""Longest link that an arm file may describe."""

_LOCKED_DEG = 0.001
_MOST_KG_M2 = 1e4
_IN_UNITS = {
    "": ("range_deg", "home_deg", "fixed_deg"),
    "switches": ("low_deg", "high_deg"),
    **{
        name: tuple(one.name for one, _ in toml_section.keys(part))
        for name, part in (
            ("limits", Limits),
            ("motor", Motor),
            ("encoder", Encoder),
            ("model", JointModel),
            ("dynamics", Dynamics),
        )
    },
}
"""Fields of a joint and of its tables, some of which have another key if it slides."""


def driver(table: Table | None) -> Driver:
    """[driver]. All functions here raise InputError, with file, key and value."""
    return toml_section.read(Driver, table) if table else Driver()


def safety(table: Table | None) -> Safety:
    """[safety]."""
    return toml_section.read(Safety, table) if table else Safety()


def joint(table: Table, number: int) -> Joint:
    """A [[joint]] table; ``number`` from 1."""
    kind = table.choice("type", joint_unit.TYPES, joint_unit.REVOLUTE)
    unit = joint_unit.of_type(kind)
    _check_units(table, unit)
    low, high = _range(table, unit)
    linkage = table.boolean("parallel_linkage", Joint.parallel_linkage)
    if linkage and number == 1:
        raise table.fail("parallel_linkage", "false for joint 1, which has no joint before it")
    if linkage and unit is not DEG:
        raise table.misplaced("parallel_linkage", "leave it out: this joint slides")
    motor = _motor(table.table("motor"), unit)
    limits = _limits(table.table("limits"), unit)
    if motor is not None and limits is None:
        keys = [unit.key(name) for name in ("speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3")]
        raise table.fail("limits", f"a table with {keys[0]}, {keys[1]} and {keys[2]}")
    encoder = _encoder(table.table("encoder"), unit)
    if encoder is not None and motor is None:
        raise table.misplaced("encoder", "give the joint a motor too, or leave it out")
    found = Joint(
        name=table.text("name", f"joint {number}"),
        d_mm=table.number("d_mm", least=-MAX_LENGTH_MM, most=MAX_LENGTH_MM),
        a_mm=table.number("a_mm", least=-MAX_LENGTH_MM, most=MAX_LENGTH_MM),
        alpha_deg=table.number("alpha_deg", least=-180.0, most=180.0),
        theta_offset_deg=table.number("theta_offset_deg", 0.0, least=-360.0, most=360.0),
        range_deg=(low, high),
        home_deg=_home(table, unit, low, high, motor),
        limits=limits,
        motor=motor,
        encoder=encoder,
        switches=_switches(table.table("switches"), unit),
        model=_model(table.table("model"), unit),
        parallel_linkage=linkage,
        radius_mm=table.number("radius_mm", 0.0, least=0.0, most=MAX_LENGTH_MM),
        dynamics=_dynamics(table.table("dynamics"), unit),
        type=kind,
    )
    table.done()
    return found


def _check_units(table: Table, unit: JointUnit) -> None:
    """InputError for a key of a joint, or of a table in it, that belongs to the other type of joints."""
    for part, names in _IN_UNITS.items():
        inner = table.peek(part) if part else None
        given = Table(inner, table.file, f"{table.place}{part}.") if isinstance(inner, dict) else table
        if part and given is table:
            continue
        if unit is DEG and part == "motor" and given.has("mm_per_rev"):
            raise InputError(
                f"{table.file}: {given.place}mm_per_rev is of a sliding joint, and this one turns",
                f'leave it out; or give type = "{joint_unit.PRISMATIC}" to the joint',
            )
        for name in names:
            wrong, right = (MM.key(name), name) if unit is DEG else (name, MM.key(name))
            if wrong != right and given.has(wrong):
                what = (
                    "a sliding joint, and this one turns"
                    if unit is DEG
                    else "a turning joint, and this one slides"
                )
                raise InputError(
                    f"{table.file}: {given.place}{wrong} is of {what}",
                    f'give {right}; or type = "{joint_unit.TYPES[unit is DEG]}" to the joint',
                )


def _range(table: Table, unit: JointUnit) -> tuple[float, float]:
    """The range of a joint, or the narrow one of a joint that is locked."""
    if table.has(unit.key("fixed_deg")):
        return _locked(table, unit)
    key, what = unit.key("range_deg"), "angles" if unit is DEG else "positions in mm"
    low, high = table.numbers(key, 2)
    if not -MAX_ANGLE_DEG <= low < high <= MAX_ANGLE_DEG:
        raise table.fail(key, f"two {what}, the smaller first, of at most {MAX_ANGLE_DEG:g} either way")
    return low, high


def _dynamics(table: Table | None, unit: JointUnit) -> Dynamics | None:
    if table is None:
        return None
    needed = [] if table.peek("mass_kg") else [(0.0,) * 3]
    centre = table.numbers("centre_mm", 3, *needed, most=MAX_LENGTH_MM)
    return toml_section.read(Dynamics, table, unit.key, centre_mm=centre, inertia_kg_m2=_inertia(table))


def _inertia(table: Table) -> tuple[float, ...]:
    return table.numbers("inertia_kg_m2", 6, (0.0,) * 6, most=_MOST_KG_M2)


def loads(top: Table) -> tuple[Load, ...]:
    """The tables [load.NAME]."""
    return tuple(
        toml_section.read(
            Load,
            table,
            name=name,
            centre_mm=table.numbers("centre_mm", 3, (0.0,) * 3, most=MAX_LENGTH_MM),
            inertia_kg_m2=_inertia(table),
        )
        for name, table in outputs_file.named(top, "load")
    )


def _home(table: Table, unit: JointUnit, low: float, high: float, motor: Motor | None) -> float:
    if table.has(unit.key("fixed_deg")):
        return (low + high) / 2
    key, nearest = unit.key("home_deg"), min(max(0.0, low), high)
    home = table.number(key, nearest)
    end = min(max(home, low), high)
    if motor is not None and abs(home - end) * motor.steps_per_deg <= END_STEPS:
        return end
    return table.number(key, nearest, least=low, most=high)


def _locked(table: Table, unit: JointUnit) -> tuple[float, float]:
    """The narrow range of a joint that ``fixed_deg`` locks."""
    fixed, home = unit.key("fixed_deg"), unit.key("home_deg")
    angle = table.number(fixed, least=1 - MAX_ANGLE_DEG, most=MAX_ANGLE_DEG - 1)
    table.known(unit.key("range_deg"), "limits")
    for key in ("motor", home):
        if table.has(key):
            raise table.misplaced(key, f"leave it out: {fixed} locks the joint")
    return angle - _LOCKED_DEG, angle + _LOCKED_DEG


def _limits(table: Table | None, unit: JointUnit) -> Limits | None:
    return toml_section.read(Limits, table, unit.key) if table else None


def _motor(table: Table | None, unit: JointUnit) -> Motor | None:
    if table is None:
        return None
    others: dict[str, Any] = {}
    if unit is not DEG:
        others["mm_per_rev"] = table.number("mm_per_rev", least=LEAST_MM_PER_REV, most=MOST_MM_PER_REV)
        others["gear_ratio"] = table.number("gear_ratio", 1.0, least=LEAST_RATIO, most=MOST_RATIO)
    table.known("curve_rpm_nm")
    curve: Any = table.array("curve_rpm_nm", CURVE) if table.has("curve_rpm_nm") else ()
    if not fits(curve, Curve) or not is_curve(curve):
        raise table.fail("curve_rpm_nm", CURVE)
    others["curve_rpm_nm"] = tuple((float(rpm), float(nm)) for rpm, nm in curve)
    return toml_section.read(Motor, table, unit.key, **others)


def _encoder(table: Table | None, unit: JointUnit) -> Encoder | None:
    return toml_section.read(Encoder, table, unit.key) if table else None


def _switches(table: Table | None, unit: JointUnit) -> LimitSwitches:
    if table is None:
        return LimitSwitches()
    switches = LimitSwitches(
        low=_switch(table, "low"),
        high=_switch(table, "high"),
        active=table.choice("active", ("low", "high"), "low"),
        low_deg=_angle(table, unit.key("low_deg")),
        high_deg=_angle(table, unit.key("high_deg")),
    )
    table.done()
    return switches


def _switch(table: Table, key: str) -> int | str | None:
    if table.is_text(key):
        return outputs_file.pin(
            table, key, f"an input from 1 to {LIMIT_INPUTS}, or a free pin such as PD0 for homing only"
        )
    return table.integer(key, least=1, most=LIMIT_INPUTS) if table.has(key) else None


def homing(top: Table, names: list[str]) -> tuple[tuple[str, ...], ...]:
    """``homing``: names of joints, or lists of them, in the order in which they are homed."""
    if not top.has("homing"):
        return ()
    allowed = f"a list of joints' names, each once, or of lists of them; the joints are {', '.join(names)}"
    entries = top.array("homing", allowed)
    groups = tuple(tuple(entry) if isinstance(entry, list) else (entry,) for entry in entries)
    flat = [name for group in groups for name in group]
    if not all(name in names for name in flat) or len(set(flat)) != len(flat) or not all(groups):
        raise top.fail("homing", allowed)
    return groups


def _angle(table: Table, key: str) -> float | None:
    return table.number(key, least=-MAX_ANGLE_DEG, most=MAX_ANGLE_DEG) if table.has(key) else None


def _model(table: Table | None, unit: JointUnit) -> JointModel:
    return toml_section.read(JointModel, table, unit.key) if table else JointModel()
