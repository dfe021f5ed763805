"""``armtempo doctor``: what is wrong is named with a cure, and ends with code 1; nothing is changed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from armtempo.basics.errors import LinkError
from armtempo.cli import doctor, main, state
from armtempo.diagnosis import machine
from armtempo.diagnosis.finding import Level
from armtempo.link.program_version import own_crc
from armtempo.ports.board_port import Port
from armtempo.robot.board_state import BoardState
from click.testing import CliRunner

STATE = BoardState(
    port="/dev/ttyACM0",
    virtual=False,
    board_id="1234 1.26",
    program_crc=0xABCD,
    program_current=True,
    protocol=2,
    arm_crc=5,
    arm="mine",
    arm_source="arm.toml",
    free_flash=50_000,
    free_heap=40_000,
    max_rate=240_000,
    max_rate_sum=240_000,
    rates_measured=False,
    room="5820 bytes: 3 x 5000 steps/s",
    arm_problem="",
    state="idle",
    moving=False,
    speed_percent=100.0,
    rest_s=0.0,
    fault="",
    frames_bad=0,
    samples_lost=0,
    sequence=None,
    joints=(),
)


def test_a_sound_board_has_nothing_wrong() -> None:
    assert {item.level for item in doctor.examine_board(STATE)} == {Level.GOOD}


@pytest.mark.parametrize(
    ("change", "level", "words", "cure"),
    [
        ({"program_current": False}, Level.ERROR, "differs from", "armtempo flash"),
        ({"fault": "estop"}, Level.ERROR, "estop", "armtempo clear"),
        (
            {"arm_problem": "not used: the record is damaged"},
            Level.ERROR,
            "damaged",
            "armtempo configure",
        ),
        ({"free_heap": 3_000}, Level.NOTE, "3000 bytes of heap", "firmware"),
        ({"frames_bad": 7}, Level.NOTE, "7 damaged messages", "cable"),
    ],
)
def test_what_is_wrong_with_a_board(change: dict[str, object], level: Level, words: str, cure: str) -> None:
    found = [item for item in doctor.examine_board(replace(STATE, **change)) if item.level is not Level.GOOD]  # type: ignore[arg-type]
    assert [item.level for item in found] == [level]
    assert words in found[0].what
    assert cure in found[0].next_step


def test_another_version_of_the_program_is_told_with_both_and_what_to_do() -> None:
    other = replace(STATE, program_current=False)
    said = "\n".join(state.lines(other))
    assert f"{other.program_crc:08x}" in said
    assert f"installed here is {own_crc():08x}: 'armtempo flash'" in said


def test_a_board_that_does_not_answer() -> None:
    (item,) = doctor.examine_board(LinkError("no answer within 2 s; check power and cable"))
    assert item.level is Level.ERROR
    assert "no answer" in item.what


def test_a_port_that_may_not_be_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine, "find_ports", lambda: [Port("/dev/ttyACM0", "board", True)])
    monkeypatch.setattr(machine.os, "access", lambda *_: False)
    monkeypatch.setattr(machine.sys, "platform", "linux")
    (item,) = machine.ports()
    assert item.level is Level.ERROR
    assert "dialout" in item.next_step


def test_packages_that_are_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(name: str) -> str:
        raise machine.PackageNotFoundError(name)

    monkeypatch.setattr(machine, "version", nothing)
    levels = {item.where: item.level for item in machine.packages()}
    assert levels["numpy"] is Level.ERROR
    assert levels["matplotlib"] is Level.NOTE
    assert "sphinx" not in levels


def test_the_command_examines_a_virtual_board(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["doctor", "--arm", "paper", "--port", f"sim:{tmp_path / 'b'}", "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert {item["what"] for item in found["machine"]} == {"armtempo", "Python", "flash tool", "system"}
    assert "(virtual)" in found["board"][0]["found"]
    assert "as installed here" in found["board"][1]["found"]


def test_a_broken_arm_file_is_named_and_ends_with_1(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.toml").write_text("name = 3\n")
    done = CliRunner().invoke(main, ["doctor", "--arm", "arm.toml"])
    assert done.exit_code == 1, done.output
    assert "armtempo check --arm arm.toml" in done.output


def test_an_arm_that_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["doctor", "--arm", "nowhere.toml"])
    assert done.exit_code == 1
    assert "nowhere.toml" in done.output
    assert "Traceback" not in done.output
