"""``armtempo program``: a user's program, checked, stored and run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from armtempo.basics.errors import MissingPackageError
from armtempo.cli import options, resolve, results
from armtempo.cli.options import BoardOptions
from armtempo.cli.results import ProgressBar
from armtempo.cli.sequences import StateLine
from armtempo.cli.state import counted
from armtempo.deploy import program_files
from armtempo.encoding import encoded_program
from armtempo.encoding.encoded_program import EncodedProgram
from armtempo.model.arm import Arm
from armtempo.model.user_program import UserProgram
from armtempo.planning import workspace_check
from armtempo.robot.board import Board
from armtempo.robot.stop_request import Stopped


@click.command("program")
@click.argument("file", type=options.PATH)
@click.option("--check", is_flag=True, help="Only check the program; no board is needed.")
@options.force("something else of its name, or of its motions' names, on the board")
@options.board(options.arm, options.replace_arm)
def program(file: Path, check: bool, force: bool, given: BoardOptions) -> None:
    """Check a program in MicroPython, store it and run it.

    FILE: a Python file with 'from armtempo_board import cell'; 'armtempo help programs' explains it. Motions that
    it names are planned files NAME.json beside it, or on the board. The arm must be homed ('armtempo home'), unless
    the program homes it. Ctrl-C, or 'armtempo stop' in another terminal, brakes and ends it; 'armtempo status' shows
    its line. 'armtempo upload FILE --default' only stores it, for the board's button.
    """
    arm = resolve.load_arm(given.arm_path)
    found = load(file, arm)
    if check:
        _show_check(
            encoded_program.of_program(found, arm, encoded_program.motions_beside(found, arm)), given.as_json
        )
        return
    with resolve.board(given, arm) as board:
        encoded = store(board, found, arm, given, force)
        results.progress_printer(given.as_json)(_stored(encoded))
        run_and_report(board, found.name, given.as_json)


def load(file: Path, arm: Arm) -> UserProgram:
    """The program of a file, compiled as MicroPython does, which knows less syntax than Python."""
    found = UserProgram.load(file, arm)
    try:
        program_files.check_syntax(found.path, found.source)
    except MissingPackageError as error:
        results.remark(f"its syntax is not checked for MicroPython: {error}")
    return found


def store(
    board: Board, found: UserProgram, arm: Arm, given: BoardOptions, force: bool, as_default: bool = False
) -> EncodedProgram:
    """Store a program with its motions, and say which moves would leave the workspace."""
    board.configure(arm, replace=given.replace_arm)
    encoded = board.encode_program(found, arm)
    _warn(encoded)
    with ProgressBar("uploading") as progress:
        board.upload_program(encoded, progress, force, as_default)
    return encoded


def _stored(encoded: EncodedProgram) -> str:
    name = encoded.program.name
    return f"{name}: {len(encoded.data)} bytes stored, {encoded.heap_bytes} bytes of heap"


def upload_and_report(file: Path, as_default: bool, force: bool, given: BoardOptions) -> None:
    """Store the program of a file."""
    arm = resolve.load_arm(given.arm_path)
    found = load(file, arm)
    with resolve.board(given, arm) as board:
        encoded = store(board, found, arm, given, force, as_default)
        virtual = board.info.virtual
    values = {"name": found.name, "program": True, "size_bytes": len(encoded.data), "virtual": virtual}
    results.show(given.as_json, values, [_stored(encoded)])


def _warn(encoded: EncodedProgram) -> list[str]:
    problems = encoded_program.moves_that_touch(encoded)
    for problem in problems:
        results.remark(f"a straight move {problem}; the board does not check that")
    return problems


def _show_check(encoded: EncodedProgram, as_json: bool) -> None:
    found = encoded.program
    with_it = {motion.name for motion in encoded.motions}
    values: dict[str, Any] = {
        "name": found.name,
        "size_bytes": len(encoded.data),
        "heap_bytes": encoded.heap_bytes,
        "postures": [*found.postures],
        "motions": [*found.motions],
        "not_beside_it": [name for name in found.motions if name not in with_it],
        "counters": [*found.counters],
        "pallets": {name: len(next(iter(each.values()))) for name, each in encoded.places.items()},
        "off_line_mm": encoded_program.off_line_mm(encoded),
        "touches": _warn(encoded),
        "homes": bool(found.homes),
    }
    lines = [f"{found.file}: {len(encoded.data)} bytes, {encoded.heap_bytes} bytes of heap on the board"]
    lines += [f"pallet {name}: {places} places" for name, places in values["pallets"].items()]
    if encoded.places:
        beside = f"{values['off_line_mm']:.2g} mm beside the straight line"
        lines.append(f"on the way from above a place to it the tool is up to {beside}")
    if found.homes:
        lines.append("it homes the arm itself, so that it may be started before that")
        if workspace_check.can_touch(encoded.arm):
            lines.append("its ways to the switches are not checked against the workspace: it begins anywhere")
    lines += [f"must be on the board: {name}" for name in values["not_beside_it"]]
    results.show(as_json, values, lines)


def run_and_report(board: Board, name: str, as_json: bool) -> None:
    """Run a stored program; print what it prints, and its end."""
    say = results.progress_printer(as_json)
    shown = StateLine(lambda state: f"line {state.step}")

    def listen(text: str) -> None:
        shown.clear()
        say(text)

    try:
        end = board.run_program(name, listen, shown)
    except Stopped:
        listen(f"stopped in line {board.client.sequence().step}{counted(board.counters)}")
        raise
    finally:
        shown.clear()
    values = {"name": end.name, "ending": end.ending, "line": end.step, "counters": board.counters}
    results.show(as_json, values, [f"{end.ending}{counted(board.counters)}"])
