"""The protocol page and the message table say the same."""

from __future__ import annotations

from pathlib import Path

from armtempo_shared import codes, meanings, messages
from armtempo_shared.table import rows

from tests import sources

SCRIPT = Path(__file__).parents[2] / "shared" / "docs" / "make_protocol.py"


def test_page_is_current() -> None:
    script = sources.script(SCRIPT)
    text = script.PAGE.read_text()
    assert script.page(text) == text, "run: python shared/docs/make_protocol.py"


def test_every_message_and_code_has_its_words() -> None:
    commands = {row[0] for row in rows("C") + rows("O") + rows("S")}
    assert set(meanings.COMMANDS) == commands == {row[0] for row in rows("A") + rows("P") + rows("T")}
    assert set(meanings.EVENTS) == {row[0] for row in rows("E") + rows("R")}
    numbers = {name: value for name, value in vars(codes).items() if name.isupper()}
    assert {name.upper(): code for name, code in meanings.ERROR_CODES.items()} == numbers
    assert len(set(numbers.values())) == len(numbers)
    assert all(meaning and cure for _, meaning, cure in meanings.ERRORS.values())


def test_numbers_are_used_once_and_answers_match_their_commands() -> None:
    commands, answers = rows("C") + rows("O") + rows("S"), rows("A") + rows("P") + rows("T")
    others = rows("E") + rows("R")
    numbers = [row[1] for row in commands + others]
    assert len(set(numbers)) == len(numbers)
    assert [row[:2] for row in commands] == [row[:2] for row in answers]


def test_flags_and_numbers_are_those_that_are_explained() -> None:
    assert f"`flags` {messages.START_HOMING}:" in meanings.COMMANDS["start"]
    assert f"`flags` {messages.SAMPLE_BRAKING}:" in meanings.EVENTS["sample"]
    for event in ("fault", "error"):
        assert f"`joint` {messages.NO_JOINT} if" in meanings.EVENTS[event]
    assert messages.ARM_RECORD_NAME in meanings.COMMANDS["put_begin"]
