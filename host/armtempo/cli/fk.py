"""``armtempo fk``: where the tool and every frame stand for given joint angles."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.basics.arrays import Array
from armtempo.cli import chosen, options, posture, results
from armtempo.kinematics import frame_listing
from armtempo.kinematics.chain import spread_deg
from armtempo.kinematics.pose_file import numbers
from armtempo.model.arm import Arm


@click.command("fk", context_settings={"ignore_unknown_options": True})  # so that -10,20,30 is a posture
@click.argument("where", nargs=-1)
@options.job
@options.arm
@options.altered
@options.as_json
def fk(
    where: tuple[str, ...], job_path: Path | None, arm_path: Path | None, altered: bool, as_json: bool
) -> None:
    """Print the tool's pose and every frame for given joint angles.

    WHERE: angles in degrees ('0,-60,40', or as separate numbers), of all joints or of those that have a motor, the
    others at home; a posture of the arm file; a via point such as P0; or a trajectory file for its start. Without it,
    or for 'home', the arm's home. Hold the frames against the arm: a wrong row of its table shows at once.
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
        results.show_json(frame_listing.values(arm, angles_deg))
    else:
        click.echo("\n".join(frame_listing.lines(arm, angles_deg)))


def _angles(where: tuple[str, ...], arm: Arm) -> Array:
    """Angles of all joints, deg (joints,)."""
    if not where:
        return spread_deg(arm, arm.all_home_deg)
    return spread_deg(arm, numbers(" ".join(where), "the angles"))
