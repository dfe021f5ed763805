"""``armtempo check``: looks for mistakes in an arm file and a job."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from armtempo.basics.errors import InputError
from armtempo.basics.settings import JOB, ProjectSettings
from armtempo.cli import options, resolve, results
from armtempo.diagnosis import arm_check, figures
from armtempo.diagnosis.figures import JointFigures, table
from armtempo.diagnosis.finding import Finding, Level
from armtempo.model.arm import Arm
from armtempo.planning.board_limits import format_rate
from armtempo.report import arm_picture, drawing


@click.command("check")
@options.arm
@options.job
@options.file(
    "--picture",
    help="Draw the arm at home and at the ends of its ranges into FILE (PNG or SVG). Needs the extra 'plot'.",
)
@options.force("an existing picture")
@options.as_json
def check(
    arm_path: Path | None, job_path: Path | None, picture: Path | None, force: bool, as_json: bool
) -> None:
    """Check an arm file and a job for likely mistakes.

    Steps, step rates, resolution at the tool, torque, encoders, ranges, wiring; each finding says what corrects it.
    Exit code 1 if there are errors; 0 with warnings and notes only.
    """
    _check_picture(picture, force)
    path = resolve.arm_file(arm_path)
    job = ProjectSettings().get(JOB, job_path)
    arm, found = arm_check.check(path, job.path if job else None)
    joints = figures.of(arm) if arm else ()
    (_print_json if as_json else _print_text)(path, arm, joints, found)
    if arm and picture:
        _draw(arm, picture)
    if any(finding.level is Level.ERROR for finding in found):
        raise SystemExit(1)


def _check_picture(picture: Path | None, force: bool) -> None:
    """Raise InputError if the picture cannot be written as asked."""
    if picture is None:
        return
    if picture.suffix not in (".png", ".svg"):
        raise InputError(
            f"--picture {picture}: not a supported picture format", "give a name that ends in .png or .svg"
        )
    if picture.exists() and not force:
        raise InputError(f"--picture {picture}: already exists", "choose another name, or add --force")


def _print_text(path: Path, arm: Arm | None, joints: tuple[JointFigures, ...], found: list[Finding]) -> None:
    results.echo(f"arm: {arm.name if arm else '(not readable)'} ({path})")
    for line in table(joints):
        results.echo(line)
    if joints:
        results.echo(format_rate(sum(joint.top_steps_s for joint in joints)))
    for finding in found:
        results.echo(f"{finding.level.value + ':':<9}{finding.where}: {finding.what}")
        results.echo(f"{'':9}-> {finding.next_step}")
    if not found:
        results.echo("nothing looks wrong")
        return
    levels = [finding.level for finding in found]
    results.echo(", ".join(_counted(levels.count(one), one.value) for one in Level if one is not Level.GOOD))


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _print_json(path: Path, arm: Arm | None, joints: tuple[JointFigures, ...], found: list[Finding]) -> None:
    values: dict[str, Any] = {
        "arm": arm.name if arm else None,
        "file": str(path),
        "joints": [joint.values for joint in joints],
        "findings": [{**asdict(finding), "level": finding.level.value} for finding in found],
    }
    results.show_json(values)


def _draw(arm: Arm, picture: Path) -> None:
    drawing.save(arm_picture.arm_picture(arm), picture)
    results.echo(f"wrote {picture}", err=True)
