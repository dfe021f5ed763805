"""``armtempo ik``: all inverse solutions of a pose, and why some are not to be had."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import options

if TYPE_CHECKING:
    from collections.abc import Iterable

    from armtempo.arrays import Array
    from armtempo.kinematics.listing import Answer
    from armtempo.model.arm import Arm

Three = tuple[float, float, float]
Four = tuple[float, float, float, float]


@click.command()
@options.arm
@click.option("--matrix", metavar="NUMBERS", help="12 or 16 numbers in quotes: its rows, lengths in mm.")
@click.option("--position", type=float, nargs=3, metavar="X Y Z", help="Tool position in mm.")
@click.option("--rpy", type=float, nargs=3, metavar="R P Y", help="Roll, pitch, yaw in deg.")
@click.option("--quaternion", type=float, nargs=4, metavar="W X Y Z", help="Orientation instead of --rpy.")
@click.option(
    "--poses",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="One pose a line: x y z and roll pitch yaw or a quaternion, or 12 or 16 numbers of a matrix.",
)
@click.option(
    "--previous",
    metavar="ANGLES",
    help="Posture to stay near to, all joints in deg, in quotes; without it the arm's home. "
    "With --poses each pose follows the one before.",
)
@click.option("--numerical", is_flag=True, help="Search one solution numerically, whatever the arm.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def command(
    arm_path: Path | None,
    matrix: str | None,
    position: Three | None,
    rpy: Three | None,
    quaternion: Four | None,
    poses: Path | None,
    previous: str | None,
    numerical: bool,
    as_json: bool,
) -> None:
    """Print all solutions of the inverse kinematics for a pose, or for each pose of a file.

    The solution marked * is the one nearest to the previous posture within the joint ranges. An arm outside
    the class of the closed form gets the one solution that a numerical search finds. Exit code 1 if a pose
    has no solution.
    """
    from armtempo.kinematics import Geometry, Ranges
    from armtempo.kinematics.listing import answers
    from armtempo.kinematics.shape import refusals

    targets = _targets(matrix, position, rpy, quaternion, poses)
    arm = options.load_arm(arm_path)
    geometry = Geometry.of(arm)
    reasons = refusals(geometry)
    found = answers(geometry, Ranges.of(arm), targets, _posture(previous, arm), numerical or bool(reasons))
    show = _print_json if as_json else _print_text
    show(arm.name, reasons, found)


def _targets(
    matrix: str | None, position: Three | None, rpy: Three | None, quaternion: Four | None, poses: Path | None
) -> list[Array]:
    """The poses of the options; UsageError where they do not make exactly one of the three forms."""
    from armtempo.kinematics import pose_file
    from armtempo.model import pose

    forms = [matrix is not None, position is not None, poses is not None]
    if sum(forms) != 1:
        raise click.UsageError("give one of --matrix, --position or --poses")
    if (rpy is not None) + (quaternion is not None) != (position is not None):
        raise click.UsageError("--position goes with one of --rpy and --quaternion, and they with it")
    if poses is not None:
        return pose_file.read(poses)
    if matrix is not None:
        return [pose_file.parse(matrix, "--matrix", (12, 16))]
    assert position is not None
    if quaternion is not None:
        return [pose.from_quaternion(position, quaternion, "--position --quaternion")]
    assert rpy is not None
    return [pose.from_rpy(position, rpy, "--position --rpy")]


def _posture(previous: str | None, arm: Arm) -> Array:
    """The posture to stay near to, in rad: (joints,)."""
    import numpy as np

    from armtempo.errors import InputError
    from armtempo.kinematics.pose_file import numbers

    if previous is None:
        return np.radians([joint.home_deg for joint in arm.joints])
    angles = numbers(previous, "--previous")
    if len(angles) != len(arm.joints):
        raise InputError(f"--previous: {len(angles)} angles given, the arm has {len(arm.joints)} joints")
    return np.radians(angles)


def _print_text(_: str, reasons: list[str], found: Iterable[Answer]) -> None:
    if reasons:
        click.echo(f"no closed form for this arm: {'; '.join(reasons)}")
    without = []
    for number, answer in enumerate(found, 1):
        click.echo("\n".join((f"pose {number}: {answer.text[0]}", *answer.text[1:])))
        if answer.angles_rad is None:
            without.append(number)
    _fail(without)


def _print_json(name: str, reasons: list[str], found: Iterable[Answer]) -> None:
    import json

    results = list(found)
    values = {"arm": name, "no_closed_form": reasons, "poses": [answer.values for answer in results]}
    click.echo(json.dumps(values, indent=1))
    _fail([number for number, answer in enumerate(results, 1) if answer.angles_rad is None])


def _fail(without: list[int]) -> None:
    """End with exit code 1 where poses are left without a solution."""
    from armtempo.errors import PlanError

    if without:
        which = ", ".join(map(str, without))
        raise PlanError(f"no solution for pose {which}; the reasons are listed with it")
