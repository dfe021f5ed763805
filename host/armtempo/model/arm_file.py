"""The arm file: an arm described in TOML."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from armtempo_shared.limits import MAX_ENCODERS, MAX_JOINTS

from armtempo.errors import InputError
from armtempo.formats import toml_table
from armtempo.formats.toml_table import Table
from armtempo.model.arm import (
    Arm,
    Driver,
    Encoder,
    Joint,
    JointModel,
    Limits,
    LimitSwitches,
    Motor,
    Safety,
)

MAX_LENGTH_MM = 1e6
"""Longest link that an arm file may describe."""


def default_path() -> Path:
    """The arm file that ships with armtempo: the paper's 1:5 arm."""
    return Path(__file__).parents[1] / "data" / "paper_arm.toml"


def load(path: Path | str) -> Arm:
    """The arm described by a TOML file.

    Raises InputError, naming file, key and value, for anything missing, unknown or not allowed.
    """
    top = toml_table.read(path)
    name = top.text("name")
    driver = _driver(top.table("driver"))
    safety = _safety(top.table("safety"))
    tables = top.tables("joint")
    joints = tuple(_joint(table, number) for number, table in enumerate(tables, 1))
    top.done()
    arm = Arm(name, joints, driver, safety, str(path))
    _check_channels(arm, path)
    return arm


def _driver(table: Table | None) -> Driver:
    if table is None:
        return Driver()
    times = {
        key: table.number(key, getattr(Driver, key), least=0.1, most=500.0)
        for key in ("pulse_us", "low_us", "dir_setup_us", "dir_hold_us")
    }
    active = table.choice("enable_active", ("low", "high"), Driver.enable_active)
    table.done()
    return Driver(**times, enable_active=active)


def _safety(table: Table | None) -> Safety:
    if table is None:
        return Safety()
    safety = Safety(
        estop_fitted=table.boolean("estop_fitted", Safety.estop_fitted),
        estop_active=table.choice("estop_active", ("low", "high"), Safety.estop_active),
        estop_releases_enable=table.boolean("estop_releases_enable", Safety.estop_releases_enable),
        on_link_loss=table.choice("on_link_loss", ("finish", "stop"), Safety.on_link_loss),
        link_timeout_ms=table.integer("link_timeout_ms", Safety.link_timeout_ms, least=200, most=60_000),
    )
    table.done()
    return safety


def _joint(table: Table, number: int) -> Joint:
    low, high = table.numbers("range_deg", 2)
    if not low < high:
        raise table.fail("range_deg", "two angles, the smaller first")
    motor = _motor(table.table("motor"))
    limits = _limits(table.table("limits"))
    if motor is not None and limits is None:
        raise table.fail("limits", "a table with speed_deg_s, acceleration_deg_s2 and jerk_deg_s3")
    encoder = _encoder(table.table("encoder"))
    if encoder is not None and motor is None:
        raise table.fail("motor", "given where there is an encoder")
    joint = Joint(
        name=table.text("name", f"joint {number}"),
        d_mm=table.number("d_mm", least=-MAX_LENGTH_MM, most=MAX_LENGTH_MM),
        a_mm=table.number("a_mm", least=-MAX_LENGTH_MM, most=MAX_LENGTH_MM),
        alpha_deg=table.number("alpha_deg", least=-180.0, most=180.0),
        theta_offset_deg=table.number("theta_offset_deg", 0.0, least=-360.0, most=360.0),
        range_deg=(low, high),
        home_deg=table.number("home_deg", min(max(0.0, low), high), least=low, most=high),
        limits=limits,
        motor=motor,
        encoder=encoder,
        switches=_switches(table.table("switches")),
        model=_model(table.table("model")),
    )
    table.done()
    return joint


def _limits(table: Table | None) -> Limits | None:
    if table is None:
        return None
    limits = Limits(
        speed_deg_s=table.number("speed_deg_s", above=0.0),
        acceleration_deg_s2=table.number("acceleration_deg_s2", above=0.0),
        jerk_deg_s3=table.number("jerk_deg_s3", above=0.0),
    )
    table.done()
    return limits


def _motor(table: Table | None) -> Motor | None:
    if table is None:
        return None
    motor = Motor(
        channel=table.integer("channel", least=1, most=MAX_JOINTS),
        steps_per_rev=table.integer("steps_per_rev", least=4, most=10_000),
        microsteps=table.integer("microsteps", least=1, most=256),
        gear_ratio=table.number("gear_ratio", above=0.0, most=10_000.0),
        direction=table.choice("direction", (1, -1), 1),
    )
    table.done()
    return motor


def _encoder(table: Table | None) -> Encoder | None:
    if table is None:
        return None
    encoder = Encoder(
        channel=table.integer("channel", least=1, most=MAX_ENCODERS),
        counts_per_rev=table.integer("counts_per_rev", least=4, most=10_000_000),
        on=table.choice("on", ("joint", "motor"), "joint"),
        direction=table.choice("direction", (1, -1), 1),
        following_error_deg=table.number("following_error_deg", 0.0, least=0.0, most=360.0),
    )
    table.done()
    return encoder


def _switches(table: Table | None) -> LimitSwitches:
    if table is None:
        return LimitSwitches()
    switches = LimitSwitches(
        low=table.integer("low", least=1, most=3) if table.has("low") else None,
        high=table.integer("high", least=1, most=3) if table.has("high") else None,
        active=table.choice("active", ("low", "high"), "low"),
        low_deg=table.number("low_deg") if table.has("low_deg") else None,
        high_deg=table.number("high_deg") if table.has("high_deg") else None,
    )
    table.done()
    return switches


def _model(table: Table | None) -> JointModel:
    if table is None:
        return JointModel()
    values = {key.name: table.number(key.name, 0.0) for key in fields(JointModel)}
    table.done()
    return JointModel(**values)


def _check_channels(arm: Arm, path: Path | str) -> None:
    if not arm.driven:
        raise InputError(f"{path}: no joint has a motor; at least one [joint.motor] is needed")
    for what, channels in (
        ("motor.channel", [joint.motor.channel for joint in arm.driven]),
        ("encoder.channel", [joint.encoder.channel for joint in arm.driven if joint.encoder]),
    ):
        for channel in channels:
            if channels.count(channel) > 1:
                raise InputError(f"{path}: {what} = {channel} is used by two joints; each needs its own")
