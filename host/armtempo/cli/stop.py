"""``armtempo stop`` and ``clear``: end a motion, clear a fault."""

from __future__ import annotations

import time

import click

from armtempo.basics.errors import ArmtempoError, LinkError, NoAnswerError, PortInUseError
from armtempo.cli import options, resolve, results, state
from armtempo.cli.options import BoardOptions
from armtempo.model.arm import Arm
from armtempo.ports import quick_stop
from armtempo.ports.quick_stop import StopAnswer
from armtempo.robot import shared_board
from armtempo.robot.board_state import BoardState
from armtempo.robot.running import fault_name
from armtempo.robot.shared_board import SharedBoard

_PORT_FREE_S = 5.0
"""A stopped program closes its port within this time."""
_LOOK_S = 0.1


@click.command("stop")
@click.option("--now", is_flag=True, help="Freeze the step outputs instead of braking along the path.")
@options.board()
def stop(now: bool, given: BoardOptions) -> None:
    """Brake or freeze, and print the arm's position.

    If another armtempo program has the port, that program stops the arm and ends its command.
    """
    given = resolve.any_port(given)
    answer = quick_stop.take_answer(given.port or "", now)
    if answer is not None:
        _tell(given, answer, now)
    _show(_stopped(given, now, asked=answer is not None), given.as_json)


def _stopped(given: BoardOptions, now: bool, asked: bool) -> BoardState:
    """The state after the arm has come to rest; ``asked``: the program that has the port was already asked to stop."""
    limit_s = time.monotonic() + _PORT_FREE_S
    while True:
        shared = shared_board.find(given.port or "")
        if shared is not None:
            with shared:
                if not asked:
                    _tell(given, StopAnswer(shared.stop(now, quick_stop.BY), shared.program), now)
                    asked = True
                found = _rest(shared)
            if found is not None:
                return found
        try:
            return _directly(given, now)
        except PortInUseError:  # its program is about to open the socket, or to close the port
            if time.monotonic() > limit_s:
                raise
            time.sleep(_LOOK_S)


def _tell(given: BoardOptions, answer: StopAnswer, now: bool) -> None:
    did = ("frozen" if now else "braking") if answer.moved else "nothing moved"
    results.remark(f"port {given.port}: {did}, through {answer.program}")


def _rest(shared: SharedBoard) -> BoardState | None:
    """The state at rest; None if the other program closes the port before."""
    try:
        found = shared.state()
        if found.moving and found.rest_s:
            results.remark(f"at rest in {found.rest_s:.2f} s")
        return shared.wait_for_rest()
    except NoAnswerError:
        raise
    except LinkError:
        return None


def _directly(given: BoardOptions, now: bool) -> BoardState:
    """Stop over the port itself."""
    from armtempo.link import Opening
    from armtempo.robot import connect

    how = Opening(given.log_traffic, any_program=True, take_moving=True, tell=results.remark)
    with connect.connect_now(given.port or "", None, how) as board:
        board.stop(now)
        return board.state()


def _show(found: BoardState, as_json: bool) -> None:
    if as_json:
        results.show_json(found.to_json())
        return
    for line in state.motion_lines(_with_degrees(found)):
        results.echo(line)


def _with_degrees(found: BoardState) -> BoardState:
    """``found`` in degrees if the arm is known. Slow imports do not matter: the stop was already sent."""
    if found.arm or not found.arm_crc:
        return found
    try:
        return found.named(resolve.named_arm(None)).named(Arm.paper())
    except ArmtempoError:
        return found


@click.command("clear")
@options.board()
def clear(given: BoardOptions) -> None:
    """Clear the pending fault; its cause must be gone."""
    with resolve.board(given) as board:
        before = board.status()
        board.clear()
        after = board.status()
    fault = fault_name(before.fault) if before.fault else None
    line = f"cleared: {fault}; the board is {after.state}" if fault else "no fault was pending"
    results.show(given.as_json, {"cleared": fault, "state": after.state}, [line])
