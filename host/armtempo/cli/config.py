"""``armtempo config`` and ``ports``: the settings with their sources, and the serial ports."""

from __future__ import annotations

from pathlib import Path

import click

from armtempo.basics import settings
from armtempo.basics.errors import InputError
from armtempo.basics.settings import ProjectSettings, Setting
from armtempo.cli import options, results
from armtempo.ports import board_port
from armtempo.ports.board_port import find_ports
from armtempo.ports.names import SIM


@click.command("config")
@options.arm
@options.port
@options.job
@options.out
@options.as_json
def config(
    arm_path: Path | None, port: str | None, job_path: Path | None, out: Path | None, as_json: bool
) -> None:
    """Show the arm, port, job and run folder of this folder.

    An option overrides a variable (ARMTEMPO_ARM, ARMTEMPO_PORT, ARMTEMPO_JOB, ARMTEMPO_RUNS), which overrides
    armtempo.toml in this folder or the nearest one above it.
    """
    project = ProjectSettings()
    given = {settings.ARM: arm_path, settings.PORT: port, settings.JOB: job_path, settings.RUNS: out}
    found = {name: project.get(name, value) for name, value in given.items()}
    unset = {settings.PORT: _unset_port(found)}
    if as_json:
        values = {
            name: {"value": one.value or None, "source": one.source or None} for name, one in found.items()
        }
        results.show_json({"project": str(project.file) if project.file else None, "settings": values})
        return
    results.echo(f"project   {project.file or 'none: no armtempo.toml here or above'}")
    for name, one in found.items():
        results.echo(
            f"{name:<10}{one.value} ({one.source})" if one else f"{name:<10}{unset.get(name, 'not set')}"
        )


def _unset_port(found: dict[str, Setting]) -> str:
    """The text for a port that is not set."""
    if found[settings.PORT]:
        return ""
    try:
        one = board_port.choose()
    except InputError:
        return "not set, and not exactly one board is plugged in"
    return f"{one.value} ({one.source})"


@click.command("ports")
@options.as_json
def ports(as_json: bool) -> None:
    """List the serial ports, likely boards first."""
    found = find_ports()
    if as_json:
        entries = [
            {"port": port.device, "description": port.description, "board": port.board} for port in found
        ]
        results.show_json({"ports": entries})
        return
    width = max([24, *(1 + len(port.device) for port in found)])
    for port in found:
        mark = "a MicroPython board" if port.board else ""
        results.echo(f"{port.device:<{width}}{port.description:<31} {mark}".rstrip())
    if not found:
        results.echo(
            "no serial ports found; connect a board to USB; if it has no MicroPython: armtempo flash"
        )
    results.echo(f"{SIM:<{width}}a virtual board, started for one command")
