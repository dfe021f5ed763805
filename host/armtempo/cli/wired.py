"""``armtempo output`` and ``input``, over the port or through the program that has it open."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import click

from armtempo.basics.errors import LinkError
from armtempo.cli import options, resolve, results
from armtempo.cli.options import BoardOptions
from armtempo.link.board_messages import Levels
from armtempo.model.arm import Arm
from armtempo.model.outputs import Input, Output
from armtempo.robot.board_state import record_crc
from armtempo.robot.outputs import BoardAccess, BoardOutput
from armtempo.robot.shared_board import SharedBoard


@click.command("output", cls=options.TakesNumbers)
@click.argument("name", required=False)
@click.argument("value", required=False)
@options.board(options.arm_of_board)
def output(name: str | None, value: str | None, given: BoardOptions) -> None:
    """Set an output of the arm, or list them.

    NAME: an [output.NAME] of the arm file. VALUE: one of its states, such as open, or a number: 0 or 1, a
    duty of 0 to 1, degrees of a servo. Without VALUE it prints the value; without NAME, all outputs. Works
    during a motion, and while another armtempo program has the port.
    """
    with _board(given) as board:
        if name is not None:
            output = BoardOutput(board.access, board.arm, name)
            if value is not None:
                output.set(value)
        levels = board.levels().outputs
        found = [
            (entry, raw)
            for entry, raw in zip(board.arm.outputs, levels, strict=True)
            if name in (None, entry.name)
        ]
    _print(
        given, board.arm, "output", name, [_output_values(*entry) for entry in found], _output_lines(found)
    )


def _print(
    given: BoardOptions, arm: Arm, kind: str, name: str | None, values: list[dict[str, Any]], lines: list[str]
) -> None:
    """Print the arm's outputs or inputs, or the one of that ``name``."""
    if given.as_json:
        results.show_json(values if name is None else values[0])
        return
    if not lines:
        results.remark(
            f"arm {resolve.describe_arm(arm)} has no {kind}s: write [{kind}.NAME] tables in its file"
        )
    for line in lines:
        results.echo(line)


def _output_values(output: Output, raw: int) -> dict[str, Any]:
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


def _output_lines(found: list[tuple[Output, int]]) -> list[str]:
    return [
        f"{output.name:<12} {output.kind:<6} {output.pin:<4} {output.describe(raw):<16} {_choices(output)}"
        for output, raw in found
    ]


def _choices(output: Output) -> str:
    states = [f"{name} = {value:g}" for name, value in output.states]
    low, high = output.range
    return ", ".join([*states, f"{low:g} to {high:g} {output.unit}".rstrip()])


@click.command("input")
@click.argument("name", required=False)
@options.board(options.arm_of_board)
def read_inputs(name: str | None, given: BoardOptions) -> None:
    """Read the inputs of the arm.

    NAME: an [input.NAME] of the arm file; default: all. Works during a motion, and while another armtempo
    program has the port.
    """
    with _board(given) as board:
        if name is not None:
            board.arm.input(name)
        levels = board.levels()
        found = [
            (entry, levels.active(number))
            for number, entry in enumerate(board.arm.inputs)
            if name in (None, entry.name)
        ]
    values = [{"name": entry.name, "pin": entry.pin, "active": active} for entry, active in found]
    _print(given, board.arm, "input", name, values, _input_lines(found))


def _input_lines(found: list[tuple[Input, bool]]) -> list[str]:
    return [
        f"{entry.name:<12} {entry.pin:<4} {'active' if active else 'inactive'}" for entry, active in found
    ]


@dataclass(frozen=True)
class Wired:
    """Access to a board that is set up for ``arm``."""

    access: BoardAccess
    arm: Arm

    def levels(self) -> Levels:
        """The levels of its inputs and outputs."""
        return self.access.levels()


@contextmanager
def _board(given: BoardOptions) -> Iterator[Wired]:
    """Access to the board; raises LinkError if it is set up for another arm than the one that is set."""
    given = resolve.any_port(given)
    named = resolve.named_arm(given.arm_path)
    with resolve.shared_or_own(given, named) as found:
        if isinstance(found, SharedBoard):
            yield Wired(found, _same_arm(found.state().arm_crc, named))
            return
        arm = resolve.arm_of_board(found, named)
        found.configure(arm)
        yield Wired(found.client, arm)


def _same_arm(arm_crc: int, named: Arm | None) -> Arm:
    arm = named or Arm.paper()
    if record_crc(arm) != arm_crc:
        raise LinkError(
            f"the board is set up for a different arm than {resolve.describe_arm(arm)}",
            "give that arm's file with --arm",
        )
    return arm
