"""``armtempo show``: one stored motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from armtempo.cli import chosen, options, posture, results
from armtempo.formats.text_table import aligned

if TYPE_CHECKING:
    from armtempo.records.encoded_motion import EncodedMotion


@click.command()
@click.argument("name")
@options.arm_of_board
@options.port
@options.log_traffic
@options.as_json
def command(
    name: str, arm_path: Path | None, port: str | None, log_traffic: Path | None, as_json: bool
) -> None:
    """Show a stored motion, read back.

    NAME: as 'armtempo list' shows it.
    """
    named = chosen.named_arm(arm_path)
    with chosen.board(port, log_traffic) as board:
        motion = board.read(name, chosen.arm_of_board(board, named))
    speeds = _top_speeds_deg_s(motion)
    results.show(as_json, _values(motion, speeds), _lines(motion, speeds))


def _top_speeds_deg_s(motion: EncodedMotion) -> list[float]:
    """Of each driven joint, by samples."""
    import numpy as np

    times = np.linspace(0.0, motion.trajectory.duration_s, 2001)
    found: list[float] = np.abs(motion.trajectory(times, 1)).max(axis=0).tolist()
    return found


def _values(motion: EncodedMotion, speeds: list[float]) -> dict[str, Any]:
    trajectory = motion.trajectory
    return {
        "name": motion.name,
        "size_bytes": len(motion.data),
        "duration_s": trajectory.duration_s,
        "degree": trajectory.joints[0].degree,
        "timing": "shared" if trajectory.shared else "per-joint",
        "start_deg": [float(angle) for angle in motion.start_deg],
        "end_deg": trajectory(trajectory.duration_s).tolist(),
        "joints": [
            {"name": joint.name, "duration_s": spline.duration_s, "top_speed_deg_s": speed}
            for joint, spline, speed in zip(motion.arm.driven, trajectory.joints, speeds, strict=True)
        ],
    }


def _lines(motion: EncodedMotion, speeds: list[float]) -> list[str]:
    trajectory = motion.trajectory
    found = [
        f"{motion.name}: {len(motion.data)} bytes, {trajectory.duration_s:.4f} s, "
        f"degree {trajectory.joints[0].degree}, {'shared' if trajectory.shared else 'per-joint'} timing",
        f"from {posture.words(motion.start_deg, motion.arm)}",
        f"to   {posture.words(trajectory(trajectory.duration_s), motion.arm)}",
    ]
    pairs = zip(motion.arm.driven, trajectory.joints, strict=True)
    lasting = aligned([(joint.name, f"{spline.duration_s:.4f}") for joint, spline in pairs], (12, 9))
    return found + [f"{row} s, up to {speed:.2f} deg/s" for row, speed in zip(lasting, speeds, strict=True)]
