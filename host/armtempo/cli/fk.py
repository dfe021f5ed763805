"""``armtempo fk``: the poses of the tool and of every frame for given joint angles, as a table or as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.text import aligned
from armtempo.cli import chosen, options, posture, results
from armtempo.kinematics.chain import spread_deg
from armtempo.kinematics.forward import all_frames
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.listing import tool_values
from armtempo.kinematics.pose_file import numbers
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.rejection import out_of_range
from armtempo.model.arm import Arm
from armtempo.model.pose import to_quaternion, to_rpy_deg


@click.command("fk", cls=options.TakesNumbers)
@click.argument("where", nargs=-1)
@options.job
@options.arm
@options.altered
@options.as_json
def fk(
    where: tuple[str, ...], job_path: Path | None, arm_path: Path | None, altered: bool, as_json: bool
) -> None:
    """Print the tool's pose and every frame for given joint angles.

    WHERE: angles in degrees ('0,-60,40', or as separate numbers), of all joints or of those with a motor (the
    others are at their home angles); a posture of the arm file; a via point such as P0; or a trajectory file
    (its start). Default: 'home'. Compare the frames with the real arm to find a wrong row.
    """
    if len(where) == 1 and posture.is_via(where[0]):
        arm, job = chosen.arm_and_job(arm_path, job_path)
        angles_deg = spread_deg(arm, posture.via_deg(where[0], arm, job).tolist())
    elif len(where) == 1 and posture.is_named(where[0]):
        wanted = posture.NamedPosture.of(where[0], arm_path, altered)
        arm = wanted.arm or chosen.arm_or_paper(arm_path, for_shape=True)
        angles_deg = spread_deg(arm, wanted.angles_deg(arm, job_path).tolist())
    else:
        arm = chosen.arm_or_paper(arm_path, for_shape=True)
        angles_deg = _angles(where, arm)
    if as_json:
        results.show_json(_values(arm, angles_deg))
    else:
        click.echo("\n".join(_lines(arm, angles_deg)))


def _angles(where: tuple[str, ...], arm: Arm) -> Array:
    """Angles of all joints, deg (joints,)."""
    if not where:
        return spread_deg(arm, arm.all_home_deg)
    return spread_deg(arm, numbers(" ".join(where), "the angles"))


def _lines(arm: Arm, angles_deg: Array) -> Iterator[str]:
    """The table for the angles of all joints, (joints,): one row per frame, then the tool's pose."""
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


def _values(arm: Arm, angles_deg: Array) -> dict[str, Any]:
    """The same as JSON values."""
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
