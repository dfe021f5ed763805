"""``armtempo selftest`` on virtual boards; nothing in it may move a motor."""

from __future__ import annotations

import json
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from armtempo import connect
from armtempo.basics.errors import LinkError
from armtempo.diagnosis.selftest import prompt
from armtempo.model.parts import Driver, Safety
from armtempo.simulator.launch_options import InjectedFault

from tests.system import commandline
from tests.system.logged_boards import ENABLE, board, is_enabled, rises, starts

STEPS = ("A15", "A1", "B10")


def impatient(monkeypatch: pytest.MonkeyPatch, part: str) -> None:
    """The host waits for a part that never answers no longer than it must, nor does the board's watchdog."""
    measure, run = prompt.Prompt.measure, prompt.Prompt._run

    def soon(self: prompt.Prompt, name: str, code: str) -> prompt.Measured:
        return run(
            self, name, f"from armtempo_board.selftest import common\ncommon.WATCHDOG_MS = 1000\n{code}"
        )

    def measured(self: prompt.Prompt, name: str, **arguments: Any) -> prompt.Measured:
        with monkeypatch.context() as patch:
            if name == part:
                patch.setattr(prompt, "_SILENCE_S", 0.3)
                patch.setattr(prompt.Prompt, "_run", soon)
                patch.setattr(self._port.serial, "timeout", 0.3)
            return measure(self, name, **arguments)

    monkeypatch.setattr(prompt.Prompt, "measure", measured)


def selftest(port: str, folder: Path) -> tuple[int, dict[str, Any]]:
    """Exit code and JSON document of the command."""
    done = commandline.run("selftest", "--port", port, "--json", "--out", "out", folder=folder)
    return done.exit_code, json.loads(done.output)


def words(found: dict[str, Any], verdict: str) -> list[str]:
    """The lines with that verdict."""
    return [f"{one['part']}: {one['what']}" for one in found["lines"] if one["verdict"] == verdict]


def test_a_sound_board_passes(tmp_path: Path) -> None:
    with board(tmp_path) as port:
        code, found = selftest(port, tmp_path)
        measured = commandline.run("status", "--port", port, folder=tmp_path).output
    assert (code, words(found, "wrong")) == (0, []), found
    assert "240000 all together, measured" in measured
    assert found["simulated"]
    assert all(rises(tmp_path, pin) > 300 for pin in STEPS)  # pulses there were
    assert found["data"]["rates"] == {"highest": {"1": 300_000, "3": 100_000}, "states": [240_000, 240_000]}
    parts = {one["part"] for one in found["lines"]}
    assert parts == {"drivers", "board", "cycles", "memory", "link", "pulses", "safety", "rates"}
    assert not is_enabled(tmp_path)
    assert json.loads((tmp_path / "out" / "selftest.json").read_text()) == found
    assert "<svg" in (tmp_path / "out" / "selftest.html").read_text()
    again = commandline.run("selftest", "--out", "out", folder=tmp_path)
    again.said("selftest.json already exists")
    assert again.exit_code == 2


CABLE_OUT = 5
"""The motion, counted from power-up, at which the cable is out: the first E-stop."""
HANGS = 2
"""The same of the first one whose pulses are captured."""
BAD_PINS = [InjectedFault("short", 0, 0, name="A15-A1"), InjectedFault("dead_pin", 0, 0, name="B10")]
BAD_PINS += [InjectedFault("slow_flash", 0, 0, ms=1500), InjectedFault("late_interrupts", 0, 0, ms=0.05)]
BAD_CABLE = [
    InjectedFault("dead_stream", 0, 0, joint=1),
    InjectedFault("silence", 0.01, CABLE_OUT, ms=60_000),
]
BROKEN: dict[str, tuple[Any, ...]] = {
    "pins": (
        BAD_PINS,
        "PA1, forward together: 383 steps, those of PA15 among them",
        "PB10, forward together: 0 steps",
        "flash: erase and write",
        "E-stop by software to frozen outputs",
        "E-stop by an edge to frozen outputs",
        "limit switch by an edge to frozen outputs",
    ),
    "stream and cable": (
        BAD_CABLE,
        "fault internal",
        "PB10, forward together: 1 steps",
        "steps of a longer motion, 0.3 s:",
        "the whole part: the board fell silent in 'estop'",
    ),
    "clock": (
        [InjectedFault("half_clock", 0, 0)],
        "a tick of TIM2: 4.000",
        "motion forward together: fault start_failed",
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("broken", BROKEN)
def test_what_is_wrong_is_named(tmp_path: Path, broken: str, monkeypatch: pytest.MonkeyPatch) -> None:
    faults, *wrong = BROKEN[broken]
    if any(fault.run for fault in faults):
        impatient(monkeypatch, "estop")
    with board(tmp_path, faults=faults) as port:
        code, found = selftest(port, tmp_path)
    named = [f"{one['what']}: {one['measured']}" for one in found["lines"] if one["verdict"] == "wrong"]
    assert code == 1
    for words in wrong:
        assert any(words in line for line in named), named
    assert all(one["cure"] for one in found["lines"] if one["verdict"] == "wrong")
    assert not is_enabled(tmp_path)


def test_no_pulses_where_enable_cannot_be_inactive(tmp_path: Path) -> None:
    """ENABLE, active low, is shorted to ground."""
    with board(tmp_path, faults=[InjectedFault("dead_pin", 0, 0, name=ENABLE)]) as port:
        code, found = selftest(port, tmp_path)
    assert (code, found["error"]) == (1, "the drivers are on (ENABLE, PE12, is active)")
    assert not any(rises(tmp_path, pin) for pin in STEPS)


def test_motors_that_turn_in_spite_of_enable_stop_it(tmp_path: Path) -> None:
    """The arm file has ENABLE the wrong way round; and an E-stop that is not wired, which the self-test works without.

    No joint goes further than its encoder needs to show it.
    """
    wrong = replace(commandline.ARM, driver=Driver(enable_active="high"), safety=Safety(estop_fitted=True))
    with board(tmp_path, wrong, arm=commandline.ARM) as port:
        code, found = selftest(port, tmp_path)
    assert (code, words(found, "wrong")) == (1, ["drivers: encoders while STEP toggles"])
    assert all(rises(tmp_path, pin) < 40 for pin in STEPS)


@pytest.mark.long
def test_drivers_stay_off_whatever_ends_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C, then a kill, while the board hangs in a part; then a host that waits. The watchdog brings the program
    back each time, and the board itself knows where it hung: nobody told the last one of the kill."""
    with board(tmp_path, faults=[InjectedFault("hang", 0.03, HANGS)]) as port:
        for end in (signal.SIGINT, signal.SIGKILL):
            commandline.wait_for(lambda: starts(tmp_path) > 0, "its log")
            before = starts(tmp_path)
            process = commandline.start("selftest", "--port", port, folder=tmp_path)
            commandline.wait_for(lambda before=before: starts(tmp_path) > before, "the watchdog")  # type: ignore[misc]
            process.send_signal(end)
            assert commandline.ended(process).exit_code == (130 if end is signal.SIGINT else -end)
            commandline.wait_for(lambda: _state(port) in ("unhomed", "fault"), "the program")
        impatient(monkeypatch, "pulses")
        code, found = selftest(port, tmp_path)
    assert (code, words(found, "wrong")) == (1, ["pulses: the whole part"])
    assert found["lines"][0]["measured"] == "the board hung in 'pulses' and was reset"
    assert rises(tmp_path, STEPS[0]) > 0
    assert not is_enabled(tmp_path)


def _state(port: str) -> str:
    try:
        with connect(port) as used:
            return used.status().state
    except LinkError as error:
        return str(error)
