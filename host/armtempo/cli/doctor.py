"""``armtempo doctor``: one screen about machine, project and board, to paste into a question."""

from __future__ import annotations

import os
import platform
import re
import shutil
import sys
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

import click

from armtempo.basics import installation, settings
from armtempo.basics.errors import ArmtempoError
from armtempo.basics.settings import ProjectSettings
from armtempo.cli import options, resolve, results
from armtempo.cli.options import BoardOptions
from armtempo.diagnosis import arm_check
from armtempo.diagnosis.finding import Finding, Level, error, good, note
from armtempo.link.program_version import UPDATE, own_crc
from armtempo.model import shipped
from armtempo.ports import board_port
from armtempo.ports.board_port import Port
from armtempo.robot.board_state import BoardState

_LEAST_HEAP = 8_000
"""Bytes of free heap below which a long motion may not fit."""
_LEAST_PYTHON = (3, 11)
_NO_PORT = "connect a board by its USB socket, or use --port sim; a board without MicroPython: armtempo flash"
_GROUP = "sudo usermod -a -G dialout $USER, then log in again"


@click.command("doctor")
@options.arm
@options.port
@options.as_json
def doctor(arm_path: Path | None, port: str | None, as_json: bool) -> None:
    """Check the installation, the project and the board.

    Nothing is changed and nothing moves. Without a port it checks the one board that is plugged in, if any.
    Exit code 1 if something is wrong.
    """
    parts = {
        "machine": machine(),
        "packages": packages(),
        "ports": ports(),
        "project": _project(arm_path, port),
        "arm": _arm(arm_path),
        "board": _board(port, arm_path),
    }
    wrong = any(item.level is Level.ERROR for items in parts.values() for item in items)
    if as_json:
        results.show_json({part: [_values(item) for item in items] for part, items in parts.items()})
    else:
        _print(parts)
    if wrong:
        raise SystemExit(1)


def _project(arm_path: Path | None, port: str | None) -> list[Finding]:
    project = ProjectSettings()
    given = {settings.ARM: arm_path, settings.PORT: port}
    try:
        found = [project.get(name, given.get(name)) for name in settings.NAMES]
    except ArmtempoError as refused:
        return [error("armtempo.toml", str(refused), "correct that")]
    return [good(one.name, f"{one.value} ({one.source})" if one else "not set") for one in found]


def _arm(arm_path: Path | None) -> list[Finding]:
    try:
        setting = ProjectSettings().get(settings.ARM, arm_path)
        return arm_check.examine_arm(shipped.find(setting.value).path) if setting else []
    except ArmtempoError as refused:
        return [error("arm file", str(refused), "give an existing arm file")]


def _board(port: str | None, arm_path: Path | None) -> list[Finding]:
    try:
        name = board_port.choose(port, others=True).value
    except ArmtempoError:  # no port is set and no board is plugged in: not an error
        return [note("board", "not checked", "give --port PORT, or --port sim")]
    try:
        return examine_board(_named(resolve.board_state(BoardOptions(name)), arm_path))
    except ArmtempoError as refused:
        return examine_board(refused)


def _named(state: BoardState, arm_path: Path | None) -> BoardState:
    """``state`` with the arm's name, if the board is set up for the arm that is set here."""
    try:
        arm = resolve.named_arm(arm_path)
    except ArmtempoError:  # already reported with the arm
        return state
    return state if arm is None else state.named(arm)


def _values(item: Finding) -> dict[str, str]:
    return {
        "what": item.where,
        "found": item.what,
        "level": item.level.word,
        "next_step": item.next_step,
    }


def _print(parts: dict[str, list[Finding]]) -> None:
    width = max(len(item.where) for items in parts.values() for item in items)
    for part, items in parts.items():
        if items:
            results.echo(part)
        for item in items:
            results.echo(f"  {item.level.word:<6}{item.where:<{width}}  {item.what}")
            if item.next_step:
                results.echo(f"  {'':<6}{'':<{width}}  -> {item.next_step}")


def examine_board(state: BoardState | ArmtempoError) -> list[Finding]:
    """Findings about a board's state, or about the error with which it could not be read."""
    if isinstance(state, ArmtempoError):
        return [error("board", str(state), "see 'armtempo help recovery' for each of its states")]
    found = [
        good("board", f"{state.board_id}{' (virtual)' if state.virtual else ''}, port {state.port}"),
        _program(state),
        _memory(state),
        good(
            "arm on the board", state.arm or (f"record {state.arm_crc:08x}" if state.arm_crc else "none yet")
        ),
        good("state", state.state),
    ]
    if state.arm_problem:
        found.append(error("stored arm", state.arm_problem, "armtempo configure"))
    if state.fault:
        found.append(error("fault", state.fault, "remove its cause, then 'armtempo clear'"))
    if state.frames_bad:
        text = f"{state.frames_bad} damaged messages"
        found.append(note("link", text, "if it continues, try another cable or USB socket"))
    return found


def _program(state: BoardState) -> Finding:
    text = f"{state.program_crc:08x}, protocol {state.protocol}"
    if state.program_current:
        return good("program", f"{text}, as installed here")
    return error("program", f"{text}, which differs from the one installed here, {own_crc():08x}", UPDATE)


def _memory(state: BoardState) -> Finding:
    text = f"{state.free_heap} bytes of heap, {state.free_flash} of flash"
    if state.free_heap >= _LEAST_HEAP:
        return good("free", text)
    return note("free", text, "flash a firmware with the program built in: 'armtempo flash'")


def machine() -> list[Finding]:
    """Versions of armtempo, Python and the operating system."""
    python = f"{platform.python_version()} ({platform.python_implementation()})"
    fits = sys.version_info[:2] >= _LEAST_PYTHON
    least = ".".join(map(str, _LEAST_PYTHON))
    found = good("Python", python) if fits else error("Python", python, f"install Python {least} or newer")
    system = good("system", f"{platform.system()} {platform.release()}, {platform.machine()}")
    return [good("armtempo", installation.installed_version()), found, _flash_tool(), system]


def _flash_tool() -> Finding:
    found = shutil.which("dfu-util") or shutil.which("st-flash")
    if found:
        return good("flash tool", found)
    return note("flash tool", "not installed", "for 'armtempo flash': install dfu-util")


def packages() -> list[Finding]:
    """Each required or optional package, with its version, or how to install it."""
    found: dict[str, Finding] = {}
    for requirement in requires("armtempo") or []:
        name = re.split(r"[^A-Za-z0-9._-]", requirement)[0]
        extra = re.search(r"extra == ['\"](\w+)['\"]", requirement)
        if extra is not None and extra[1] == "docs":  # for developers
            continue
        if not (name in found or "platform_machine" in requirement):  # which also has an extra
            found[name] = _package(name, extra[1] if extra else "")
    return [*found.values()]


def _package(name: str, extra: str) -> Finding:
    """A package of the core (``extra`` = "") or of an extra."""
    try:
        return good(name, version(name))
    except PackageNotFoundError:
        if extra:
            advice = f"{installation.command(name, extra)} if you want it"
            return note(name, "not installed", advice)
        return error(name, "missing", "install armtempo again, as it was installed")


def ports() -> list[Finding]:
    """The serial ports, and whether this user can open them."""
    found = [_port(port) for port in board_port.find_ports()]
    return found or [note("ports", "none", _NO_PORT)]


def _port(port: Port) -> Finding:
    what = f"{port.description or 'serial port'}{', a MicroPython board' if port.board else ''}"
    if sys.platform == "linux" and not os.access(port.device, os.R_OK | os.W_OK):
        level = Level.ERROR if port.board else Level.NOTE
        return Finding(level, port.device, f"{what}; no permission to open it", _GROUP)
    return good(port.device, what)
