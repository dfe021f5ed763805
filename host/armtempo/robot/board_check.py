"""What a board says of itself, judged."""

from __future__ import annotations

from armtempo.basics.errors import ArmtempoError
from armtempo.diagnosis.item import Condition, Item
from armtempo.robot.board_state import BoardState

_LEAST_HEAP = 8_000
"""Bytes of heap below which a motion of some length may find no room."""


def examine_board(state: BoardState | ArmtempoError) -> list[Item]:
    """What a board says of itself, or why it says nothing."""
    if isinstance(state, ArmtempoError):
        return [
            Item("board", str(state), Condition.WRONG, "see 'armtempo help recovery' for each of its states")
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
        found.append(Item("link", text, Condition.NOTE, "another cable or USB socket, if that continues"))
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
