"""``armtempo list``: what the board keeps."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from armtempo.basics.errors import InputError
from armtempo.cli import chosen, options, posture, results

if TYPE_CHECKING:
    from armtempo.link.board_messages import StoredMotion
    from armtempo.model.arm import Arm
    from armtempo.robot.board import Board


@click.command()
@options.arm_of_board
@options.port
@options.log_traffic
@options.as_json
def command(arm_path: Path | None, port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """List the motions and sequences on the board, and where they begin and end.

    The one marked * is what the board's button starts.
    """
    with chosen.board(port, log_traffic) as board:
        found = board.list()
        if as_json:
            results.show_json({"virtual": board.info.virtual, "motions": [_values(one) for one in found]})
            return
        arm = _arm(board, arm_path)
        virtual = f"  on {chosen.virtual_words(board.port)}" if board.info.virtual else ""
        click.echo(f"{'name':<26}{'bytes':>8}{'joints':>8}{'seconds':>10}  checksum{virtual}")
        for entry in found:
            click.echo(_line(entry))
            for line in _ends(board, entry, arm):
                click.echo(f"    {line}")


def _values(entry: StoredMotion) -> dict[str, Any]:
    return {
        "name": entry.name,
        "sequence": entry.sequence,
        "size_bytes": entry.size,
        "crc": entry.crc,
        "joints": entry.joints,
        "duration_s": entry.duration_s,
        "default": entry.default,
    }


def _arm(board: Board, arm_path: Path | None) -> Arm | None:
    """The arm that the board is set up for, as far as it is known."""
    from armtempo.robot.board_state import record_crc

    named = chosen.named_arm(arm_path)
    if named is not None and record_crc(named) != board.info.arm_crc:
        chosen.tell(
            f"the board is set up for another arm than {chosen.words(named)}; see 'armtempo configure'"
        )
        named = None
    try:
        return chosen.arm_of_board(board, named)
    except InputError:
        return None


def _line(entry: StoredMotion) -> str:
    name = entry.name + (" *" if entry.default else "")
    if entry.sequence:
        return f"{name:<26}{entry.size:>8}{'sequence':>18}  {entry.crc:08x}"
    if not entry.joints:
        return f"{name:<26}{entry.size:>8}  damaged; upload it again or remove it"
    return f"{name:<26}{entry.size:>8}{entry.joints:>8}{entry.duration_s:>10.3f}  {entry.crc:08x}"


def _ends(board: Board, entry: StoredMotion, arm: Arm | None) -> list[str]:
    """Where a motion begins and ends, in degrees and steps, where the arm is known."""
    if arm is None or not entry.joints:
        return []
    try:
        trajectory = board.read(entry.name, arm).trajectory
    except InputError as error:
        return [str(error)]
    ends = ("from", trajectory(0.0)), ("to", trajectory(trajectory.duration_s))
    return [f"{word:<5}{posture.words(angles_deg, arm)}" for word, angles_deg in ends]
