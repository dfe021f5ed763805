"""Help, completion and the table of commands: every command once, in groups, with examples that can be given."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest
from armtempo.cli import main
from armtempo.cli.commands import COMMANDS, GROUPS
from click.testing import CliRunner


def test_the_table_says_of_a_command_what_its_docstring_says() -> None:
    for name in COMMANDS:
        command = main.get_command(click.Context(main), name)
        assert command is not None, name
        assert command.name == name, name
        assert command.help is not None, name
        assert command.help.split("\n\n")[0].replace("\n", " ") == COMMANDS[name].summary, name
        assert COMMANDS[name].examples, name


def test_no_line_of_the_help_page_is_cut_at_80_columns() -> None:
    shown = CliRunner().invoke(main, ["--help"], terminal_width=80).output
    assert [line for line in shown.splitlines()[1:] if line.endswith("...")] == []


def test_the_help_page_and_the_tab_key_import_no_command() -> None:
    count = "len([name for name in sys.modules if name.startswith('armtempo.cli.')])"
    code = (
        "import sys, click; from armtempo.cli import main; "
        f"before = {count}; context = click.Context(main); main.get_help(context); main.shell_complete(context, ''); "
        f"print({count} - before, 'numpy' in sys.modules)"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).split() == ["0", "False"]


@pytest.mark.slow
def test_a_move_loads_no_planner_report_or_self_test() -> None:
    """A ``goto`` begins as much later as the import of what it does not need takes."""
    unused = ["planning.planner", "report.run_report", "diagnosis.selftest.selftest", "robot.motor_test"]
    code = (
        "import sys, armtempo.cli.posture, armtempo.cli.jog; "
        f"print([name for name in {unused} if 'armtempo.' + name in sys.modules], 'importlib.metadata' in sys.modules)"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).split() == ["[]", "False"]


def test_the_help_page_shows_the_groups_and_their_commands() -> None:
    page = CliRunner().invoke(main, ["--help"]).output
    for title, names in GROUPS.items():
        section = page[page.index(f"{title}:\n") :]
        for name in names:
            assert re.search(rf"^  {name} ", section, re.MULTILINE), name
    for line in re.findall(r"^    armtempo (\S+)", page, re.MULTILINE):
        assert line == "COMMAND" or line in COMMANDS


def test_an_example_is_a_command_that_can_be_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for line in [line for entry in COMMANDS.values() for line in entry.examples]:
        monkeypatch.chdir(tmp_path)
        name, *arguments = shlex.split(re.sub(r" >>? .*", "", line))
        for argument in arguments:  # what must be there is made
            if argument.startswith("runs/"):
                (tmp_path / argument).mkdir(parents=True, exist_ok=True)
        command = main.get_command(click.Context(main), name)
        assert command is not None, line
        command.make_context(name, arguments)
        page = CliRunner().invoke(main, [name, "--help"]).output
        assert f"  armtempo {line}\n" in page, line


def completed(line: str) -> set[str]:
    """What click's script for the shell is answered: kind and word."""
    words = {
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(line.split(" ")) - 1),
        "_ARMTEMPO_COMPLETE": "bash_complete",
    }
    command = [sys.executable, "-m", "armtempo"]
    done = subprocess.run(command, env={**os.environ, **words}, capture_output=True, text=True, check=True)
    return set(done.stdout.split())


@pytest.mark.slow
def test_what_the_tab_key_asks_is_answered() -> None:
    assert completed("armtempo st") == {"plain,stop", "plain,status"}
    assert completed("armtempo plan --timing p") == {"plain,per-joint"}
    assert completed("armtempo check --arm mo") == {"plain,moveo"}
    assert completed("armtempo check --arm my") == {"file,my"}


@pytest.mark.parametrize("name", ["run", "fetch", "goto", "home"])
def test_files_complete_where_an_argument_may_be_one(name: str) -> None:
    command = main.get_command(click.Context(main), name)
    assert command is not None
    offered = command.params[0].shell_complete(click.Context(command), "fir")
    assert [(item.type, item.value) for item in offered] == [("file", "fir")]
