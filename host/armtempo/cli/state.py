"""``armtempo status``, and the lines of a board's state for other commands."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click
from armtempo_shared.program import SUFFIX
from armtempo_shared.sequence import ENDINGS, FINISHED

from armtempo.basics.errors import InputError
from armtempo.basics.text import aligned
from armtempo.cli import options, resolve, results
from armtempo.cli.options import BoardOptions
from armtempo.link.program_version import UPDATE, own_crc
from armtempo.model.arm import Arm
from armtempo.robot.board_state import BoardState, JointState, SequenceStand, ToolPlace

_WIDTH, _INDENT = 80, 10
"""Columns of a terminal, and those before a table of the state."""


@click.command("status")
@options.board(options.arm_of_board)
def status(given: BoardOptions) -> None:
    """Show the board, its state and the joints' positions.

    Also while another armtempo program has the port.
    """
    given = resolve.any_port(given)
    found = _named(resolve.board_state(given), given.arm_path)
    if given.as_json:
        results.show_json(found.to_json())
        return
    for line in lines(found):
        results.echo(line)


def _named(found: BoardState, arm_path: Path | None) -> BoardState:
    """The state in degrees, if the board is set up for the arm that is set, or for the paper's."""
    named: Arm | None = None
    try:
        named = resolve.named_arm(arm_path)
    except InputError as error:  # show the board's state nevertheless
        results.remark(f"armtempo: {error}")
    if named is not None and found.arm_crc and not found.arm and not found.named(named).arm:
        resolve.remark_other_arm(named)
    return found.named(named).named(Arm.paper())


def lines(state: BoardState) -> list[str]:
    """The board, its state, and the joints' positions."""
    virtual = ", a virtual board" if state.virtual else ""
    current = "" if state.program_current else f"; installed here is {own_crc():08x}: {UPDATE}"
    return [
        f"board     {state.board_id}{virtual}",
        f"port      {state.port}",
        f"program   {state.program_crc:08x}, protocol {state.protocol}{current}",
        f"arm       {_arm(state)}",
        f"free      {state.free_flash} bytes of flash, {state.free_heap} of heap",
        f"fastest   {state.max_rate} steps/s one joint, {state.max_rate_sum} all together, {_measured(state)}",
        f"engine    {state.engine_memory}",
        *_wear(state),
        *motion_lines(state),
    ]


def _wear(state: BoardState) -> list[str]:
    """A line for a virtual board whose flash was written."""
    if not state.erasures:
        return []
    counts = ", ".join(f"{sector}: {count}" for sector, count in sorted(state.erasures.items()))
    return [f"wear      erasures by sector of the flash: {counts}; a chip's is good for 10000"]


def _measured(state: BoardState) -> str:
    return "measured" if state.rates_measured else "estimated; run 'armtempo selftest'"


def motion_lines(state: BoardState) -> list[str]:
    """The board's state and the joints' positions."""
    found = [f"state     {state.state}{_speed(state)}{_rest(state)}"]
    if state.fault:
        found.append(f"fault     {state.fault}; see 'armtempo clear'")
    found += [" " * _INDENT + line for line in joint_lines(state)]
    if state.sequence:
        found.append(_sequence(state.sequence))
    if state.said:
        first, *others = state.said.strip().split("\n")
        found += [f"said      {first}", *(" " * _INDENT + line for line in others)]
    found.append(f"link      {_link(state)}")
    return found


def _sequence(stand: SequenceStand) -> str:
    """Name, place and counters of a sequence or program."""
    if stand.name.endswith(SUFFIX):
        return f"program   {stand.name}: {stand.ending}, line {stand.step}{counted(stand.counters)}"
    from armtempo.model.steps import position, whole_cycles  # here, because a state seldom has a sequence

    is_whole = stand.ending == ENDINGS[FINISHED]
    where = whole_cycles(stand.cycle) if is_whole else position(stand.step, stand.cycle)
    return f"sequence  {stand.name}: {stand.ending}, {where}{counted(stand.counters)}"


def counted(counters: Mapping[str, int]) -> str:
    """Values of counters, as the end of a line; "" if there are none."""
    return "".join(f"; {name} {value}" for name, value in counters.items())


def _speed(state: BoardState) -> str:
    if state.speed_percent == 100.0 or not state.moving:
        return ""
    return f", at {state.speed_percent:g} % of the planned speed" if state.speed_percent else ", paused"


def _rest(state: BoardState) -> str:
    if not state.moving or not state.rest_s:
        return ""
    return (
        f", at rest in {state.rest_s:.2f} s"
        if state.state == "braking"
        else f"; a stop takes {state.rest_s:.2f} s"
    )


def joint_lines(state: BoardState) -> list[str]:
    """One line per joint: name, angle (steps), encoder angle (counts); and a line for the tool."""
    rows = [_cells(joint) for joint in state.joints]
    lines = [row.rstrip() for row in aligned(rows, (12, 10, 1, 1), _WIDTH - _INDENT)] if rows else []
    return [*lines, f"tool at {format_tool(state.tool)}"] if state.tool else lines


def format_tool(tool: ToolPlace) -> str:
    """The tool's pose in one line."""
    x, y, z = tool.position_mm
    roll, pitch, yaw = tool.rpy_deg
    return f"{x:.1f} {y:.1f} {z:.1f} mm, roll {roll:.1f}° pitch {pitch:.1f}° yaw {yaw:.1f}°"


def _link(state: BoardState) -> str:
    bad, unread = state.frames_bad, state.samples_lost
    found = f"{bad} damaged messages: check cable and plugs" if bad else "OK: no damaged messages"
    return f"{found}; {unread} samples were not read in time" if unread else found


def _arm(state: BoardState) -> str:
    if state.arm_problem:
        return state.arm_problem
    if not state.arm_crc:
        return "none; set the board up with 'armtempo configure'"
    record = f"{len(state.joints)} joints, record {state.arm_crc:08x}"
    if state.arm:
        return f"{resolve.describe_source(state.arm, state.arm_source)}: {record}"
    return f"{record}; give its file with --arm to see degrees"


def _cells(joint: JointState) -> tuple[str, str, str, str]:
    steps, counts = f"{joint.steps} steps", f"{joint.counts} counts"
    if not joint.known:
        return joint.name, "position unknown", f"({steps})", f"  ({counts})"
    if joint.position is None:
        return joint.name, steps, "", f"  {counts}"
    sign, measured = joint.unit.sign, joint.by_encoder
    encoder = "" if measured is None else f"  encoder {measured + 0.0:.2f}{sign} ({counts})"
    return joint.name, joint.unit.text(joint.position, 2), f"({steps})", encoder
