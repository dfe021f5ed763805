"""``armtempo watch``: look on while another program moves the arm."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from armtempo.cli import chosen, options, results

_EVERY_S = 0.5


@click.command()
@options.port
@options.log_traffic
@options.as_json
def command(port: str | None, log_traffic: Path | None, as_json: bool) -> None:
    """Show samples, states and what happens, as another armtempo program that has the port hears it.

    Where no program has it, the board is asked for its state. Ctrl-C ends it; a motion under way goes on.
    """
    from armtempo.robot.shared_board import SharedBoard

    name = chosen.port(port, others=True)
    with chosen.shared_or_own(name, log_traffic, any_program=True) as board:
        if isinstance(board, SharedBoard):
            _show(board.watch("sample", "status", "event"), as_json)
            chosen.tell(f"{board.program} has given up {name}")
        else:
            _show(_states(board), as_json)


def _states(board: Any) -> Iterator[dict[str, Any]]:
    while True:
        yield {"topic": "status", "status": board.state().to_json()}
        time.sleep(_EVERY_S)


def _show(messages: Iterator[dict[str, Any]], as_json: bool) -> None:
    for message in messages:
        if as_json:
            results.show_json(message)
        else:
            click.echo(_line(message))


def _line(message: dict[str, Any]) -> str:
    topic = message["topic"]
    if topic == "sample":
        degrees = message.get("commanded_deg")
        values = (
            [f"{name} {value:.2f}°" for name, value in zip(message["joints"], degrees, strict=True)]
            if degrees
            else [f"{steps} steps" for steps in message["commanded_steps"]]
        )
        return f"{message['time_s']:9.3f} s  {'  '.join(values)}"
    if topic == "status":
        state = message["status"]
        joints = [
            f"{one['name']} {one['steps']} steps"
            if one["angle_deg"] is None
            else f"{one['name']} {one['angle_deg']:.2f}°"
            for one in state["joints"]
        ]
        return f"{state['state']:<11}  {'  '.join(joints)}"
    return "  ".join(f"{key} {value}" for key, value in message.items() if key != "topic")
