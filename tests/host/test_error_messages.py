"""Every message of the program says what to do next: errors, refusals of the board, usage errors."""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import click
import pytest
from armtempo import cli
from armtempo.basics import errors
from armtempo.cli import LazyGroup
from armtempo.link.refusal import refusal
from armtempo_shared import codes, wire
from click.testing import CliRunner, Result

from tests import sources
from tests.host.error_messages import ErrorMessage, in_host, in_source

TAKES_DASHES = ("goto", "home", "fk", "output")
"""Their argument may begin with a minus: what looks like an option is taken for angles, or for an output."""
UNKNOWN_CODE = 200


def has_hint(message: ErrorMessage) -> bool:
    """Whether a next step is given: words, or an expression that carries them, without a full stop."""
    hint = (message.hint or "").strip()
    return bool(hint) and not hint.endswith(".") and (hint.startswith("{") or " " in hint or ":" in hint)


@pytest.mark.slow
@sources.TOGETHER
def test_every_error_of_the_host_says_what_to_do_next() -> None:
    lacking = [
        f"{message.file}:{message.line}: {message.kind}({message.problem!r})"
        for message in in_host()
        if not has_hint(message)
    ]
    assert lacking == [], "without a next step: give a second argument, a clause such as 'plan it again'"


@pytest.mark.slow
def test_the_collector_finds_what_has_no_next_step() -> None:
    source = """
raise InputError("no")
raise errors.InputError(f"no {it}", hint=f"take {other}")
reason = LinkError("no", "ask again")
raise ValueError("no")
raise PlanError("no", "")
raise PlanError("no", "Stop.")
raise LinkError(error.problem, error.hint)
"""
    found = list(in_source(source, "x.py"))
    assert [has_hint(one) for one in found] == [False, True, True, False, False, True]
    assert found[1].problem == "no {it}"
    assert len(in_host()) > 150


def test_every_code_of_the_board_has_its_meaning_and_cure() -> None:
    numbers = {value for name, value in vars(codes).items() if name.isupper() and isinstance(value, int)}
    assert numbers == set(wire.ERRORS)
    for code in [*numbers, UNKNOWN_CODE]:
        error = refusal("no", code, 0, 1)
        assert error.problem.startswith("no: ")
        assert " " in error.hint
        assert not error.hint.endswith(".")


def commands() -> list[str]:
    """All commands of the program."""
    assert isinstance(cli.main, LazyGroup)
    return cli.main.list_commands(click.Context(cli.main))


def armtempo(*words: str) -> Result:
    """What a command line gives."""
    return CliRunner().invoke(cli.main, list(words), prog_name="armtempo")


@pytest.mark.parametrize("name", commands())
def test_every_usage_error_has_a_next_step(name: str) -> None:
    result = armtempo(name, "--no-such-option")
    assert result.exit_code == 2
    if name in TAKES_DASHES:
        assert re.search(
            "\nhint: (give angles in degrees|write it like|see 'armtempo output --help')", result.output
        )
    else:
        assert f"Try 'armtempo {name} --help' for help." in result.output


def test_usage_errors_of_the_group_name_the_help_page() -> None:
    result = armtempo("no-such-command")
    assert result.exit_code == 2
    assert "Try 'armtempo --help' for help." in result.output


def test_no_command_raises_errors_of_click_itself() -> None:
    for path in Path(cli.__file__).parent.glob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"raise click\.|click\.(UsageError|BadParameter)\(", text), path.name


def test_an_error_is_shown_on_two_lines() -> None:
    result = armtempo("home", "x", "--switches", "--port", "sim")
    assert result.exit_code == 2
    first, second = result.stderr.splitlines()
    assert first == "armtempo: WHERE and --switches exclude each other"
    assert second.startswith("hint: give the present posture as WHERE")


def test_files_and_memory_have_a_next_step(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def fails(error: Exception) -> str:
        def invoke(*_: object) -> None:
            raise error

        monkeypatch.setattr(click.Group, "invoke", invoke)
        result = armtempo("ports")
        assert result.exit_code == 1
        return result.stderr

    assert "x.toml: No such file" in (text := fails(FileNotFoundError(2, "No such file", "x.toml")))
    assert "\nhint: check the path" in text
    assert "\nhint: " in fails(MemoryError())


def test_an_error_reads_as_one_line_too() -> None:
    error = errors.InputError("x is 3", "give 4")
    assert str(error) == "x is 3; give 4"
    assert str(errors.InputError("x is 3")) == "x is 3"
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
    missing = errors.MissingPackageError("a figure", "matplotlib", "plot")
    assert missing.hint == "install it with: pip install 'armtempo[plot]'"
