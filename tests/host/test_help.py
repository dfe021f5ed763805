"""The help page has every command once, in groups; the Tab key completes."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from armtempo.cli import COMMANDS, GROUPS, main
from click.testing import CliRunner


def test_every_command_is_in_one_group_and_has_its_module() -> None:
    assert len(COMMANDS) == len(set(COMMANDS))
    folder = Path(str(sys.modules[main.__module__].__file__)).parent
    modules = {path.stem.rstrip("_").replace("_", "-") for path in folder.glob("*.py")}
    assert set(COMMANDS) <= modules


def test_the_help_page_shows_the_groups_and_their_commands() -> None:
    page = CliRunner().invoke(main, ["--help"]).output
    for title, names in GROUPS.items():
        section = page[page.index(f"{title}:\n") :]
        for name in names:
            assert re.search(rf"^  {name} ", section, re.MULTILINE), name
    for line in re.findall(r"^    armtempo (\S+)", page, re.MULTILINE):
        assert line == "COMMAND" or line in COMMANDS


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_completion_script_for(shell: str) -> None:
    done = CliRunner().invoke(main, ["completion", shell])
    assert done.exit_code == 0
    assert "_ARMTEMPO_COMPLETE" in done.output


def test_what_the_script_asks_is_answered() -> None:
    words = {"COMP_WORDS": "armtempo st", "COMP_CWORD": "1", "_ARMTEMPO_COMPLETE": "bash_complete"}
    command = [sys.executable, "-m", "armtempo"]
    done = subprocess.run(command, env={**os.environ, **words}, capture_output=True, text=True)
    assert {line.partition(",")[2] for line in done.stdout.split()} == {"stop", "status"}
