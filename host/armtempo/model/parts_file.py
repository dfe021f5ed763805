"""The parts of an arm in its file: the tables of joints, drivers and safety; ranges are with the fields (parts.py)."""

from __future__ import annotations

from typing import Any

from armtempo.basics import toml_section
from armtempo.basics.arguments import fits
from armtempo.basics.errors import InputError
from armtempo.basics.toml_table import Table
from armtempo.model import outputs_file
from armtempo.model.parts import (
    CURVE,
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
"""Largest angle, either way, that an arm file may give: a hundred turns."""

MAX_LENGTH_MM = 1e6
"""Longest link that an arm file may describe."""

_LOCKED_DEG = 0.001


def driver(table: Table | None) -> Driver:
    """[driver]. All functions here raise InputError, with file, key and value."""
    return toml_section.read(Driver, table) if table else Driver()


def safety(table: Table | None) -> Safety:
    """[safety]."""
    return toml_section.read(Safety, table) if table else Safety()


def joint(table: Table, number: int) -> Joint:
    """A [[joint]] table; ``number`` from 1."""
    if slides := [key for key in ("type", "range_mm", "mm_per_rev", "home_mm") if table.has(key)]:
        raise InputError(
            f"{table.file}: joint[{number}].{slides[0]}: an arm file describes turning joints; sliding ones are not "
            "supported",
            "leave the joint out, and move it by other means",
        )
    low, high = _locked(table) if table.has("fixed_deg") else table.numbers("range_deg", 2)
    if not -MAX_ANGLE_DEG <= low < high <= MAX_ANGLE_DEG:
        raise table.fail(
            "range_deg", f"two angles, the smaller first, of at most {MAX_ANGLE_DEG:g} either way"
        )
    linkage = table.boolean("parallel_linkage", Joint.parallel_linkage)
    if linkage and number == 1:
        raise table.fail("parallel_linkage", "false for joint 1, which has no joint before it")
    motor = _motor(table.table("motor"))
    limits = _limits(table.table("limits"))
    if motor is not None and limits is None:
        raise table.fail("limits", "a table with speed_deg_s, acceleration_deg_s2 and jerk_deg_s3")
    encoder = _encoder(table.table("encoder"))
    if encoder is not None and motor is None:
        raise table.fail("motor", "only allowed with an encoder")
    found = Joint(
        name=table.text("name", f"joint {number}"),
        d_mm=table.number("d_mm", least=-MAX_LENGTH_MM, most=MAX_LENGTH_MM),
        a_mm=table.number("a_mm", least=-MAX_LENGTH_MM, most=MAX_LENGTH_MM),
        alpha_deg=table.number("alpha_deg", least=-180.0, most=180.0),
        theta_offset_deg=table.number("theta_offset_deg", 0.0, least=-360.0, most=360.0),
        range_deg=(low, high),
        home_deg=_home(table, low, high),
        limits=limits,
        motor=motor,
        encoder=encoder,
        switches=_switches(table.table("switches")),
        model=_model(table.table("model")),
        parallel_linkage=linkage,
        radius_mm=table.number("radius_mm", 0.0, least=0.0, most=MAX_LENGTH_MM),
        dynamics=_dynamics(table.table("dynamics")),
    )
    table.done()
    return found


def _dynamics(table: Table | None) -> Dynamics | None:
    if table is None:
        return None
    centre = table.numbers("centre_mm", 3, *[] if table.peek("mass_kg") else [(0.0,) * 3])
    return toml_section.read(Dynamics, table, centre_mm=centre, inertia_kg_m2=_inertia(table))


def _inertia(table: Table) -> tuple[float, ...]:
    return table.numbers("inertia_kg_m2", 6, (0.0,) * 6)


def loads(top: Table) -> tuple[Load, ...]:
    """The tables [load.NAME]."""
    return tuple(
        toml_section.read(
            Load,
            table,
            name=name,
            centre_mm=table.numbers("centre_mm", 3, (0.0,) * 3),
            inertia_kg_m2=_inertia(table),
        )
        for name, table in outputs_file.named(top, "load")
    )


def _home(table: Table, low: float, high: float) -> float:
    if table.has("fixed_deg"):
        return (low + high) / 2
    return table.number("home_deg", min(max(0.0, low), high), least=low, most=high)


def _locked(table: Table) -> tuple[float, float]:
    """The narrow range of a joint that ``fixed_deg`` locks."""
    angle = table.number("fixed_deg", least=1 - MAX_ANGLE_DEG, most=MAX_ANGLE_DEG - 1)
    table.known("range_deg", "limits")
    for key in ("motor", "home_deg"):
        if table.has(key):
            raise table.misplaced(key, "leave it out: fixed_deg locks the joint")
    return angle - _LOCKED_DEG, angle + _LOCKED_DEG


def _limits(table: Table | None) -> Limits | None:
    return toml_section.read(Limits, table) if table else None


def _motor(table: Table | None) -> Motor | None:
    if table is None:
        return None
    table.known("curve_rpm_nm")
    curve: Any = table.array("curve_rpm_nm", CURVE) if table.has("curve_rpm_nm") else ()
    if not fits(curve, Curve) or not is_curve(curve):
        raise table.fail("curve_rpm_nm", CURVE)
    return toml_section.read(Motor, table, curve_rpm_nm=tuple((float(rpm), float(nm)) for rpm, nm in curve))


def _encoder(table: Table | None) -> Encoder | None:
    return toml_section.read(Encoder, table) if table else None


def _switches(table: Table | None) -> LimitSwitches:
    if table is None:
        return LimitSwitches()
    switches = LimitSwitches(
        low=_switch(table, "low"),
        high=_switch(table, "high"),
        active=table.choice("active", ("low", "high"), "low"),
        low_deg=_angle(table, "low_deg"),
        high_deg=_angle(table, "high_deg"),
    )
    table.done()
    return switches


def _switch(table: Table, key: str) -> int | str | None:
    if table.is_text(key):
        return outputs_file.pin(table, key, "an input from 1 to 3, or a free pin such as PD0 for homing only")
    return table.integer(key, least=1, most=3) if table.has(key) else None


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


def _model(table: Table | None) -> JointModel:
    return toml_section.read(JointModel, table) if table else JointModel()
