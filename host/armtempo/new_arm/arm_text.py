"""The arm file of an imported chain, as TOML text."""

from __future__ import annotations

import json
import math
from dataclasses import fields
from pathlib import Path

import numpy as np
from armtempo_shared.limits import MAX_ENCODERS, MAX_JOINTS

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.kinematics import all_frames
from armtempo.model.joint_unit import DEG, PRISMATIC, JointUnit
from armtempo.model.parts import Dynamics
from armtempo.new_arm import urdf_meshes
from armtempo.new_arm.urdf_chain import Chain, ChainJoint
from armtempo.new_arm.urdf_fitting import Fit
from armtempo.new_arm.urdf_rows import DhRow, geometry

_STILL_DEG = 0.001
"""Half the range of a constant row, as an arm file requires a range."""

_HEAD = """\
# Imported from {source}, robot {robot}: from link {base} to link {tip}.
# Checked against the URDF's own forward kinematics at {postures} random postures within the ranges: worst errors
# {position_mm:.2g} mm and {rotation_deg:.2g} degrees. Joint angles are those of the URDF, in degrees{and_mm}.
#
# A URDF says nothing of motors, gears, encoders and wiring. Before the arm can be planned for:
# 1. Take the '#' off the motor and limits lines of each driven joint and put its own figures in
#    (the acceleration and jerk given are slow guesses).
# 2. armtempo check --arm THIS_FILE says what is missing or looks wrong.
name = {robot}
"""

_MOTOR = """\
# limits = {{ speed_deg_s = {speed:g}, acceleration_deg_s2 = 30.0, jerk_deg_s3 = 120.0 }}{speed_source}
# motor = {{ channel = {channel}, steps_per_rev = 200, microsteps = 16, gear_ratio = 1.0 }}  # put in your own
"""
_SLIDE_MOTOR = """\
# limits = {{ speed_mm_s = {speed:g}, acceleration_mm_s2 = 100.0, jerk_mm_s3 = 500.0 }}{speed_source}
# motor = {{ channel = {channel}, steps_per_rev = 200, microsteps = 16, mm_per_rev = 8.0 }}  # put in your own
"""
_ENCODER = """\
# encoder = {{ channel = {channel}, counts_per_rev = 4000, on = "joint", {following} = 2.0 }}  # if fitted
"""
_NO_CHANNEL = f"# The board drives {MAX_JOINTS} joints: lock this one or another, by fixed_deg = ANGLE.\n"


def arm_text(chain: Chain, fit: Fit, urdf: Path) -> str:
    """The arm file for ``chain`` in a file, with the rows of ``fit``; without radii if a mesh cannot be read."""
    radii_mm, unread = {}, ""
    try:
        radii_mm = urdf_meshes.radii_mm(chain, fit, urdf)
    except InputError as error:
        unread = f"# No link has a radius_mm, as not all shapes are known: {_one_line(error.problem)}\n"
    head = _HEAD.format(
        source=_text(urdf.name),
        robot=_text(_one_line(chain.robot) or "imported arm"),
        base=_text(chain.base),
        tip=_text(chain.tip),
        postures=fit.postures,
        and_mm=", positions of sliding joints in mm" if chain.sliding else "",
        position_mm=fit.position_mm,
        rotation_deg=fit.rotation_deg,
    )
    frames = all_frames(geometry(fit.rows), [0.0] * len(fit.rows))
    rows = [
        _joint(row, chain, frame, number == 1, radii_mm.get(number))
        for number, (row, frame) in enumerate(zip(fit.rows, frames[1:], strict=True), 1)
    ]
    return "\n".join([unread + head, *rows, *_couplings(chain)])


def notes(chain: Chain, file: Path | str) -> list[str]:
    """What is doubtful or changed in the arm of a URDF that is written into an arm file."""
    found = [f"{doubt} A URDF has radians; correct it, or the joint in {file}" for doubt in chain.doubts]
    found += [*chain.narrowed, *chain.unclear]
    if chain.couplings:
        found.append(
            f"the URDF's transmissions couple joints: [coupling] in {file} is to be used with the motors"
        )
    return found


def _couplings(chain: Chain) -> list[str]:
    """The table [coupling], to be used with the motors; no text without couplings."""
    if not chain.couplings:
        return []
    lines = [
        "# Motors that turn joints together, by the URDF's transmissions: take the '#' off with that of their motors.",
        "# A negative gear_ratio means direction = -1.",
        "# [coupling]",
    ]
    names = {joint.name: _joint_name(chain, number) for number, joint in enumerate(chain.joints)}
    for coupling in chain.couplings:
        keys = [_text(names[joint]) for joint in coupling.joints]
        for key, row, ratio in zip(keys, coupling.rows, coupling.gear_ratios, strict=True):
            entries = ", ".join(f"{of} = {factor!r}" for of, factor in zip(keys, row, strict=True) if factor)
            lines.append(f"# {key} = {{ {entries} }}  # of {_text(coupling.name)}; gear_ratio = {ratio:g}")
    return ["\n".join(lines) + "\n"]


def _joint_name(chain: Chain, number: int) -> str:
    return _one_line(chain.joints[number].name) or f"joint {number + 1}"


def _joint(row: DhRow, chain: Chain, frame: Array, first: bool, radius_mm: float | None) -> str:
    """The table of a row; ``frame``: the frame after the row, all joints at 0."""
    if row.joint is None:
        name = "base" if first else "tool"
        return _row_text(
            name, row, (-_STILL_DEG, _STILL_DEG), "a constant row: it never moves", radius_mm, DEG
        )
    joint = chain.joints[row.joint]
    name = _joint_name(chain, row.joint)
    if joint.is_linked:
        note = "a linkage keeps its direction: it mimics the joint before"
        text = (
            _row_text(name, row, (-_STILL_DEG, _STILL_DEG), note, radius_mm, DEG)
            + "parallel_linkage = true\n"
        )
    else:
        note = "continuous in the URDF: widen it if the cables allow" if joint.continuous else ""
        if joint.narrowed_by:
            note = f"by {_one_line(joint.narrowed_by)}"
        text = _row_text(name, row, _inside(joint.range_deg), note, radius_mm, joint.unit)
    if any(each.body for each in chain.joints):
        text += _dynamics(joint.body.in_frame(frame) if joint.body else Dynamics(0.0), joint.unit)
    if joint.is_linked:
        return text
    return text + _placeholders(row.joint + 1 - sum(linked < row.joint for linked in chain.linked), joint)


def _dynamics(body: Dynamics, unit: JointUnit) -> str:
    keys = (
        field.name
        for field in fields(body)
        if field.name in ("mass_kg", "centre_mm") or np.any(getattr(body, field.name))
    )
    given = ((key if key.startswith("inertia") else unit.key(key), getattr(body, key)) for key in keys)
    return f"dynamics = {{ {', '.join(f'{key} = {_digits(value)}' for key, value in given)} }}\n"


def _digits(value: float | tuple[float, ...]) -> str:
    """A number, or a list of numbers, with the significant digits."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_digits, value))}]"
    return repr(float(f"{value:.7g}") + 0.0)


def _row_text(
    name: str,
    row: DhRow,
    range_deg: tuple[float, float],
    note: str,
    radius_mm: float | None,
    unit: JointUnit,
) -> str:
    lines = ["[[joint]]", f"name = {_text(name)}"]
    if unit is not DEG:
        lines.append(f'type = "{PRISMATIC}"')
    values = {
        "d_mm": row.d_mm,
        "a_mm": row.a_mm,
        "alpha_deg": row.alpha_deg,
        "theta_offset_deg": row.theta_deg,
    }
    lines += [f"{key} = {value!r}" for key, value in values.items()]
    if radius_mm:
        lines.append(
            f"radius_mm = {math.ceil(10.0 * radius_mm) / 10.0!r}  # about d and a: all collision shapes"
        )
    low, high = range_deg
    lines.append(f"{unit.key('range_deg')} = [{low!r}, {high!r}]" + (f"  # {note}" if note else ""))
    lines.append(f"{unit.key('home_deg')} = {0.0 if low <= 0.0 <= high else round((low + high) / 2, 1)!r}")
    return "\n".join(lines) + "\n"


def _placeholders(channel: int, joint: ChainJoint) -> str:
    if channel > MAX_JOINTS:
        return _NO_CHANNEL
    speed = joint.speed_deg_s
    motor = (_SLIDE_MOTOR if joint.slides else _MOTOR).format(
        speed=20.0 if speed is None else round(speed, 3),
        speed_source="" if speed is None else "  # the speed is the URDF's",
        channel=channel,
    )
    return motor + (
        _ENCODER.format(channel=channel, following=joint.unit.key("following_error_deg"))
        if channel <= MAX_ENCODERS
        else ""
    )


def _inside(range_deg: tuple[float, float]) -> tuple[float, float]:
    """The range with four decimals, rounded inwards."""
    low, high = range_deg
    return math.ceil(low * 1e4 - 0.01) / 1e4 + 0.0, math.floor(high * 1e4 + 0.01) / 1e4 + 0.0


def _one_line(name: str) -> str:
    """A name for an arm file: unprintable characters become blanks."""
    return "".join(character if character.isprintable() else " " for character in name).strip()


def _text(text: str) -> str:
    """A TOML string, on one line whatever is in it."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
