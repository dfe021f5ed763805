"""Ports and who may open them, the arm file, and the board."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from armtempo.doctor.item import Condition, Item
from armtempo.errors import ArmtempoError
from armtempo.ports.listing import Port, find_ports

if TYPE_CHECKING:
    from armtempo.robot.board_state import BoardState

_GROUP = "sudo usermod -a -G dialout $USER, then log in again"
_LEAST_HEAP = 8_000
"""Bytes of heap below which a motion of some length may find no room."""


def ports() -> list[Item]:
    """The serial ports, each with whether it can be opened by this user."""
    found = [_port(port) for port in find_ports()]
    return found or [
        Item("ports", "none", Condition.NOTE, "connect a board by its USB socket, or use --port sim")
    ]


def _port(port: Port) -> Item:
    what = f"{port.description or 'serial port'}{', a MicroPython board' if port.board else ''}"
    if sys.platform == "linux" and not os.access(port.device, os.R_OK | os.W_OK):
        level = Condition.WRONG if port.board else Condition.NOTE
        return Item(port.device, f"{what}; no permission to open it", level, _GROUP)
    return Item(port.device, what)


def examine_arm(path: Path) -> list[Item]:
    """Whether the arm file can be read, and how many errors and warnings a check finds in it."""
    from armtempo.arm_check import check
    from armtempo.arm_check.finding import Level

    arm, findings = check(path)
    errors = sum(finding.level is Level.ERROR for finding in findings)
    warnings = sum(finding.level is Level.WARNING for finding in findings)
    name = f"{arm.name}, {len(arm.driven_indices)} driven joints" if arm else "not readable"
    level = Condition.WRONG if errors else Condition.NOTE if warnings else Condition.GOOD
    advice = f"armtempo check --arm {path}" if errors or warnings else ""
    return [Item(str(path), f"{name}; {errors} errors, {warnings} warnings", level, advice)]


def examine_board(state: BoardState | ArmtempoError) -> list[Item]:
    """What a board says of itself, or why it says nothing."""
    if isinstance(state, ArmtempoError):
        return [
            Item("board", str(state), Condition.WRONG, "see host/docs/recovery.md for each of its states")
        ]
    found = [
        Item("board", f"{state.board_id}{' (virtual)' if state.virtual else ''}, port {state.port}"),
        _program(state),
        _room(state),
        Item(
            "arm on the board", state.arm or (f"record {state.arm_crc:08x}" if state.arm_crc else "none yet")
        ),
        Item("state", state.state),
    ]
    if state.arm_problem:
        found.append(Item("stored arm", state.arm_problem, Condition.WRONG, "armtempo configure"))
    if state.fault:
        found.append(Item("fault", state.fault, Condition.WRONG, "remove its cause, then 'armtempo clear'"))
    if state.frames_bad or state.samples_lost:
        text = f"{state.frames_bad} damaged messages, {state.samples_lost} samples lost"
        found.append(Item("link", text, Condition.NOTE, "another cable or USB socket, if that goes on"))
    return found


def _program(state: BoardState) -> Item:
    text = f"{state.program_crc:08x}, protocol {state.protocol}"
    if state.program_current:
        return Item("program", f"{text}, as installed here")
    return Item("program", f"{text}, another than the one installed here", Condition.WRONG, "armtempo deploy")


def _room(state: BoardState) -> Item:
    text = f"{state.free_heap} bytes of heap, {state.free_flash} of flash"
    if state.free_heap >= _LEAST_HEAP:
        return Item("free", text)
    return Item(
        "free", text, Condition.NOTE, "a firmware that has the program: see 'armtempo firmware --help'"
    )
