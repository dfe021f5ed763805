"""``armtempo teach``: where the arm stands becomes a posture of its file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import chosen, options
from armtempo.errors import InputError

if TYPE_CHECKING:
    from armtempo.robot.board import Board


@click.command()
@click.option(
    "--posture", "name", metavar="NAME", required=True, help="Write [posture.NAME] into the arm file."
)
@click.option("--replace", "replace_old", is_flag=True, help="Replace the posture of that name.")
@options.arm
@options.port
@options.log_traffic
def command(
    name: str, replace_old: bool, arm_path: Path | None, port: str | None, log_traffic: Path | None
) -> None:
    """Keep where the arm stands.

    --posture NAME writes it as [posture.NAME] into the arm file, whose comments and layout stay; then 'armtempo goto
    NAME' brings the arm there, and a job may pass it: [[via]] posture = "NAME". Nothing moves.
    """
    file = _own_arm_file(arm_path, name)
    arm = chosen.load_arm(arm_path)
    with chosen.board(port, log_traffic, arm) as board:
        board.configure(arm)
        _write_posture(board, file, name, replace_old)


def _own_arm_file(arm_path: Path | None, name: str) -> Path:
    """The arm file to write to; InputError for one that ships, and for what is no name."""
    from armtempo.model import posture, shipped
    from armtempo.project.settings import ARM, ProjectSettings, nothing_set

    if problem := posture.name_problem(name):
        raise InputError(f"--posture {name}: {problem}", "choose another name")
    setting = ProjectSettings().get(ARM, arm_path)
    if not setting:
        raise nothing_set(ARM, "into which arm file?")
    found = shipped.find(setting.path)
    if found.ships or found.path.resolve() in [path.resolve() for path in shipped.files().values()]:
        raise InputError(
            f"the arm file {found.path.name} ships with armtempo and is not written to",
            f"make your own of it: armtempo new FOLDER --like {found.path.stem}, then name it with --arm",
        )
    return found.path


def _write_posture(board: Board, file: Path, name: str, replace_old: bool) -> None:
    from armtempo.model import posture_text

    arm = board.arm
    assert arm is not None  # it was configured
    angles_deg = posture_text.digits(arm, board.posture_deg().tolist())
    posture_text.save(file, arm, name, angles_deg, replace_old)
    words = ", ".join(
        f"{joint.name} {angle:.12g}°" for joint, angle in zip(arm.driven, angles_deg, strict=True)
    )
    click.echo(f"{file}: posture {name!r}: {words}")
