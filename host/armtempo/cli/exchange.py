"""``armtempo import``, ``export`` and ``import-urdf``: exchange of files with other programs."""

from __future__ import annotations

from pathlib import Path

import click
from armtempo_shared.limits import MAX_JOINTS

from armtempo.basics import toml_table
from armtempo.basics.atomic_file import check_not_input, check_replaceable, replace_text
from armtempo.basics.errors import InputError
from armtempo.cli import options, resolve, results
from armtempo.model import mesh_files, via_table
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.tool_pose import BASE
from armtempo.model.via_table import ImportedPath
from armtempo.new_arm import arm_text, urdf_meshes
from armtempo.new_arm import urdf_fitting as fitting
from armtempo.new_arm import urdf_reader as reader


@click.command("import")
@click.argument("table", type=options.FILE)
@options.arm
@click.option("--name", help="Name of the job; default: the table's file name.")
@click.option(
    "--radians/--degrees",
    default=None,
    help="Unit of angles whose column does not name one. Default: degrees, unless that is doubtful.",
)
@options.frame
@click.option(
    "--tolerance-deg",
    type=options.FiniteNumber(),
    metavar="DEG",
    help="Leave out lines that change the path by less than DEG. Default for a table with a column time_s: 0.1.",
)
@click.option(
    "--tolerance-mm", type=options.FiniteNumber(), metavar="MM", help="The same of sliding joints, also 0.1."
)
@click.option(
    "--own-timing",
    is_flag=True,
    help="Write a motion for 'armtempo run' that keeps the recording's times, slowed where the limits ask for it.",
)
@options.file(
    "-o",
    "--output",
    help="File to write; without it the name with .toml, or .json with --own-timing. An existing file with other "
    "content is not replaced.",
)
@options.force("an existing FILE with other content")
@options.as_json
def import_table(
    table: Path,
    arm_path: Path | None,
    name: str | None,
    frame: str,
    radians: bool | None,
    tolerance_deg: float | None,
    tolerance_mm: float | None,
    own_timing: bool,
    output: Path | None,
    force: bool,
    as_json: bool,
) -> None:
    """Make a job file from a table or a ROS JointTrajectory.

    TABLE: a text file with one line per via point, or the trajectory.

    The first line of a table names the columns, in any order: the joints' names or j1, j2, …, with a unit such as
    (rad); or x, y, z and roll, pitch, yaw for poses. Columns are separated by commas, semicolons, tabs or blanks. A
    file that 'armtempo export' wrote becomes a job of few via points along the same path.
    """
    arm = resolve.load_arm(arm_path)
    title = name or table.stem
    target = output or Path(f"{title}.json" if own_timing else f"{title}.toml")
    check_not_input(target, (table, arm.source))
    tolerance = _tolerance(arm, tolerance_deg, tolerance_mm)
    if own_timing:
        if frame != BASE:
            raise InputError("--own-timing is for angles, which are in no frame", "leave --frame out")
        plan = resolve.as_recorded(table, arm, title, radians, tolerance)
        plan.save(target, force)
        _show_timed(plan, target, as_json)
        return
    found = via_table.read(table, arm, radians, tolerance)
    if frame != BASE and not found.poses:
        raise InputError(f"{table}: has angles, which are in no frame", "leave --frame out")
    text = via_table.job_text(title, found, frame)
    Job.of_table(toml_table.parse(text, str(table)), arm)
    check_replaceable(target, text, force)
    replace_text(target, text)
    values = {
        "file": str(target),
        "lines": found.lines,
        "via_points": found.count,
        "thinned_to_deg": found.thinned_to_deg,
        "notes": list(found.notes),
    }
    results.show(as_json, values, _import_lines(target, found))


def _tolerance(arm: Arm, turning_deg: float | None, sliding_mm: float | None) -> list[float] | None:
    """The tolerance of each driven joint; None for the default. InputError for that of joints that the arm has not."""
    if turning_deg is None and sliding_mm is None:
        return None
    for option, given, slides in (
        ("--tolerance-deg", turning_deg, False),
        ("--tolerance-mm", sliding_mm, True),
    ):
        if given is not None and all(joint.slides != slides for joint in arm.driven):
            raise InputError(
                f"{option}: arm {arm.name!r} has no {'sliding' if slides else 'turning'} joint",
                "leave it out",
            )
    turning, sliding = (
        via_table.TOLERANCE_DEG if given is None else given for given in (turning_deg, sliding_mm)
    )
    return [sliding if joint.slides else turning for joint in arm.driven]


def _show_timed(plan: Plan, target: Path, as_json: bool) -> None:
    values = {
        "file": str(target),
        "duration_s": plan.total_s,
        "notes": list(plan.notes),
    }
    lines = [f"{plan.total_s:.3f} s", *(f"note: {note}" for note in plan.notes)]
    results.show(as_json, values, [*lines, f"written: {target}; run it with: armtempo run {target}"])


def _import_lines(target: Path, found: ImportedPath) -> list[str]:
    written = f"written: {target}; plan it with: armtempo plan --job {target}"
    notes = [f"note: {note}" for note in found.notes]
    if found.thinned_to_deg is None:
        return [*notes, written]
    thinned = (
        f"{found.lines} lines reduced to {len(found.via_deg)} via points: the planned path stays within "
        f"{found.thinned_to} of the table (proven); 'armtempo plan' computes new times"
    )
    return [*notes, thinned, written]


@click.command("export")
@click.argument("trajectory", type=options.FILE)
@click.option(
    "--format",
    "kind",
    type=click.Choice(["csv", "ros"]),
    default="csv",
    show_default=True,
    help="csv: degrees (sliding joints mm), one line per time; ros: trajectory_msgs/JointTrajectory in YAML, radians "
    "(metres).",
)
@click.option(
    "--rate",
    type=options.FiniteNumber(),
    default=100.0,
    show_default=True,
    metavar="HZ",
    help="Points a second.",
)
@click.option("--frame-id", default="", help="header.frame_id of the ROS message.")
@options.file(
    "-o",
    "--output",
    help="File to write; without it standard output. An existing FILE with other content is not replaced.",
)
@options.force("an existing FILE with other content")
@options.altered
@options.as_json
def export(
    trajectory: Path,
    kind: str,
    rate: float,
    frame_id: str,
    output: Path | None,
    force: bool,
    altered: bool,
    as_json: bool,
) -> None:
    """Write a motion as CSV or as a ROS JointTrajectory.

    TRAJECTORY: a trajectory file, as 'armtempo plan' writes it. It is sampled at --rate.
    """
    if as_json and output is None:
        raise InputError("--json needs -o FILE", "give -o FILE, or leave out --json")
    plan = Plan.load_motion(trajectory, altered)
    text = plan.to_csv(rate) if kind == "csv" else plan.to_ros(rate, frame_id)
    if output is None:
        click.echo(text.encode(), nl=False)  # UTF-8 as in a file, whatever the terminal
    else:
        check_not_input(output, (trajectory,))
        check_replaceable(output, text, force)
        replace_text(output, text)
        values = {"file": str(output), "format": kind, "rate_hz": rate}
        results.show(as_json, values, [f"written: {output}"])


@click.command("import-urdf")
@click.argument("urdf", type=options.FILE)
@options.file(
    "-o",
    "--out",
    required=True,
    help="Arm file to write (TOML).",
)
@click.option("--base", metavar="LINK", help="Base link of the arm; default: the URDF's root.")
@click.option(
    "--tip",
    metavar="LINK",
    help="Link whose frame is the tool's; default: the parent of the fingers, or the last link.",
)
@click.option("--meshes", is_flag=True, help="Write the links' shapes too, which 'armtempo panel' shows.")
@click.option("--force", is_flag=True, help="Replace FILE if it exists, and the meshes next to it.")
@options.as_json
def import_urdf(
    urdf: Path, out: Path, base: str | None, tip: str | None, meshes: bool, force: bool, as_json: bool
) -> None:
    """Make an arm file from a URDF.

    URDF: the robot's description, a .urdf or .xacro file.

    Its revolute and prismatic joints become Denavit-Hartenberg rows with their ranges. The rows are checked against
    the URDF's own forward kinematics at 1000 random postures before anything is written. Motors, which a URDF does
    not describe, are comments to fill in. Needs the extra 'urdf'.
    """
    if out.exists() and not force:
        raise InputError(f"{out}: already exists", "choose another name, or --force to replace it")
    if meshes and mesh_files.folder_of(out).exists() and not force:
        raise InputError(
            f"{mesh_files.folder_of(out)}: already exists", "remove it, or --force to replace its meshes"
        )
    if out.exists() and urdf.exists() and out.samefile(urdf):
        raise InputError(f"{out}: is the URDF itself", "choose another name")
    chain = reader.read(urdf, base, tip)
    fit = fitting.fit(chain)
    corners_mm = urdf_meshes.of_rows(chain, fit, urdf) if meshes else {}
    text = arm_text.arm_text(chain, fit, urdf)
    # An arm file that could not be read again is not written
    arm = Arm.of_table(toml_table.parse(text, str(out)))
    replace_text(out, text)
    written = mesh_files.write(out, corners_mm) if meshes else []
    values = {
        "file": str(out),
        "meshes": [str(file) for file in written],
        "robot": chain.robot,
        "base": chain.base,
        "tip": chain.tip,
        "joints": len(chain.joints),
        "postures": fit.postures,
        "worst_position_mm": float(fit.position_mm),
        "worst_rotation_deg": float(fit.rotation_deg),
        "radii_mm": [joint.radius_mm for joint in arm.joints],
        "doubts": [*chain.doubts, *chain.narrowed, *chain.unclear],
    }
    lines = [
        f"{chain.robot!r}: {len(chain.joints)} joints from link {chain.base!r} to {chain.tip!r}",
        f"worst error at {fit.postures} random postures: {fit.position_mm:.2g} mm and {fit.rotation_deg:.2g} degrees",
        f"{sum(joint.radius_mm > 0.0 for joint in arm.joints)} of {len(arm.joints)} rows have a radius_mm, from the "
        "links' shapes",
        f"wrote {out}; add the motors, then: armtempo check --arm {out}",
    ]
    lines += [f"note: {text}" for text in arm_text.notes(chain, out)]
    if meshes:
        lines.append(f"wrote {len(written)} meshes into {mesh_files.folder_of(out)}")
    if len(chain.joints) > MAX_JOINTS:
        lines.append(
            f"the board drives {MAX_JOINTS} joints, this chain has {len(chain.joints)}: lock some of them by "
            "fixed_deg = ANGLE instead of their motors, or choose a shorter chain with --base and --tip"
        )
    results.show(as_json, values, lines)
