"""Every message says what to do next: errors, usage errors, refusals of the board with cause, joint and number."""

from __future__ import annotations

import ast
import pickle
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import click
import pytest
import serial
from armtempo import cli
from armtempo.basics import errors, toml_table
from armtempo.basics.errors import BoardError, InputError, LinkError, MissingPackageError
from armtempo.cli import LazyGroup, state
from armtempo.cli.help import TOPICS, page
from armtempo.link.refusal import describe_notice, refusal
from armtempo.link.transport import SerialTransport
from armtempo.robot import board_state, running
from armtempo.robot.board import Board
from armtempo_shared import codes, wire
from armtempo_shared.limits import MAX_MOTION_BYTES
from armtempo_shared.meanings import VALUES
from click.testing import CliRunner, Result

from tests import sources
from tests.inprocess import Pipe, ready
from tests.sources import parsed

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
@sources.TOGETHER
def test_no_error_says_its_hint_in_its_problem_too() -> None:
    """Clauses of several words; the two are shown together."""
    twice = [
        f"{message.file}:{message.line}: {clause}"
        for message in in_host()
        for clause in map(str.strip, re.split("[;:]", message.hint or ""))
        if clause.count(" ") > 1 and clause in message.problem
    ]
    assert twice == []


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
    assert re.search(rf"Try 'armtempo {name} (--help|-h)' for help\.", result.output)  # click 8.2 names -h
    assert "No such option" in result.output


def test_a_misspelt_command_names_the_nearest_and_the_help_page() -> None:
    result = armtempo("stauts")
    assert result.exit_code == 2
    assert "did you mean 'status'" in result.stderr
    assert re.search(r"Try 'armtempo (--help|-h)' for help\.", result.output)


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
    assert re.fullmatch(r"install it with: pip install 'matplotlib>=[\d.]+'", missing.hint or "")


HOST = Path(errors.__file__).parents[1]
MADE_FROM_PARTS = {"MissingPackageError"}
"""Classes that write their own problem and hint."""


@dataclass(frozen=True)
class ErrorMessage:
    """One place where an error is made; ``problem`` and ``hint`` are source text, as in an f-string.

    ``hint`` is None if none is given.
    """

    file: str
    line: int
    kind: str
    problem: str
    hint: str | None


def tree_of(kind: type[Exception] = errors.ArmtempoError) -> Iterator[str]:
    """Names of the classes of armtempo's errors."""
    yield kind.__name__
    for below in kind.__subclasses__():
        yield from tree_of(below)


def in_source(text: str, file: str) -> Iterator[ErrorMessage]:
    """All errors that a module makes, raised there or not."""
    kinds = set(tree_of()) - MADE_FROM_PARTS
    if not any(kind in text for kind in kinds):
        return
    for node in ast.walk(parsed(text)):
        if isinstance(node, ast.Call) and (name := _last_name(node.func)) in kinds:
            given = {word.arg: word.value for word in node.keywords}
            arguments = dict(zip(("problem", "hint"), node.args, strict=False)) | given
            hint = _words(arguments["hint"]) if "hint" in arguments else None
            yield ErrorMessage(file, node.lineno, name, _words(arguments.get("problem")), hint)


def in_host() -> list[ErrorMessage]:
    """All errors that the host makes."""
    return [
        message
        for path in sorted(HOST.rglob("*.py"))
        if "hardware" not in path.parts
        for message in in_source(path.read_text(encoding="utf-8"), str(path.relative_to(HOST)))
    ]


def _last_name(node: ast.expr) -> str:
    """``C`` of ``a.b.C``; nothing of what has no name."""
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def _words(node: ast.expr | None) -> str:
    """The text of a literal, ``{expression}`` for what is put in; another expression as it stands, in braces."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(
            str(part.value) if isinstance(part, ast.Constant) else f"{{{ast.unparse(part.value)}}}"
            for part in node.values
            if isinstance(part, ast.Constant | ast.FormattedValue)
        )
    return f"{{{ast.unparse(node)}}}" if node is not None else ""


# messages that once left newcomers without a next step


def test_a_cable_that_is_out_is_called_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def gone(*_: object) -> bytes:
        raise serial.SerialException(
            "device reports readiness to read but returned no data (device disconnected or multiple access on port?)"
        )

    transport = SerialTransport("loop://")
    monkeypatch.setattr(transport._serial, "read", gone)
    with pytest.raises(LinkError) as caught:
        transport.read(0.1)
    assert caught.value.problem == (
        "the connection to loop:// broke: its cable was unplugged, or the board was reset"
    )
    assert caught.value.hint.startswith("plug it in again")
    assert "readiness" not in str(caught.value)


def test_a_motion_has_to_be_named_where_the_button_starts_none(tmp_path: Path) -> None:
    client, _ = ready(Pipe(tmp_path / "flash"))
    client.set_default("")
    with pytest.raises(InputError) as caught:
        Board(client, "pipe").fetch(None, tmp_path)
    assert caught.value.problem.startswith("no motion given")
    assert "armtempo fetch NAME" in caught.value.hint


def test_a_sound_link_is_called_so(tmp_path: Path) -> None:
    client, _ = ready(Pipe(tmp_path / "flash"))
    found = board_state.read(client, "pipe")
    assert "link      OK: no damaged messages" in state.lines(found)
    worse = state.lines(replace(found, frames_bad=3, samples_lost=2))
    assert "link      3 damaged messages: check cable and plugs; 2 samples were not read in time" in worse
    unread = state.lines(replace(found, samples_lost=2))  # of a run that the button started
    assert "link      OK: no damaged messages; 2 samples were not read in time" in unread


def test_a_misspelt_key_is_guessed() -> None:
    table = toml_table.parse("lenght = 3", "x.toml")
    table.number("length", 1.0)
    with pytest.raises(InputError) as caught:
        table.done()
    assert caught.value.problem == "x.toml: lenght: unknown key"
    assert caught.value.hint == "did you mean 'length'? known here: length"


def test_a_board_that_takes_nothing_is_not_waited_for_forever() -> None:
    assert SerialTransport("loop://")._serial.write_timeout == 2.0


def test_a_speed_is_1_to_100_percent() -> None:
    assert [running.permille(fraction) for fraction in (0.01, 1.0)] == [10, 1000]
    for fraction in (0.009, 1.001):
        with pytest.raises(InputError, match=r"give a fraction of 0\.01 to 1"):
            running.permille(fraction)


@pytest.mark.long
def test_words_that_users_read_name_no_file_of_the_checkout() -> None:
    """A wheel has no folder ``host/docs``: messages name a topic of ``armtempo help``."""
    package = Path(str(files("armtempo")))
    pages = re.compile(r"(host|board|shared)/docs/")
    for path in [*package.rglob("*.py"), *(package.parents[1] / "shared").rglob("meanings.py")]:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
                assert not pages.search(node.value), (path, node.value)


@pytest.mark.parametrize("topic", TOPICS)
def test_each_topic_of_help_has_its_page(topic: str) -> None:
    assert page(topic).startswith("# ")


@pytest.mark.parametrize(
    ("mark", "said"),
    [
        ("", "pip install 'yourdfpy>=0.0.60'"),
        ("pipx_metadata.json", "pipx inject armtempo 'yourdfpy>=0.0.60'"),
        ("uv-receipt.toml", "uv pip install --python {prefix} 'yourdfpy>=0.0.60'"),
    ],
)
def test_a_missing_package_is_got_as_armtempo_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mark: str, said: str
) -> None:
    if mark:
        (tmp_path / mark).touch()
    monkeypatch.setattr("sys.prefix", str(tmp_path))
    said = said.format(prefix=tmp_path)
    assert MissingPackageError("x", "yourdfpy", "urdf").hint == f"install it with: {said}"


def test_all_packages_of_an_extra_are_named() -> None:
    hint = MissingPackageError("x", "segno", "panel").hint
    assert re.findall(r"'(\w+)>=", hint or "") == ["nicegui", "segno", "tomlkit"]


# what the host says if the board refuses: the cause, the joint, the number, what to do


NUMBERS = sorted(VALUES.keys() - {"too_fast", "too_long", "pin_taken"})
"""Names of codes whose number is said as the table of meanings has it."""


@pytest.mark.parametrize("name", NUMBERS)
def test_every_number_is_said_with_what_it_is(name: str) -> None:
    code = wire.ERROR_CODES[name]
    _, meaning, cure = wire.ERRORS[code]
    error = refusal("no", code, 1, 4711)
    assert error.code == code
    assert str(error) == f"no: {meaning} (joint 2) [{VALUES[name]}: 4711]; {cure}"


def test_a_pin_is_named_with_what_can_hold_it() -> None:
    code = wire.ERROR_CODES["pin_taken"]
    assert "(joint 2) [PE9: encoder 1]; give another pin" in str(refusal("no", code, 1, 0x49))
    assert "[PA0: the button, STEP of channel 6]" in str(refusal("no", code))
    assert "[PE12: ENABLE of the drivers]" in str(refusal("no", code, value=0x4C))
    assert "[PD0: it, or its timer, has another output or input already]" in str(
        refusal("no", code, value=0x30)
    )


def test_a_limit_of_the_arm_is_not_taken_for_one_of_the_board() -> None:
    code = wire.ERROR_CODES["too_fast"]
    assert "speed limit in the arm file that the board has (joint 2) [steps/s needed: 395]; " in str(
        refusal("no", code, 1, 395)
    )
    assert "together need more steps per second than the board can make [steps/s needed: 3950]; " in str(
        refusal("no", code, 255, 3950)
    )


def test_what_has_no_number_or_joint_says_none() -> None:
    assert str(refusal("no", wire.ERROR_CODES["not_moving"])) == "no: nothing is moving; no action needed"
    assert "error 200, unknown to this version [7]" in str(refusal("no", 200, value=7))


@pytest.mark.parametrize(
    ("joint", "value", "words"),
    [
        (255, MAX_MOTION_BYTES, "it takes 16384 bytes at most"),
        (0, 1 << 38, "its numbers reach 274877906944"),
    ],
)
def test_a_motion_that_does_not_fit_says_by_how_much(joint: int, value: int, words: str) -> None:
    text = str(refusal("no", wire.ERROR_CODES["too_long"], joint, value))
    assert f"[{words}]; lower refine, use shared timing or fewer via points, or split it" in text


def test_a_record_larger_than_the_board_takes(tmp_path: Path) -> None:
    board, _ = ready(Pipe(tmp_path / "flash"))
    with pytest.raises(BoardError, match=r"refused 'put_begin'.*\[it takes 16384 bytes at most"):
        board.upload("big", bytes(MAX_MOTION_BYTES + 1))


def test_a_command_for_which_the_board_has_no_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is answered by its own code."""
    pipe = Pipe(tmp_path / "flash")
    board, data = ready(pipe)

    def short_of_memory(self: Any, name: str) -> Any:
        raise MemoryError

    monkeypatch.setattr(pipe._later["armtempo_board.storage.store"].Store, "motion", short_of_memory)
    with pytest.raises(BoardError, match=r"refused 'start'.*ran out of memory in this command"):
        board.start("feed", wire.record_crc(data))


def test_a_start_that_the_board_refused_is_told_in_words() -> None:
    code = wire.ERROR_CODES["unhomed"]
    assert describe_notice(f"power-up: error {code}").startswith(
        "power-up: the position is unknown; move the arm"
    )
    for text in ("Traceback: error", "x: error 999", "my own words: error 19 times"):
        assert describe_notice(text) == text
