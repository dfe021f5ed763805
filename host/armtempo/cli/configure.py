"""``armtempo configure``: set a board up for an arm."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from armtempo.cli import chosen, options, results

if TYPE_CHECKING:
    from armtempo.model.arm import Arm


@click.command()
@options.arm
@options.port
@options.log_traffic
@options.as_json
def command(arm_path: Path | None, port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """Set the board up for an arm, also in the place of another one.

    The position is unknown afterwards, unless only limits differ: ranges, speeds, following errors, the link
    time-out. Motions that were stored for other figures of the arm are refused; upload them again.
    """
    from armtempo.robot import engine_room

    arm = chosen.load_arm(arm_path)
    with chosen.board(port, log_traffic, arm) as board:
        before = board.info.arm_crc
        board.configure(arm, replace=True)
        found = board.state()
        motions = len(board.list())
        room = engine_room.of_arm(arm, board.info)
    changed, known = found.arm_crc != before, all(joint.known for joint in found.joints)
    values = {
        "arm": arm.name,
        "file": arm.source,
        "changed": changed,
        "position_known": known,
        "motions_to_upload_again": motions if before and changed else 0,
        "memory": room,
    }
    results.show(as_json, values, _lines(arm, values) if changed else [_unchanged(arm)])


def _unchanged(arm: Arm) -> str:
    return f"the board is set up for {chosen.words(arm)} already; nothing is changed"


def _lines(arm: Arm, values: dict[str, Any]) -> list[str]:
    lines = [f"the board is set up for {chosen.words(arm)}", values["memory"]]
    if motions := values["motions_to_upload_again"]:
        lines.append(
            f"{motions} stored motions were made for the arm as it was; upload those that are still wanted"
        )
    if values["position_known"]:
        lines.append("only limits differ from what the board had: it still knows where the arm stands")
    else:
        lines.append("the position is unknown: bring the arm to its home posture, then 'armtempo home'")
    return lines
