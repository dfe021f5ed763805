"""``armtempo watch`` and ``monitor``: state and traffic of a board that another program uses."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import click

from armtempo.cli import options, resolve, results
from armtempo.cli.options import BoardOptions
from armtempo.link import traffic
from armtempo.link.traffic import Chunk
from armtempo.model.joint_unit import DEG, MM, NEUTRAL
from armtempo.robot.shared_board import SharedBoard

_STATE_S = 0.5


@click.command("watch")
@options.board()
def watch(given: BoardOptions) -> None:
    """Show what another armtempo program does with the port.

    Samples, states and events. If no program has the port, it prints the board's state. Ctrl-C ends it; a running
    motion continues.
    """
    given = resolve.any_port(given)
    with resolve.shared_or_own(given, any_program=True) as board:
        if isinstance(board, SharedBoard):
            _show_messages(board.watch("sample", "status", "event"), given.as_json)
            results.remark(f"{board.program} has closed {given.port}")
        else:
            _show_messages(_states(board), given.as_json)


def _states(board: Any) -> Iterator[dict[str, Any]]:
    while True:
        yield {"topic": "status", "status": board.state().to_json()}
        time.sleep(_STATE_S)


def _show_messages(messages: Iterator[dict[str, Any]], as_json: bool) -> None:
    for message in messages:
        if as_json:
            results.show_json(message)
        else:
            results.echo(_message_line(message))


def _message_line(message: dict[str, Any]) -> str:
    topic = message["topic"]
    if topic == "sample":
        values = [f"{steps} steps" for steps in message["commanded_steps"]]
        if "joints" in message:
            signs = [MM.sign if unit == MM.name else DEG.sign for unit in message.get("units", ())]
            at = message[NEUTRAL["commanded_deg"] if signs else "commanded_deg"]
            rows = zip(message["joints"], at, signs or [DEG.sign] * len(at), strict=True)
            values = [f"{name} {value:.2f}{sign}" for name, value, sign in rows]
        return f"{message['time_s']:9.3f} s  {'  '.join(values)}"
    if topic == "status":
        state = message["status"]
        joints = [
            f"{one['name']} {one['position_mm']:.2f}{MM.sign}"
            if "position_mm" in one
            else f"{one['name']} {one['steps']} steps"
            if one["angle_deg"] is None
            else f"{one['name']} {one['angle_deg']:.2f}°"
            for one in state["joints"]
        ]
        return f"{state['state']:<11}  {'  '.join(joints)}"
    return "  ".join(f"{key} {value}" for key, value in message.items() if key != "topic")


_POLL_S = 1.0
Say = Callable[[float, str, list[str]], None]


@click.command("monitor")
@click.argument("file", required=False, type=options.PATH)
@options.board()
def monitor(file: Path | None, given: BoardOptions) -> None:
    """Show decoded traffic.

    FILE: a log of '--log-traffic FILE'; without it, the traffic of the armtempo program that has the port,
    else of a status request each second. Ctrl-C ends it; a running motion continues. With --json each line is
    a document.
    """
    say = _print_json if given.as_json else _print
    if file is not None:
        _show_file(file, say)
        return
    given = resolve.any_port(given)
    with resolve.shared_or_own(given, any_program=True, sink=partial(_show_chunk, say)) as board:
        if isinstance(board, SharedBoard):
            for message in board.watch("traffic"):
                say(message["time_s"], message["direction"], message["words"])
            results.remark(f"{board.program} has closed {given.port}")
            return
        while True:
            board.status()
            board.client.session.poll(_POLL_S)
            board.client.session.events.clear()


def _show_file(file: Path, say: Say) -> None:
    decoder = traffic.Decoder()
    for chunk in traffic.read_log(file):
        _show_chunk(say, chunk, decoder.feed(chunk.direction, chunk.data))


def _show_chunk(say: Say, chunk: Chunk, words: list[str]) -> None:
    say(chunk.time_s, chunk.direction, words)


def _print(time_s: float, direction: str, words: list[str]) -> None:
    for line in words:
        results.echo(f"{time_s:10.4f} {direction} {line}")


def _print_json(time_s: float, direction: str, words: list[str]) -> None:
    results.show_json({"time_s": time_s, "direction": direction, "words": words})
