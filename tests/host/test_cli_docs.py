"""The page on the command line names every command, and every option that belongs to the board or to an arm file."""

from __future__ import annotations

from pathlib import Path

import click
import pytest
from armtempo.cli import main

PAGE = (Path(__file__).parents[2] / "host" / "docs" / "cli.md").read_text(encoding="utf-8")
STORE = ("upload", "list", "show", "remove", "rename")
MOTION = ("home", "goto", "run", "fetch", "stop", "status", "clear")
ARMS = ("check", "import-urdf")
BOARD = ("monitor", "deploy", "undeploy", "firmware", "flash", "ports", "virtual-board")


@pytest.mark.parametrize("name", [*STORE, *MOTION, *ARMS, *BOARD])
def test_command_is_described_with_its_options(name: str) -> None:
    assert f"`{name}" in PAGE
    context = click.Context(main)
    command = main.get_command(context, name)
    assert command is not None
    if name == "virtual-board":  # its options are its own affair
        return
    for parameter in command.params:
        for option in parameter.opts:
            assert option.lstrip("-").upper() in PAGE.upper(), f"{name}: {option}"


@pytest.mark.parametrize("name", main.list_commands(click.Context(main)))
def test_no_command_is_left_out(name: str) -> None:
    assert f"`{name}" in PAGE


def test_examples_are_commands() -> None:
    for line in PAGE.splitlines():
        words = line.split()
        if words[:1] == ["armtempo"]:
            assert main.get_command(click.Context(main), words[1]) is not None, line
