"""``armtempo stop``: end a motion."""

from __future__ import annotations

import time
from pathlib import Path

import click

from armtempo.basics.errors import LinkError, NoAnswerError, PortInUseError
from armtempo.cli import chosen, options, results
from armtempo.project import quick_stop
from armtempo.project.quick_stop import StopAnswer
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
    answer = quick_stop.take_answer(name, now)
    if answer is not None:
        _tell(name, answer, now)
    _show(_stopped(name, log_traffic, now, told=answer is not None), as_json)


def _stopped(name: str, log_traffic: Path | None, now: bool, told: bool) -> BoardState:
    """Where the arm has come to rest; ``told``: the program that has the port knows already."""
    limit_s = time.monotonic() + _PORT_FREE_S
    while True:
        shared = shared_board.find(name)
        if shared is not None:
            with shared:
                if not told:
                    _tell(name, StopAnswer(shared.stop(now, quick_stop.BY), shared.program), now)
                    told = True
                found = _rest(shared)
            if found is not None:
                return found
        try:
            return _directly(name, log_traffic, now)
        except PortInUseError:  # its program answers for it soon, or gives it up
            if time.monotonic() > limit_s:
                raise
            time.sleep(_LOOK_S)


def _tell(port: str, answer: StopAnswer, now: bool) -> None:
    did = ("frozen" if now else "braking") if answer.moved else "nothing moved"
    chosen.tell(f"port {port}: {did}, through {answer.program}")


def _rest(shared: SharedBoard) -> BoardState | None:
    """Where the arm comes to rest; None where the other program gives up the port before."""
    try:
        state = shared.state()
        if state.moving and state.rest_s:
            chosen.tell(f"at rest in {state.rest_s:.2f} s")
        return shared.wait_for_rest()
    except NoAnswerError:
        raise
    except LinkError:
        return None


def _directly(port: str, log_traffic: Path | None, now: bool) -> BoardState:
    """Stop over the port itself."""
    with chosen.board(port, log_traffic, any_program=True, wait=False) as board:
        board.stop(now)
        return board.state()


def _show(found: BoardState, as_json: bool) -> None:
    if as_json:
        results.show_json(found.to_json())
        return
    from armtempo.cli import state

    for line in state.motion_lines(_with_degrees(found)):
        click.echo(line)


def _with_degrees(found: BoardState) -> BoardState:
    """The same in degrees, where the arm is known; the stop is done by now, so it may take a while."""
    if found.arm or not found.arm_crc:
        return found
    from armtempo.basics.errors import ArmtempoError
    from armtempo.model.arm import Arm

    try:
        return found.named(chosen.named_arm(None)).named(Arm.paper())
    except ArmtempoError:
        return found
