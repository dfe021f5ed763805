"""``armtempo stop``: end a motion."""

from __future__ import annotations

import time
from pathlib import Path

import click

from armtempo.cli import chosen, options
from armtempo.errors import LinkError, NoAnswerError, PortError
from armtempo.robot import shared_board
from armtempo.robot.board_state import BoardState
from armtempo.robot.shared_board import SharedBoard

_PORT_FREE_S = 5.0
"""A program that was stopped gives its port up within this time."""
_LOOK_S = 0.1


@click.command()
@click.option("--now", is_flag=True, help="Freeze the step outputs instead of braking along the path.")
@options.port
@options.log_traffic
@options.as_json
def command(now: bool, port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """Brake or freeze, and say where the arm stands.

    Where another armtempo program has the port, it is told to stop and ends what it does.
    """
    name = chosen.port(port, others=True)
    shared = shared_board.find(name)
    found = None if shared is None else _through(shared, name, now)
    if found is None:
        found = _directly(name, log_traffic, now, _PORT_FREE_S if shared else 0.0)
    _show(found, as_json)


def _through(shared: SharedBoard, port: str, now: bool) -> BoardState | None:
    """Stop through the program that has the port; None where that gives up the port before the arm rests."""
    with shared:
        moving = shared.stop(now, "'armtempo stop'")
        did = ("frozen" if now else "braking") if moving else "nothing moved"
        chosen.tell(f"port {port}: {did}, through {shared.program}")
        try:
            return shared.wait_for_rest()
        except NoAnswerError:
            raise
        except LinkError:
            return None


def _directly(port: str, log_traffic: Path | None, now: bool, patience_s: float) -> BoardState:
    """Stop over the port itself, for which to wait ``patience_s``."""
    limit_s = time.monotonic() + patience_s
    while True:
        try:
            with chosen.board(port, log_traffic, any_program=True) as board:
                board.stop(now)
                return board.state()
        except PortError:
            if time.monotonic() > limit_s:
                raise
            time.sleep(_LOOK_S)


def _show(found: BoardState, as_json: bool) -> None:
    if as_json:
        import json

        click.echo(json.dumps(found.to_json()))
        return
    from armtempo.cli import state

    for line in state.motion_lines(_with_degrees(found)):
        click.echo(line)


def _with_degrees(found: BoardState) -> BoardState:
    """The same in degrees, where the arm is known; the stop is done by now, so it may take a while."""
    if found.arm or not found.arm_crc:
        return found
    from armtempo.errors import ArmtempoError
    from armtempo.model.arm import Arm

    try:
        return found.named(chosen.named_arm(None)).named(Arm.paper())
    except ArmtempoError:
        return found
