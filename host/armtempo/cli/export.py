"""``armtempo export``: a trajectory for other programs."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.basics.errors import InputError
from armtempo.cli import options, results


@click.command()
@click.argument("trajectory", type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--format",
    "kind",
    type=click.Choice(["csv", "ros"]),
    default="csv",
    show_default=True,
    help="csv: degrees, a line a time; ros: trajectory_msgs/JointTrajectory in YAML, radians.",
)
@click.option("--rate", type=float, default=100.0, show_default=True, metavar="HZ", help="Points a second.")
@click.option("--frame-id", default="", help="header.frame_id of the ROS message.")
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="File to write; without it standard output. An existing FILE of other content is kept.",
)
@options.force("an existing FILE of other content")
@options.altered
@options.as_json
def command(
    trajectory: Path,
    kind: str,
    rate: float,
    frame_id: str,
    output: Path | None,
    force: bool,
    altered: bool,
    as_json: bool,
) -> None:
    """Write a motion as CSV or as a ROS JointTrajectory, sampled at any rate.

    TRAJECTORY: a trajectory file, as 'armtempo plan' writes it.
    """
    from armtempo.formats.atomic_file import check_not_input, check_replaceable, replace_text
    from armtempo.model.plan import Plan

    if as_json and output is None:
        raise InputError("--json is about the file of -o", "give -o FILE, or leave --json out")
    plan = Plan.load(trajectory, altered)
    text = plan.to_csv(rate) if kind == "csv" else plan.to_ros(rate, frame_id)
    if output is None:
        click.echo(text.encode(), nl=False)  # UTF-8 as in a file, whatever the terminal
    else:
        check_not_input(output, (trajectory,))
        check_replaceable(output, text, force)
        replace_text(output, text)
        values = {"file": str(output), "format": kind, "rate_hz": rate}
        results.show(as_json, values, [f"written: {output}"])
