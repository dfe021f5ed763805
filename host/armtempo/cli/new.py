"""``armtempo new``: a project folder for an arm of one's own."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.basics.errors import InputError
from armtempo.cli import options, results
from armtempo.cli.interview import draft_path

if TYPE_CHECKING:
    from armtempo.new_arm.given_geometry import ArmText


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
    "low_deg, high_deg, steps_per_rev, microsteps, gear_ratio, speed_deg_s, encoder_counts, parallel_linkage (1).",
)
@click.option("--modified", is_flag=True, help="The joints' rows are in the modified (Craig) convention.")
@click.option("--resume", is_flag=True, help="Go on with the questions that were left by Ctrl-C.")
@click.option("--port", default=None, help="Port of the board; 'sim:board' is a virtual one.", metavar="PORT")
@options.as_json
def command(
    folder: Path,
    like: str | None,
    urdf: Path | None,
    joints: tuple[str, ...],
    modified: bool,
    resume: bool,
    port: str | None,
    as_json: bool,
) -> None:
    """Make a project folder: arm file, first job, settings, and a page with the next commands.

    FOLDER: a folder that is not there yet, or is empty.

    Asks for what no option says, if there is somebody at the terminal to ask: '?' explains, '<' goes back.
    """
    from armtempo.new_arm import folder as project_folder

    if sum(map(bool, (like, urdf, joints))) > 1:
        raise InputError("--like, --urdf and --joint exclude each other", "give one of them")
    project_folder.check_free(folder)
    asked = _asked() and not as_json
    if like or urdf or joints:
        arm = _given_arm(folder.name, like, urdf, joints, modified)
        if port is None:
            port = click.prompt("port of the board", default="sim:board") if asked else "sim:board"
    elif asked:
        from armtempo.cli import interview

        answers = interview.hold(folder, resume)
        arm, port = _arm_of(folder.name, answers), port or answers["port"]
    else:
        raise InputError("which arm?", "give --like ARM, --urdf FILE, or a --joint for each joint")
    from armtempo.diagnosis import figures

    written = project_folder.write(folder, arm, port)
    draft_path(folder).unlink(missing_ok=True)
    joint_figures = figures.of(arm.arm)
    values = {"files": [str(path) for path in written], "joints": [joint.values for joint in joint_figures]}
    next_step = f"next: cd {folder}; armtempo check; the other commands are in README.md"
    lines = [*(f"wrote {path}" for path in written), *figures.table(joint_figures), next_step]
    results.show(as_json, values, lines)


def _asked() -> bool:
    """Whether somebody is there to ask."""
    return sys.stdin.isatty()


def _given_arm(
    name: str, like: str | None, urdf: Path | None, joints: tuple[str, ...], modified: bool
) -> ArmText:
    from armtempo.new_arm import given_geometry, joint_entry

    if like:
        return given_geometry.from_shipped(like)
    if urdf:
        return given_geometry.from_urdf(urdf)
    return given_geometry.from_joints(
        name, [joint_entry.parse(text, n) for n, text in enumerate(joints, 1)], modified
    )


def _arm_of(name: str, answers: dict[str, str]) -> ArmText:
    from armtempo.new_arm import given_geometry, questions

    if answers["arm"] != "own":
        return given_geometry.from_shipped(answers["arm"])
    modified = answers["convention"] == questions.MODIFIED
    return given_geometry.from_joints(name, questions.joints(answers), modified)
