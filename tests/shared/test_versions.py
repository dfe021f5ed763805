"""Versions of formats: a layout that changes gets another one, so that nothing is taken for something else."""

from __future__ import annotations

from pathlib import Path

from armtempo.model import arm_json, sequence_plan
from armtempo.model import plan as plan_file
from armtempo.ports import claim_file
from armtempo.report import run_folder, sequence_folder
from armtempo_shared import armrecord, codes, meanings, messages, wire
from armtempo_shared.table import rows

from tests import sources
from tests.shared import stored_bytes


def test_versions_are_those_of_files_that_exist() -> None:
    versions = {
        "arm": arm_json.VERSION,
        "trajectory": plan_file.VERSION,
        "sequence": sequence_plan.VERSION,
        "run": run_folder.VERSION,
        "sequence run": sequence_folder.VERSION,
        "claim": claim_file.VERSION,
        "arm record": armrecord.VERSION,
        "protocol": messages.PROTOCOL_VERSION,
    }
    assert versions == {
        "arm": 1,
        "trajectory": 2,
        "sequence": 2,
        "run": 1,
        "sequence run": 1,
        "claim": 1,
        "arm record": 2,
        "protocol": 5,
    }


# a layout that changes gets another version: what an older program wrote is not taken for something else


def test_each_version_has_the_bytes_that_it_had() -> None:
    kept = stored_bytes.kept()
    for name, made in stored_bytes.layouts().items():
        assert name in kept, f"{name} is new: 'python -m tests.shared.stored_bytes' keeps its bytes"
        assert made == kept[name], f"{name}: another layout needs another version"


def test_no_message_is_dropped_under_the_same_version() -> None:
    version = f"protocol {wire.PROTOCOL_VERSION}, "
    assert {name for name in stored_bytes.kept() if name.startswith(version)} <= stored_bytes.layouts().keys()


# the protocol page and the message table say the same


SCRIPT = Path(__file__).parents[2] / "shared" / "docs" / "make_protocol.py"


def test_page_is_current() -> None:
    script = sources.script(SCRIPT)
    text = script.PAGE.read_text()
    assert script.page(text) == text, "run: python shared/docs/make_protocol.py"


def test_every_message_and_code_has_its_words() -> None:
    commands = {row[0] for row in [*rows("C"), *rows("O"), *rows("S")]}
    assert set(meanings.COMMANDS) == commands == {row[0] for row in [*rows("A"), *rows("P"), *rows("T")]}
    assert set(meanings.EVENTS) == {row[0] for row in [*rows("E"), *rows("R")]}
    numbers = {name: value for name, value in vars(codes).items() if name.isupper()}
    assert {name.upper(): code for name, code in meanings.ERROR_CODES.items()} == numbers
    assert len(set(numbers.values())) == len(numbers)
    assert all(meaning and cure for _, meaning, cure in meanings.ERRORS.values())


def test_numbers_are_used_once_and_answers_match_their_commands() -> None:
    commands, answers = [*rows("C"), *rows("O"), *rows("S")], [*rows("A"), *rows("P"), *rows("T")]
    others = [*rows("E"), *rows("R")]
    numbers = [row[1] for row in commands + others]
    assert len(set(numbers)) == len(numbers)
    assert [row[:2] for row in commands] == [row[:2] for row in answers]


def test_flags_and_numbers_are_those_that_are_explained() -> None:
    assert f"`flags` {messages.START_HOMING}:" in meanings.COMMANDS["start"]
    assert f"`flags` {messages.SAMPLE_BRAKING}:" in meanings.EVENTS["sample"]
    for event in ("fault", "error"):
        assert f"`joint` {messages.NO_JOINT} if" in meanings.EVENTS[event]
    assert messages.ARM_RECORD_NAME in meanings.COMMANDS["put_begin"]
