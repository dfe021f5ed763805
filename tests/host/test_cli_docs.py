"""The page on the command line has one row for every command; their options are on a page that is generated."""

from __future__ import annotations

import re
from pathlib import Path

import click
import pytest
from armtempo.cli import main

PAGE = (Path(__file__).parents[2] / "host" / "docs" / "cli.md").read_text(encoding="utf-8")


def row(name: str) -> str:
    """The line of the tables of commands that describes this one."""
    page = re.sub(r"^## JSON\n.*?^## ", "## ", PAGE, flags=re.MULTILINE | re.DOTALL)
    found = [line for line in page.splitlines() if re.search(rf"^\|[^|]*`{name}[ `]", line)]
    assert len(found) == 1, f"{name}: {found}"
    return found[0]


@pytest.mark.parametrize("name", main.list_commands(click.Context(main)))
def test_no_command_is_left_out(name: str) -> None:
    assert row(name)


def test_examples_are_commands() -> None:
    for line in PAGE.splitlines():
        words = line.split()
        if words[:1] == ["armtempo"]:
            assert main.get_command(click.Context(main), words[1]) is not None, line
