"""``armtempo ik`` and ``fk``: all inverse solutions of a pose; the poses of the tool and of every frame."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, PlanError
from armtempo.basics.text import aligned
from armtempo.cli import options, posture, resolve, results
from armtempo.cli.results import show_json
from armtempo.kinematics import pose_file
from armtempo.kinematics.chain import spread_deg
from armtempo.kinematics.forward import all_frames
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.listing import Listing, listings, tool_values
from armtempo.kinematics.pose_file import numbers
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.rejection import out_of_range
from armtempo.kinematics.solver import PoseSolver
from armtempo.model.arm import Arm
from armtempo.model.pose import from_quaternion, to_quaternion, to_rpy_deg
from armtempo.model.tool_pose import Pose

Three = tuple[float, float, float]
Four = tuple[float, float, float, float]


@dataclass(frozen=True)
class _Given:
    """The options that describe the pose."""

    matrix: str | None
    position: Three | None
    rpy: Three | None
    quaternion: Four | None
    roll: float | None
    pitch: float | None
    yaw: float | None
    approach: Three | None
    poses: Path | None


@click.command("ik")
@options.arm
@click.option("--matrix", metavar="NUMBERS", help="12 or 16 numbers in quotes: its rows, lengths in mm.")
@click.option(
    "--position",
    type=float,
    nargs=3,
    metavar="X Y Z",
    help="Tool position in mm; alone, or with an orientation.",
)
@click.option(
    "--rpy", type=float, nargs=3, metavar="R P Y", help="Roll, pitch, yaw in deg: the whole orientation."
)
@click.option("--quaternion", type=float, nargs=4, metavar="W X Y Z", help="The same as a quaternion.")
@click.option(
    "--roll", type=float, metavar="DEG", help="Roll in deg; alone or with the pitch (the rest is free)."
)
@click.option(
    "--pitch", type=float, metavar="DEG", help="Pitch in deg; alone or with roll or yaw, the rest is free."
)
@click.option(
    "--yaw", type=float, metavar="DEG", help="Yaw in deg; alone or with the pitch, the rest is free."
)
@click.option(
    "--approach",
    type=float,
    nargs=3,
    metavar="X Y Z",
    help="Direction of the tool's z axis; rotation about it is free.",
)
@options.file(
    "--poses",
    help="One pose per line: x y z alone, with roll pitch yaw (- if free) or a quaternion, or 12 or 16 "
    "numbers of a matrix.",
)
@click.option(
    "--tolerance-mm",
    type=click.FloatRange(1e-6, 1000.0),
    help="Distance at which the position counts as reached.  [default: 0.1]",
)
@click.option(
    "--tolerance-deg",
    type=click.FloatRange(1e-6, 180.0),
    help="The same for the orientation.  [default: 0.1]",
)
@click.option(
    "--previous",
    metavar="ANGLES",
    help="Posture to stay near to, all joints in deg, in quotes; default: the arm's home. "
    "With --poses it is the posture of the pose before.",
)
@click.option("--numerical", is_flag=True, help="Use the numerical search even if the arm has a closed form.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def ik(
    arm_path: Path | None,
    previous: str | None,
    numerical: bool,
    as_json: bool,
    tolerance_mm: float | None,
    tolerance_deg: float | None,
    **given: Any,
) -> None:
    """Print all solutions of the inverse kinematics for a pose, or for each pose of a file.

    The solution marked * is the one nearest to the previous posture within the joint ranges. A pose with free
    components, or an arm without a closed form, is solved by a numerical search over the joints that have a
    motor. Exit code 1 if a pose has no solution.
    """
    wanted = [_within(pose, tolerance_mm, tolerance_deg) for pose in _poses(_Given(**given))]
    solver = PoseSolver(resolve.arm_or_paper(arm_path, for_shape=True))
    found = listings(solver, wanted, _posture(previous, solver), numerical)
    show = _print_json if as_json else _print_text
    show(solver, found)


def _within(pose: Pose, tolerance_mm: float | None, tolerance_deg: float | None) -> Pose:
    """The pose with the given tolerances."""
    if tolerance_mm is not None:
        pose = replace(pose, tolerance_mm=tolerance_mm)
    return pose if tolerance_deg is None else replace(pose, tolerance_deg=tolerance_deg)


def _poses(given: _Given) -> list[Pose]:
    """The poses of the options; raises InputError unless exactly one of the three forms is given."""
    if sum(form is not None for form in (given.matrix, given.position, given.poses)) != 1:
        raise InputError(
            "no pose, or more than one, is given", "give one of --matrix, --position and --poses"
        )
    angles = {
        name: getattr(given, name) for name in ("roll", "pitch", "yaw") if getattr(given, name) is not None
    }
    orientations = sum(form is not None for form in (given.rpy, given.quaternion, given.approach)) + bool(
        angles
    )
    if orientations > (given.position is not None):
        raise InputError(
            "these options do not describe a pose",
            "--position goes alone or with one of --rpy, --quaternion, --approach, or any of --roll, --pitch and "
            "--yaw; and they go with it",
        )
    if given.poses is not None:
        return pose_file.read(given.poses)
    if given.matrix is not None:
        return [pose_file.parse(given.matrix, "--matrix", (12, 16))]
    return [_positioned(given, angles)]


def _positioned(given: _Given, angles: dict[str, float]) -> Pose:
    """The pose of --position and its orientation options."""
    assert given.position is not None
    if given.quaternion is not None:
        matrix = from_quaternion(given.position, given.quaternion, "--position --quaternion")
        return Pose.of_matrix(matrix)
    if given.approach is not None:
        return Pose.of_approach(given.position, given.approach, "--approach")
    if given.rpy is not None:
        angles = dict(zip(("roll", "pitch", "yaw"), given.rpy, strict=True))
    return Pose.of_angles(given.position, angles, " ".join(("--position", *(f"--{name}" for name in angles))))


def _posture(previous: str | None, solver: PoseSolver) -> Sequence[float]:
    """The posture to stay near to, in rad: (joints,)."""
    if previous is None:
        return solver.home_rad
    angles = numbers(previous, "--previous")
    if len(angles) != len(solver.home_rad):
        raise InputError(
            f"--previous: {len(angles)} angles given, the arm has {len(solver.home_rad)} joints",
            "give one angle for each joint, base first",
        )
    return [math.radians(angle) for angle in angles]


def _print_text(solver: PoseSolver, found: Iterable[Listing]) -> None:
    if solver.refusals:
        results.echo(f"no closed form for this arm: {'; '.join(solver.refusals)}")
    without = []
    for number, listing in enumerate(found, 1):
        results.echo("\n".join((f"pose {number}: {listing.text[0]}", *listing.text[1:])))
        if not listing.success:
            without.append(number)
    _fail(without)


def _print_json(solver: PoseSolver, found: Iterable[Listing]) -> None:
    results = list(found)
    values = {
        "arm": solver.arm.name,
        "no_closed_form": solver.refusals,
        "poses": [listing.values for listing in results],
    }
    show_json(values)
    _fail([number for number, listing in enumerate(results, 1) if not listing.success])


def _fail(without: list[int]) -> None:
    """End with exit code 1 if there are poses without a solution."""
    if without:
        which = ", ".join(map(str, without))
        raise PlanError(
            f"no solution for pose {which}; the reasons are listed with it",
            "move it nearer to the arm, leave orientation components free, or give larger --tolerance-mm and "
            "--tolerance-deg",
        )


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
        arm, job = resolve.arm_and_job(arm_path, job_path)
        angles_deg = spread_deg(arm, posture.via_deg(where[0], arm, job).tolist())
    elif len(where) == 1 and posture.is_named(where[0]):
        wanted = posture.NamedPosture.of(where[0], arm_path, altered)
        arm = wanted.arm or resolve.arm_or_paper(arm_path, for_shape=True)
        angles_deg = spread_deg(arm, wanted.angles_deg(arm, job_path).tolist())
    else:
        arm = resolve.arm_or_paper(arm_path, for_shape=True)
        angles_deg = _angles(where, arm)
    if as_json:
        results.show_json(_values(arm, angles_deg))
    else:
        results.echo("\n".join(_lines(arm, angles_deg)))


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
