"""``armtempo show``: one stored motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import chosen, options, posture
from armtempo.formats.text_table import aligned

if TYPE_CHECKING:
    from armtempo.records.encoded_motion import EncodedMotion


@click.command()
@click.argument("name")
@options.arm_of_board
@options.port
@options.log_traffic
def command(name: str, arm_path: Path | None, port: str | None, log_traffic: Path | None) -> None:
    """Show the stored motion NAME, read back."""
    named = chosen.named_arm(arm_path)
    with chosen.board(port, log_traffic) as board:
        motion = board.read(name, chosen.arm_of_board(board, named))
    for line in _lines(motion):
        click.echo(line)


def _lines(motion: EncodedMotion) -> list[str]:
    import numpy as np

    trajectory = motion.trajectory
    times = np.linspace(0.0, trajectory.duration_s, 2001)
    speeds = np.abs(trajectory(times, 1)).max(axis=0)
    found = [
        f"{motion.name}: {len(motion.data)} bytes, {trajectory.duration_s:.4f} s, "
        f"degree {trajectory.joints[0].degree}, {'shared' if trajectory.shared else 'per-joint'} timing",
        f"from {posture.words(motion.start_deg, motion.arm)}",
        f"to   {posture.words(trajectory(trajectory.duration_s), motion.arm)}",
    ]
    pairs = zip(motion.arm.driven, trajectory.joints, strict=True)
    lasting = aligned([(joint.name, f"{spline.duration_s:.4f}") for joint, spline in pairs], (12, 9))
    return found + [f"{row} s, up to {speed:.2f} deg/s" for row, speed in zip(lasting, speeds, strict=True)]
