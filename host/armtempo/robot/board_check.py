"""Checks of what a board reports of itself."""

from __future__ import annotations

from armtempo.basics.errors import ArmtempoError
from armtempo.diagnosis.finding import Finding, error, good, note
from armtempo.link.program_version import UPDATE, own_crc
from armtempo.robot.board_state import BoardState

_LEAST_HEAP = 8_000
"""Bytes of free heap below which a long motion may not fit."""


def examine_board(state: BoardState | ArmtempoError) -> list[Finding]:
    """Findings about a board's state, or about the error with which it could not be read."""
    if isinstance(state, ArmtempoError):
        return [error("board", str(state), "see 'armtempo help recovery' for each of its states")]
    found = [
        good("board", f"{state.board_id}{' (virtual)' if state.virtual else ''}, port {state.port}"),
        _program(state),
        _room(state),
        good(
            "arm on the board", state.arm or (f"record {state.arm_crc:08x}" if state.arm_crc else "none yet")
        ),
        good("state", state.state),
    ]
    if state.arm_problem:
        found.append(error("stored arm", state.arm_problem, "armtempo configure"))
    if state.fault:
        found.append(error("fault", state.fault, "remove its cause, then 'armtempo clear'"))
    if state.frames_bad or state.samples_lost:
        text = f"{state.frames_bad} damaged messages, {state.samples_lost} samples lost"
        found.append(note("link", text, "if it continues, try another cable or USB socket"))
    return found


def _program(state: BoardState) -> Finding:
    text = f"{state.program_crc:08x}, protocol {state.protocol}"
    if state.program_current:
        return good("program", f"{text}, as installed here")
    return error("program", f"{text}, which differs from the one installed here, {own_crc():08x}", UPDATE)


def _room(state: BoardState) -> Finding:
    text = f"{state.free_heap} bytes of heap, {state.free_flash} of flash"
    if state.free_heap >= _LEAST_HEAP:
        return good("free", text)
    return note("free", text, "flash a firmware with the program built in: 'armtempo flash'")
