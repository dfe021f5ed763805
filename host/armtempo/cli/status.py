"""``armtempo status``: who is on the port and what it is doing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import options

if TYPE_CHECKING:
    from armtempo.link.board_messages import Hello, Status


@click.command()
@options.port
@options.log_traffic
def command(port: str, log_traffic: Path | None) -> None:
    """Show the board, its state, and where the joints stand."""
    with options.board(port, log_traffic, any_program=True) as board:
        for line in [*_identity(board.info), *lines(board.status())]:
            click.echo(line)


def _identity(info: Hello) -> list[str]:
    from armtempo.robot import engine_room

    return [
        f"board     {info.board_id}",
        f"program   {info.program_crc:08x}, protocol {info.protocol}{_other(info)}",
        f"arm       {_arm(info)}",
        f"free      {info.free_flash} bytes of flash, {info.free_heap} of heap",
        f"fastest   {info.max_rate} steps/s one joint, {info.max_rate_sum} all together",
        *engine_room.lines(info),
    ]


def _arm(info: Hello) -> str:
    from armtempo.link.refusal import refusal

    if info.joints:
        return f"{info.joints} joints, record {info.arm_crc:08x}"
    if info.arm_problem:
        return str(refusal("none; the stored record is not used", info.arm_problem, value=info.arm_value))
    return "none yet"


def _other(info: Hello) -> str:
    from armtempo.link.program_version import own_crc

    return "" if info.program_crc == own_crc() else "; another than the one installed here: 'armtempo deploy'"


def lines(status: Status) -> list[str]:
    """State, fault and stand of each joint."""
    from armtempo.robot.stored_motion import fault_name

    found = [f"state     {status.state}"]
    if status.fault:
        found.append(f"fault     {fault_name(status.fault)}; see 'armtempo clear'")
    for joint, (steps, counts) in enumerate(
        zip(status.positions.commanded_steps, status.positions.counts, strict=True)
    ):
        known = "" if status.joint_known(joint) else ", position unknown"
        found.append(f"joint {joint + 1}   {steps} steps, {counts} counts{known}")
    found.append(f"link      {status.frames_bad} damaged stretches, {status.samples_lost} samples lost")
    return found
