"""``armtempo import-urdf``: an arm file out of a URDF robot description."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.cli import options, results


@click.command()
@click.argument("urdf", type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "-o",
    "--out",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Arm file to write (TOML).",
)
@click.option("--base", metavar="LINK", help="Link that the arm stands on; without it the URDF's root.")
@click.option(
    "--tip",
    metavar="LINK",
    help="Link whose frame is the tool's; without it the one that fingers follow, or the end.",
)
@click.option("--force", is_flag=True, help="Replace FILE if it is there.")
@options.as_json
def command(urdf: Path, out: Path, base: str | None, tip: str | None, force: bool, as_json: bool) -> None:
    """Make an arm file of a URDF's chain of revolute joints: its Denavit-Hartenberg rows and ranges.

    URDF: the robot's description, a .urdf or .xacro file.

    The rows are held against the URDF's own forward kinematics at 1000 random postures before anything is
    written. Motors, which a URDF does not describe, are left as comments to fill in. Needs the extra 'urdf'.
    """
    from armtempo_shared.limits import MAX_JOINTS

    from armtempo.basics.errors import InputError
    from armtempo.formats import toml_table
    from armtempo.formats.atomic_file import replace_text
    from armtempo.model.arm import Arm
    from armtempo.new_arm import arm_text
    from armtempo.new_arm import urdf_fitting as fitting
    from armtempo.new_arm import urdf_reader as reader

    if out.exists() and not force:
        raise InputError(f"{out}: is there already", "choose another name, or --force to replace it")
    if out.exists() and urdf.exists() and out.samefile(urdf):
        raise InputError(f"{out}: is the URDF itself", "choose another name")
    chain = reader.read(urdf, base, tip)
    fit = fitting.fit(chain)
    text = arm_text.arm_text(chain, fit, urdf.name)
    Arm.of_table(toml_table.parse(text, str(out)))  # what would not be read again is not written
    replace_text(out, text)
    values = {
        "file": str(out),
        "robot": chain.robot,
        "base": chain.base,
        "tip": chain.tip,
        "joints": len(chain.joints),
        "postures": fit.postures,
        "worst_position_mm": float(fit.position_mm),
        "worst_rotation_deg": float(fit.rotation_deg),
    }
    lines = [
        f"{chain.robot!r}: {len(chain.joints)} joints from link {chain.base!r} to {chain.tip!r}",
        f"worst error at {fit.postures} random postures: {fit.position_mm:.2g} mm and {fit.rotation_deg:.2g} degrees",
        f"wrote {out}; now put its motors in, then: armtempo check --arm {out}",
    ]
    if len(chain.joints) > MAX_JOINTS:
        lines.append(
            f"the board drives {MAX_JOINTS} joints, this chain has {len(chain.joints)}: lock some of them by "
            "fixed_deg = ANGLE in the place of their motors, or choose a part of it with --base and --tip"
        )
    results.show(as_json, values, lines)
