"""``armtempo ik`` and ``fk``: all inverse solutions of a pose; the poses of the tool and of every frame."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.atomic_file import os_reason
from armtempo.basics.errors import InputError, PlanError
from armtempo.basics.text import aligned
from armtempo.cli import options, posture, resolve, results, typed_pose
from armtempo.cli.results import show_json
from armtempo.cli.typed_pose import TypedPose
from armtempo.kinematics.chain import spread_deg
from armtempo.kinematics.forward import all_frames
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.listing import Listing, listings, tool_values
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.rejection import out_of_range
from armtempo.kinematics.solver import PoseSolver
from armtempo.model.arm import Arm
from armtempo.model.pose import LARGEST, checked, from_quaternion, to_quaternion, to_rpy_deg
from armtempo.model.tool_pose import BASE, WHOLE, Pose


@click.command("ik")
@options.arm
@click.option("--matrix", metavar="NUMBERS", help="12 or 16 numbers in quotes: its rows, lengths in mm.")
@typed_pose.options
@options.frame
@options.tool
@options.file(
    "--poses",
    help="One pose per line: x y z alone, with roll pitch yaw (- if free) or a quaternion, or 12 or 16 "
    "numbers of a matrix.",
)
@click.option(
    "--tolerance-mm",
    type=options.FiniteRange(1e-6, 1000.0),
    help="Distance at which the position counts as reached.  [default: 0.1]",
)
@click.option(
    "--tolerance-deg",
    type=options.FiniteRange(1e-6, 180.0),
    help="The same for the orientation.  [default: 0.1]",
)
@click.option(
    "--previous",
    metavar="ANGLES",
    help="Posture to stay near to, all joints in deg (sliding ones in mm), in quotes; default: the arm's home. "
    "With --poses it is the posture of the pose before.",
)
@click.option("--numerical", is_flag=True, help="Use the numerical search even if the arm has a closed form.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def ik(
    arm_path: Path | None,
    matrix: str | None,
    poses: Path | None,
    frame: str,
    tool: str | None,
    previous: str | None,
    numerical: bool,
    as_json: bool,
    tolerance_mm: float | None,
    tolerance_deg: float | None,
    **given: Any,
) -> None:
    """Print all solutions of the inverse kinematics for a pose.

    Of a pose, or of each pose of a file. The solution marked * is the one nearest to the previous posture within
    the joint ranges. A pose with free components, or an arm without a closed form, is solved by a numerical search
    over the joints that have a motor. Exit code 1 if a pose has no solution.
    """
    found_poses = _poses(matrix, poses, TypedPose(**given))
    solver = PoseSolver(resolve.arm_or_paper(arm_path, for_shape=True).with_tool(tool))
    in_base = [solver.arm.in_base(pose, frame) for pose in found_poses]
    wanted = [_within(pose, tolerance_mm, tolerance_deg) for pose in in_base]
    found = listings(solver, wanted, _posture(previous, solver), numerical)
    show = _print_json if as_json else _print_text
    show(solver, found)


def _within(pose: Pose, tolerance_mm: float | None, tolerance_deg: float | None) -> Pose:
    """The pose with the given tolerances."""
    if tolerance_mm is not None:
        pose = replace(pose, tolerance_mm=tolerance_mm)
    return pose if tolerance_deg is None else replace(pose, tolerance_deg=tolerance_deg)


def _poses(matrix: str | None, poses: Path | None, typed: TypedPose) -> list[Pose]:
    """The poses of the options; raises InputError unless exactly one of the three forms is given."""
    if sum(form is not None for form in (matrix, typed.position, poses)) != 1:
        raise InputError(
            "no pose, or more than one, is given", "give one of --matrix, --position and --poses"
        )
    if (pose := typed.pose()) is not None:
        return [pose]
    if poses is not None:
        return read(poses)
    assert matrix is not None
    return [parse(matrix, "--matrix", (12, 16))]


def _posture(previous: str | None, solver: PoseSolver) -> Sequence[float]:
    """The posture to stay near to, in rad: (joints,)."""
    if previous is None:
        return solver.home_rad
    angles = numbers(previous, "--previous")
    if len(angles) != len(solver.home_rad):
        raise InputError(
            f"--previous: {len(angles)} {solver.arm.texts.position}s given, the arm has "
            f"{len(solver.home_rad)} joints",
            f"give one {solver.arm.texts.position} for each joint, base first",
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
@options.frame
@options.tool
@options.job
@options.arm
@options.altered
@options.as_json
def fk(
    where: tuple[str, ...],
    frame: str,
    tool: str | None,
    job_path: Path | None,
    arm_path: Path | None,
    altered: bool,
    as_json: bool,
) -> None:
    """Print the tool's pose and every frame for joint angles.

    WHERE: angles in degrees ('0,-60,40', or as separate numbers; of sliding joints mm), of all joints or of those
    with a motor (the others are at their home angles); a posture of the arm file; a via point such as P0; or a
    trajectory file (its start). Default: 'home'. Compare the frames with the real arm to find a wrong row.
    """
    if len(where) == 1 and posture.is_via(where[0]):
        arm, job = resolve.arm_and_job(arm_path, job_path)
        arm = arm.with_tool(job.tool)
        angles_deg = spread_deg(arm, posture.via_deg(where[0], arm, job).tolist())
    elif len(where) == 1 and posture.is_named(where[0]):
        wanted = posture.NamedPosture.of(where[0], arm_path, altered)
        arm = wanted.arm or resolve.arm_or_paper(arm_path, for_shape=True)
        angles_deg = spread_deg(arm, wanted.angles_deg(arm, job_path).tolist())
    else:
        arm = resolve.arm_or_paper(arm_path, for_shape=True)
        angles_deg = _angles(where, arm)
    arm = arm.with_tool(tool)
    if as_json:
        results.show_json(_values(arm, angles_deg, frame))
    else:
        results.echo("\n".join(_lines(arm, angles_deg, frame)))


def _angles(where: tuple[str, ...], arm: Arm) -> Array:
    """Angles of all joints, deg (joints,)."""
    if not where:
        return spread_deg(arm, arm.all_home_deg)
    return spread_deg(arm, numbers(" ".join(where), "the angles"))


def _frames(arm: Arm, angles_deg: Array, frame: str) -> Array:
    """The rows' frames at the angles of all joints, (joints,), in a frame of the arm: (joints + 1, 4, 4)."""
    return np.asarray(
        np.linalg.inv(arm.frame(frame)) @ all_frames(Geometry.of(arm), np.radians(angles_deg).tolist())
    )


def _lines(arm: Arm, angles_deg: Array, frame: str) -> Iterator[str]:
    """The table for the angles of all joints, (joints,): one row per frame, then the tool's pose."""
    frames = _frames(arm, angles_deg, frame)
    seen = "" if frame == BASE else f", in frame {frame}"
    at = [_number(angle) for angle in angles_deg]
    if arm.slides:
        at = [f"{value} {joint.unit.name}," for value, joint in zip(at, arm.joints, strict=True)]
    yield f"{arm.name} at {' '.join(at).removesuffix(',')}{'' if arm.slides else ' deg'}{seen}"
    rows = [["frame", "x", "y", "z", "roll", "pitch", "yaw"], ["", "mm", "mm", "mm", "deg", "deg", "deg"]]
    for name, row in zip(_names(arm), frames, strict=True):
        rows.append([name, *(_number(value) for value in (*row[:3, 3], *to_rpy_deg(row)))])
    yield from aligned(rows, (8, *(12,) * 6))
    yield "tool as a matrix, lengths in mm:"
    for numbers_of_row in frames[-1]:
        yield "".join(f"{round(value, 6) + 0.0:14.6f}" for value in numbers_of_row)
    yield "tool as a quaternion w x y z: " + " ".join(f"{value:.8f}" for value in to_quaternion(frames[-1]))
    for reason in _outside(arm, angles_deg):
        yield f"note: {reason}"


def _values(arm: Arm, angles_deg: Array, frame: str) -> dict[str, Any]:
    """The same as JSON values."""
    frames = _frames(arm, angles_deg, frame)
    return {
        "arm": arm.name,
        "frame": frame,
        arm.texts.list_key("angles_deg"): angles_deg.tolist(),
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


# a file of poses
FORMS = {
    3: "x y z: position only",
    6: "x y z roll pitch yaw, with - for an angle that is free",
    7: "x y z and quaternion w x y z",
    12: "3 rows of a matrix",
    16: "4 rows of a matrix",
}
"""How many numbers make a pose."""

FREE = "-"


def read(path: Path | str) -> list[Pose]:
    """Return the poses of a file; InputError names the file and the line that is wrong."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path}: cannot be read as text ({os_reason(error)})",
            "check the path, and that it is plain text in UTF-8",
        ) from error
    poses = []
    for number, line in enumerate(text.splitlines(), 1):
        content = line.split("#")[0]
        if content.strip():
            poses.append(parse(content, f"{path}, line {number}"))
    if not poses:
        raise InputError(f"{path}: no pose in it", "write one a line, for instance: x y z roll pitch yaw")
    return poses


def parse(text: str, what: str, counts: tuple[int, ...] = tuple(FORMS)) -> Pose:
    """Return the pose that ``text`` writes in as many numbers as ``counts`` allows."""
    words = text.replace(",", " ").split()
    if len(words) not in counts:
        allowed = ", ".join(f"{count} ({FORMS[count]})" for count in counts)
        raise InputError(f"{what}: {len(words)} numbers are not a pose", f"give {allowed}")
    if len(words) in (3, 6):
        position = numbers(" ".join(words[:3]), what)
        fixed = {name: word for name, word in zip(WHOLE, words[3:], strict=False) if word != FREE}
        angles = dict(zip(fixed, numbers(" ".join(fixed.values()), what), strict=True))
        return Pose.of_angles(position, angles, what)
    found = numbers(text, what)
    if len(words) == 7:
        return Pose.of_matrix(from_quaternion(found[:3], found[3:], what))
    return Pose.of_matrix(checked(np.reshape(found, (-1, 4)), what))


def numbers(text: str, what: str) -> list[float]:
    """Return the numbers of ``text``, separated by blanks or commas; InputError for anything else."""
    found = []
    for word in text.replace(",", " ").split():
        try:
            found.append(float(word))
        except ValueError:
            raise InputError(f"{what}: {word!r} is not a number", "write it like 12.5 or 1e-3") from None
        if not abs(found[-1]) <= LARGEST:
            raise InputError(
                f"{what}: {word!r} is not a finite number of at most {LARGEST:g}",
                "correct it; units are mm and degrees",
            )
    return found
