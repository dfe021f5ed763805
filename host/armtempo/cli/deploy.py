"""``armtempo deploy``, ``undeploy`` and ``configure``: set a board up."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from armtempo import deploy as deployment
from armtempo.cli import options, resolve, results
from armtempo.cli.options import BoardOptions
from armtempo.cli.results import ProgressBar
from armtempo.encoding import engine_heap
from armtempo.encoding.engine_heap import EngineHeap
from armtempo.model.arm import Arm


@click.command("deploy")
@options.arm
@options.port
@options.as_json
def deploy(arm_path: Path | None, port: str | None, as_json: bool) -> None:
    """Install or update the board program on a board.

    mpremote copies the files below /flash/lib that differ, and writes the compiled program to the last two sectors of
    the chip's flash; all is read back. An existing boot.py or main.py is backed up. If interrupted, run it again. At
    the end it prints which arms fit into the remaining memory, and whether the given arm does.
    """
    arm = resolve.named_arm(arm_path)
    with ProgressBar("copying") as progress:
        info = deployment.deploy(resolve.port(port), results.progress_printer(as_json), progress)
    heap = EngineHeap(info.engine_bytes)
    values = {
        "board_id": info.board_id,
        "virtual": info.virtual,
        "program_crc": info.program_crc,
        "protocol": info.protocol,
        "engine_bytes": info.engine_bytes,
        "arm": arm.name if arm else None,
        "arm_fits": heap.holds_arm(arm) if arm else None,
    }
    of_arm = [f"{resolve.describe_arm(arm)}: {engine_heap.of_arm(arm, heap)}"] if arm else []
    results.show(as_json, values, ["the board runs armtempo", *engine_heap.of_board(heap), *of_arm])


@click.command("undeploy")
@options.port
@options.as_json
def undeploy(port: str | None, as_json: bool) -> None:
    """Remove the board program from a board.

    Stored motions are kept; the backed-up boot.py and main.py are restored.
    """
    name = resolve.port(port)
    deployment.undeploy(name, results.progress_printer(as_json))
    if as_json:
        results.show_json({"port": name, "program": None})


@click.command("configure")
@options.board(options.arm)
def configure(given: BoardOptions) -> None:
    """Set the board up for an arm.

    The position is unknown afterwards, unless only limits differ: ranges, speeds, following errors, the link time-out.
    Stored motions of an arm with another geometry or gearing are refused; upload them again.
    """
    arm = resolve.load_arm(given.arm_path)
    with resolve.board(given, arm) as board:
        before = board.info.arm_crc
        board.configure(arm, replace=True)
        found = board.state()
        motions = len(board.list())
        memory = engine_heap.of_arm(arm, EngineHeap(board.info.engine_bytes))
    changed, known = found.arm_crc != before, all(joint.known for joint in found.joints)
    values = {
        "arm": arm.name,
        "file": arm.source,
        "changed": changed,
        "position_known": known,
        "motions_to_upload_again": motions if before and changed else 0,
        "memory": memory,
    }
    results.show(given.as_json, values, _configured(arm, values) if changed else [_unchanged(arm)])


def _unchanged(arm: Arm) -> str:
    return f"the board is already set up for {resolve.describe_arm(arm)}; nothing is changed"


def _configured(arm: Arm, values: dict[str, Any]) -> list[str]:
    lines = [f"the board is set up for {resolve.describe_arm(arm)}", values["memory"]]
    if motions := values["motions_to_upload_again"]:
        lines.append(f"{motions} stored motions are for the old arm; upload those that you need again")
    if values["position_known"]:
        lines.append("only limits have changed: the position is still known")
    else:
        lines.append("the position is unknown: move the arm to its home posture, then 'armtempo home'")
    return lines
