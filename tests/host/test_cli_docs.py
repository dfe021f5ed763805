"""The page on the command line names every command, and every option that belongs to the board or to an arm file."""

from __future__ import annotations

import re
from pathlib import Path

import click
import pytest
from armtempo.cli import main

PAGE = (Path(__file__).parents[2] / "host" / "docs" / "cli.md").read_text(encoding="utf-8")
STORE = ("upload", "list", "show", "remove", "rename")
MOTION = ("home", "goto", "run", "fetch", "stop", "status", "clear")
ARMS = ("check", "import-urdf")
BOARD = ("monitor", "deploy", "undeploy", "firmware", "flash", "ports", "virtual-board")


SHARED = "\n".join(line for line in PAGE.splitlines() if line.startswith(("| `--", "WHERE is")))
"""What the page says of several commands' options at once."""


def row(name: str) -> str:
    """The line of the tables of commands that describes this one."""
    page = re.sub(r"^## JSON\n.*?^## ", "## ", PAGE, flags=re.MULTILINE | re.DOTALL)
    found = [line for line in page.splitlines() if re.search(rf"^\|[^|]*`{name}[ `]", line)]
    assert len(found) == 1, f"{name}: {found}"
    return found[0]


def has_word(text: str, word: str) -> bool:
    """Whether an option or a name stands there by itself, not as a part of another."""
    return re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", text) is not None


@pytest.mark.parametrize("name", [*STORE, *MOTION, *ARMS, *BOARD])
def test_command_is_described_with_its_options(name: str) -> None:
    command = main.get_command(click.Context(main), name)
    assert command is not None
    described = row(name)
    if name == "virtual-board":  # its options are its own affair
        return
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            for option in parameter.opts:
                assert has_word(described + SHARED, option), f"{name}: {option}"
        else:
            assert has_word(described, parameter.human_readable_name.upper()), f"{name}: {parameter.name}"


def test_a_part_of_another_word_is_no_description() -> None:
    assert has_word("`--arm ARM`", "--arm")
    assert not has_word("armtempo, `--arms`, `my--arm`", "--arm")


@pytest.mark.parametrize("name", main.list_commands(click.Context(main)))
def test_no_command_is_left_out(name: str) -> None:
    assert row(name)


def test_examples_are_commands() -> None:
    for line in PAGE.splitlines():
        words = line.split()
        if words[:1] == ["armtempo"]:
            assert main.get_command(click.Context(main), words[1]) is not None, line
