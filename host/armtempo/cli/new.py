"""``armtempo new``: a project folder for an arm of one's own."""

from __future__ import annotations

import sys
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.basics.errors import InputError
from armtempo.cli import options, results

if TYPE_CHECKING:
    from armtempo.new_arm.given_geometry import ArmText
    from armtempo.new_arm.joint_entry import JointEntry

_QUESTIONS = {
    "name": "name",
    "d_mm": "d: offset along the joint's axis to the next, mm",
    "a_mm": "a: length of the link, mm",
    "alpha_deg": "alpha: twist from this joint's axis to the next one's, degrees",
    "theta_offset_deg": "theta offset: angle of the row where the joint stands at 0, degrees",
    "low_deg": "lowest angle, degrees",
    "high_deg": "highest angle, degrees",
    "steps_per_rev": "full steps for a turn of the motor",
    "microsteps": "microsteps of the driver",
    "gear_ratio": "motor turns for a turn of the joint",
    "encoder_counts": "encoder counts for a turn of the joint, all edges (0: none)",
}


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--like", metavar="ARM", help="Begin with an arm that ships, such as ar4.")
@click.option(
    "--urdf",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Begin with the arm of a URDF. Needs the extra 'urdf'.",
)
@click.option(
    "--joint",
    "joints",
    multiple=True,
    metavar="KEY=VALUE,…",
    help="A joint of an own arm, base first; give one for each: name, d_mm, a_mm, alpha_deg, theta_offset_deg, "
    "low_deg, high_deg, steps_per_rev, microsteps, gear_ratio, speed_deg_s, encoder_counts.",
)
@click.option("--port", default=None, help="Port of the board; 'sim:board' is a virtual one.", metavar="PORT")
@options.as_json
def command(
    folder: Path,
    like: str | None,
    urdf: Path | None,
    joints: tuple[str, ...],
    port: str | None,
    as_json: bool,
) -> None:
    """Make a project folder: arm file, first job, settings, and a page with the next commands.

    Asks for what no option says, if there is somebody at the terminal to ask.
    """
    from armtempo.new_arm import folder as project_folder

    if sum(map(bool, (like, urdf, joints))) > 1:
        raise InputError("--like, --urdf and --joint exclude each other", "give one of them")
    asked = _asked() and not as_json
    if not (like or urdf or joints):
        if not asked:
            raise InputError("which arm?", "give --like ARM, --urdf FILE, or a --joint for each joint")
        arm = _ask_arm(folder.name)
    else:
        arm = _given_arm(folder.name, like, urdf, joints)
    if port is None:
        port = click.prompt("port of the board", default="sim:board") if asked else "sim:board"
    from armtempo.diagnosis import figures

    written = project_folder.write(folder, arm, port)
    joint_figures = figures.of(arm.arm)
    values = {"files": [str(path) for path in written], "joints": [joint.values for joint in joint_figures]}
    next_step = f"next: cd {folder}; armtempo check; the other commands are in README.md"
    lines = [*(f"wrote {path}" for path in written), *figures.table(joint_figures), next_step]
    results.show(as_json, values, lines)


def _asked() -> bool:
    """Whether somebody is there to ask."""
    return sys.stdin.isatty()


def _given_arm(name: str, like: str | None, urdf: Path | None, joints: tuple[str, ...]) -> ArmText:
    from armtempo.new_arm import given_geometry, joint_entry

    if like:
        return given_geometry.from_shipped(like)
    if urdf:
        return given_geometry.from_urdf(urdf)
    return given_geometry.from_joints(name, [joint_entry.parse(text, n) for n, text in enumerate(joints, 1)])


def _ask_arm(name: str) -> ArmText:
    from armtempo.model import shipped
    from armtempo.new_arm import given_geometry

    choices = [*shipped.files(), "own"]
    like = click.prompt("which arm", type=click.Choice(choices), default="own")
    if like != "own":
        return given_geometry.from_shipped(like)
    count = click.prompt("how many joints", type=click.IntRange(1, 6), default=3)
    click.echo(
        "standard Denavit-Hartenberg rows, base first; the steps and speeds are shown after each joint"
    )
    return given_geometry.from_joints(name, [_ask_joint(number, count) for number in range(1, count + 1)])


def _ask_joint(number: int, count: int) -> JointEntry:
    from armtempo.new_arm.joint_entry import JointEntry

    entry = JointEntry(f"joint {number}")
    click.echo(f"joint {number} of {count}")
    for field in fields(JointEntry):
        if field.name in _QUESTIONS:
            before = getattr(entry, field.name)
            value = click.prompt(f"  {_QUESTIONS[field.name]}", default=before, type=type(before))
            entry = replace(entry, **{field.name: value})
    most = entry.most_speed_deg_s(count)
    click.echo(f"  {entry.steps_per_deg:.5g} steps/deg, at most {most:.4g} deg/s")
    speed = click.prompt(
        "  speed limit, degrees/s", default=min(60.0, float(f"{0.9 * most:.2g}")), type=float
    )
    return replace(entry, speed_deg_s=speed)
