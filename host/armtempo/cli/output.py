"""``armtempo output``: set or list the arm's outputs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from armtempo.basics.errors import InputError
from armtempo.cli import chosen, options, results

if TYPE_CHECKING:
    from armtempo.model.outputs import Output


@click.command(context_settings={"ignore_unknown_options": True})  # so that -10 is a value
@click.argument("name", required=False)
@click.argument("value", required=False)
@options.arm_of_board
@options.port
@options.log_traffic
@options.as_json
def command(
    name: str | None,
    value: str | None,
    arm_path: Path | None,
    port: str | None,
    log_traffic: Path | None,
    as_json: bool,
) -> None:
    """Set an output of the arm, or list them.

    NAME: an [output.NAME] of the arm file. VALUE: a state of it such as open, or a number: 0 or 1, a duty of 0 to 1,
    degrees of a servo. Without VALUE: what it is set to; without NAME: all of them. Also while a motion runs, and while
    another armtempo program has the port.
    """
    from armtempo.cli import wired
    from armtempo.robot.outputs import BoardOutput

    if name is not None and name.startswith("-"):
        raise InputError(f"no such option: {name}", "see 'armtempo output --help'")
    with wired.board(port, arm_path, log_traffic) as board:
        if name is not None:
            output = BoardOutput(board.way, board.arm, name)
            if value is not None:
                output.set(value)
        levels = board.levels().outputs
        found = [
            (entry, raw)
            for entry, raw in zip(board.arm.outputs, levels, strict=True)
            if name in (None, entry.name)
        ]
    if as_json:
        _print_json([_values(*entry) for entry in found], name)
        return
    if not found:
        chosen.tell(f"arm {chosen.words(board.arm)} has no outputs: write [output.NAME] tables in its file")
    for line in _lines(found):
        click.echo(line)


def _print_json(values: list[dict[str, Any]], name: str | None) -> None:
    results.show_json(values if name is None else values[0])


def _values(output: Output, raw: int) -> dict[str, Any]:
    return {
        "name": output.name,
        "kind": output.kind,
        "pin": output.pin,
        "value": round(output.value(raw), 4),
        "unit": output.unit,
        "state": output.state(raw),
        "range": list(output.range),
        "safe": output.safe,
        "states": dict(output.states),
    }


def _lines(found: list[tuple[Output, int]]) -> list[str]:
    return [
        f"{output.name:<12} {output.kind:<6} {output.pin:<4} {output.words(raw):<16} {_choices(output)}"
        for output, raw in found
    ]


def _choices(output: Output) -> str:
    states = [f"{name} = {value:g}" for name, value in output.states]
    low, high = output.range
    return ", ".join([*states, f"{low:g} to {high:g} {output.unit}".rstrip()])
