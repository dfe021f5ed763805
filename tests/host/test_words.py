"""Messages that once left newcomers without a next step, each with the words that help now."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import serial
from armtempo.basics.errors import InputError, LinkError
from armtempo.cli import state
from armtempo.formats import toml_table
from armtempo.link.transport import SerialTransport
from armtempo.robot import board_state, speed
from armtempo.robot.board import Board

from tests.host.linked import ready
from tests.inprocess import Pipe


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
    assert "link      OK: no damaged messages, no lost samples" in state.lines(found)
    worse = state.lines(replace(found, frames_bad=3, samples_lost=2))
    assert "link      messages damaged 3 times, 2 samples lost: check cable and plugs" in worse


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
    assert [speed.permille(fraction) for fraction in (0.01, 1.0)] == [10, 1000]
    for fraction in (0.009, 1.001):
        with pytest.raises(InputError, match=r"give a fraction of 0\.01 to 1"):
            speed.permille(fraction)
