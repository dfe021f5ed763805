"""Where every frame of an arm stands for given angles: as a table to read and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.formats.text_table import aligned
from armtempo.kinematics.forward import all_frames
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.listing import tool_values
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.rejection import out_of_range
from armtempo.model.arm import Arm
from armtempo.model.pose import to_quaternion, to_rpy_deg


def lines(arm: Arm, angles_deg: Array) -> Iterator[str]:
    """Write the table for the angles of all joints, (joints,): one row a frame, then the tool's pose."""
    frames = all_frames(Geometry.of(arm), np.radians(angles_deg).tolist())
    yield f"{arm.name} at {' '.join(_number(angle) for angle in angles_deg)} deg"
    rows = [["frame", "x", "y", "z", "roll", "pitch", "yaw"], ["", "mm", "mm", "mm", "deg", "deg", "deg"]]
    for name, frame in zip(_names(arm), frames, strict=True):
        rows.append([name, *(_number(value) for value in (*frame[:3, 3], *to_rpy_deg(frame)))])
    yield from aligned(rows, (8, *(12,) * 6))
    yield "tool as a matrix, lengths in mm:"
    for row in frames[-1]:
        yield "".join(f"{round(value, 6) + 0.0:14.6f}" for value in row)
    yield "tool as a quaternion w x y z: " + " ".join(f"{value:.8f}" for value in to_quaternion(frames[-1]))
    for reason in _outside(arm, angles_deg):
        yield f"note: {reason}"


def values(arm: Arm, angles_deg: Array) -> dict[str, Any]:
    """Give the same as JSON values."""
    frames = all_frames(Geometry.of(arm), np.radians(angles_deg).tolist())
    return {
        "arm": arm.name,
        "angles_deg": angles_deg.tolist(),
        "tool": {**tool_values(frames[-1]), "quaternion": list(to_quaternion(frames[-1]))},
        "frames": [
            {"name": name, **tool_values(frame)} for name, frame in zip(_names(arm), frames, strict=True)
        ],
        "out_of_range": _outside(arm, angles_deg),
    }


def _names(arm: Arm) -> list[str]:
    names = ["base", *(joint.name for joint in arm.joints)]
    return [*names[:-1], f"{names[-1]} (tool)"]


def _outside(arm: Arm, angles_deg: Array) -> list[str]:
    return [each.text for each in out_of_range(Ranges.of(arm), np.radians(angles_deg).tolist())]


def _number(value: float) -> str:
    return f"{round(value, 4) + 0.0:.4f}"
