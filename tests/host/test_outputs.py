"""Outputs and inputs of an arm file: what is read, what the board gets, and what is refused by name."""

from __future__ import annotations

import ast
import re
from dataclasses import replace
from pathlib import Path

import pytest
from armtempo import simulator
from armtempo.basics.errors import InputError
from armtempo.diagnosis import arm_check
from armtempo.encoding import encode
from armtempo.model import arm_json, engine_pins, pin_use
from armtempo.model.arm import Arm
from armtempo.model.boards import BOARDS, TIMER_OUTPUTS
from armtempo.model.outputs import Input
from armtempo.robot import arm_state
from armtempo_shared import armrecord

from tests.host import arms
from tests.host.arms import ALL, DOOR, FAN, GRIPPER, PART, PUMP

GPIO = Path(simulator.__file__).parent / "hardware" / "chip" / "gpio.py"
HARDWARE_PAGE = Path(__file__).parents[2] / "board" / "docs" / "hardware.md"


@pytest.fixture
def arm(tmp_path: Path) -> Arm:
    return arms.load(tmp_path, ALL)


def test_what_the_file_says(arm: Arm) -> None:
    gripper, pump, fan = arm.outputs
    assert (gripper.name, gripper.kind, gripper.pin, gripper.safe) == ("gripper", "servo", "PB8", 20.0)
    assert gripper.states == (("open", 20.0), ("closed", 95.0))
    assert (pump.active, pump.safe, fan.frequency_hz) == ("low", 0.0, 20_000.0)
    assert arm.inputs == (Input("part", "PD1", "low", 10), Input("door", "PD3", "high", 0))
    assert (arm.output("fan"), arm.input("door")) == (2, 1)


ALTERNATE = {
    1: 1,
    **dict.fromkeys((3, 4), 2),
    **dict.fromkeys((8, 9, 10, 11), 3),
    **dict.fromkeys((12, 13, 14), 9),
}
"""A pin's alternate function that leads to a timer (data sheet DS8626, table 9)."""


def test_the_virtual_board_leads_the_same_timers_to_the_same_pins() -> None:
    (table,) = re.findall(r"^TIMER_PINS = (\{.*?^\})", GPIO.read_text(), re.MULTILINE | re.DOTALL)
    simulated = ast.literal_eval(table)
    for pin, outputs in TIMER_OUTPUTS.items():
        for output in outputs:
            place = (output.timer, output.channel)
            assert simulated.get((pin.removeprefix("P"), ALTERNATE[output.timer])) == place, pin


def test_an_arm_without_keeps_its_record() -> None:
    data = encode.arm_record(Arm.paper())
    head, joints, _ = armrecord.unpack(data)
    assert data[4] == armrecord.VERSION
    assert data == armrecord.pack(head, joints)
    assert armrecord.unpack_outputs(data) == ([], [])


def test_values_are_the_whole_range(arm: Arm) -> None:
    gripper, pump, fan = arm.outputs
    assert [gripper.raw(value) for value in (0, 90, 180, "open", "95")] == [0, 32768, 65535, 7282, 34588]
    assert [pump.raw(value) for value in (0, 1, "on", "off")] == [0, 65535, 65535, 0]
    assert [fan.raw(value) for value in (0, 0.5, 1, "slow")] == [0, 32768, 65535, 16384]
    for raw in (0, 1, 32768, 65535):
        assert gripper.raw(gripper.value(raw)) == raw
    assert (gripper.state(7282), gripper.state(7283)) == ("open", "")
    assert gripper.describe(7282) == "open (20 deg)"
    assert pump.describe(65535) == "on"


@pytest.mark.parametrize(
    ("number", "value", "words"),
    [
        (0, 181, ["'gripper' cannot take 181 deg", "0 to 180", "open, closed"]),
        (0, -0.1, ["'gripper' cannot take -0.1 deg"]),
        (0, "opne", ["no state 'opne'", "did you mean 'open'", "open, closed"]),
        (0, "nan", ["'gripper' cannot take nan"]),
        (1, 0.5, ["'pump' is on or off", "0 or 1"]),
        (1, 2, ["'pump' cannot take 2"]),
        (2, 1.01, ["'fan' cannot take 1.01 duty"]),
    ],
)
def test_what_an_output_cannot_take(arm: Arm, number: int, value: float | str, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        arm.outputs[number].raw(value)
    for word in words:
        assert word in f"{caught.value.problem} {caught.value.hint}"


def test_unknown_names(arm: Arm) -> None:
    with pytest.raises(InputError, match=r"no output 'griper'; did you mean 'gripper'"):
        arm.output("griper")
    with pytest.raises(InputError, match="no input 'part'"):
        Arm.paper().input("part")


def test_the_board_makes_these_pulses(arm: Arm) -> None:
    """From the record's counts back to times: within a count of what the file says."""
    outputs, inputs = armrecord.unpack_outputs(encode.arm_record(arm))
    gripper, pump, fan = outputs
    count_us = (gripper["prescaler"] + 1) / 168.0
    assert (gripper["timer"], gripper["channel"], gripper["pin"]) == (10, 1, 24)
    assert gripper["low"] * count_us == pytest.approx(500, abs=count_us)
    assert gripper["high"] * count_us == pytest.approx(2500, abs=count_us)
    assert (gripper["period"] + 1) * count_us == pytest.approx(20_000, abs=count_us)
    assert gripper["safe"] == arm.outputs[0].raw("open")
    assert (pump["timer"], pump["low"], pump["high"], pump["pin"]) == (0, 1, 0, 48)
    assert 168e6 / ((fan["prescaler"] + 1) * (fan["period"] + 1)) == pytest.approx(20_000)
    assert (fan["low"], fan["high"]) == (0, fan["period"] + 1)
    assert inputs == [
        {"pin": 49, "active_high": 0, "debounce_ms": 10},
        {"pin": 51, "active_high": 1, "debounce_ms": 0},
    ]


@pytest.mark.parametrize("frequency_hz", [1, 49.9, 50, 333, 1000, 99_999, 100_000])
def test_frequencies(tmp_path: Path, frequency_hz: float) -> None:
    arm = arms.load(tmp_path, FAN.replace("20000", str(frequency_hz)))
    fan = armrecord.unpack_outputs(encode.arm_record(arm))[0][0]
    made_hz = 168e6 / ((fan["prescaler"] + 1) * (fan["period"] + 1))
    assert made_hz == pytest.approx(frequency_hz, rel=1e-3)
    assert fan["high"] <= 65535


def test_json_keeps_them_and_reads_files_from_before(arm: Arm, tmp_path: Path) -> None:
    path = tmp_path / "arm.json"
    arm_json.save(arm, path)
    assert arm_json.load(path) == arm
    arm_json.save(Arm.paper(), path)
    text = path.read_text()
    for key in ("board", "outputs", "inputs"):
        text = re.sub(rf',\s*"{key}": ("\w+"|\[\])', "", text)
    assert "outputs" not in text
    path.write_text(text)
    assert arm_json.load(path) == Arm.paper()


@pytest.mark.parametrize(
    ("key", "value", "word"),
    [("kind", "laser", "laser"), ("frequency_hz", 0.0, "frequency_hz"), ("pin", "PE12", "ENABLE")],
)
def test_json_that_was_altered_is_refused(
    arm: Arm, tmp_path: Path, key: str, value: str | float, word: str
) -> None:
    path = tmp_path / "arm.json"
    changes: dict[str, str | float] = {key: value}
    arm_json.save(replace(arm, outputs=(replace(arm.outputs[0], **changes),)), path)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=word):
        arm_json.load(path)


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        (GRIPPER.replace("PB8", "PE9"), ["output.gripper: PE9", "encoder 1"]),
        (GRIPPER.replace("PB8", "PE13"), ["output.gripper", "timer 1 of PE13", "encoder 1"]),
        (PUMP.replace("PD0", "PE12"), ["output.pump: PE12", "ENABLE"]),
        (PUMP.replace("PD0", "PA15"), ["output.pump: PA15", "STEP of channel 1"]),
        (PUMP.replace("PD0", "PE7"), ["output.pump: PE7", "DIR of channel 1"]),
        (PUMP.replace("PD0", "PB4"), ["output.pump: PB4", "encoder 2"]),
        (PUMP.replace("PD0", "PD12"), ["output.pump: PD12", "LED"]),
        (PART.replace("PD1", "PA0"), ["input.part: PA0", "button"]),
        (PART.replace("PD1", "PA11"), ["input.part: PA11", "STM32F4DISC", "USB"]),
        (PART.replace("PD1", "PB3"), ["input.part: the STM32F4DISC has no pin PB3"]),
        (PART + PUMP.replace("PD0", "PD1"), ["input.part: PD1 is the pin of output.pump"]),
        (GRIPPER.replace("PB8", "PD0"), ["output.gripper: PD0 has no timer"]),
        (
            GRIPPER.replace("PB8", "PB14") + FAN.replace("PB9", "PB15"),
            ["output.fan", "timer 12 of PB15 has another frequency", "output.gripper"],
        ),
        (
            GRIPPER.replace("PB8", "PE5") + GRIPPER.replace("gripper", "hand").replace("PB8", "PA2"),
            ["output.hand", "channel 1 of timer 9"],
        ),
    ],
)
def test_pins_that_cannot_be_had(tmp_path: Path, tables: str, words: list[str]) -> None:
    """Refused by name when the file is read, and a finding of the check."""
    path = arms.write(tmp_path, tables)
    with pytest.raises(InputError) as caught:
        Arm.load(path)
    found = arm_check.check(path)[1]
    errors = [finding for finding in found if finding.level is arm_check.Level.ERROR]
    assert len(errors) == 1
    for word in words:
        assert word in caught.value.problem, caught.value.problem
        assert word in f"{errors[0].where}: {errors[0].what}"
    assert "help hardware" in caught.value.hint


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        (PUMP.replace("switch", "relay"), ["output.pump.kind = 'relay'", "'servo'"]),
        (PUMP.replace("PD0", "D0"), ["output.pump.pin = 'D0'", '"PE9"']),
        (PUMP.replace("PD0", "PD16"), ["output.pump.pin"]),
        (PUMP + "frequency_hz = 50\n", ["output.pump.frequency_hz", "unknown key"]),
        (FAN.replace("20000", "0"), ["output.fan.frequency_hz = 0"]),
        (FAN.replace("0.25", "1.25"), ["output.fan.states.slow = 1.25", "0 to 1"]),
        (GRIPPER.replace("[500, 2500]", "[500, 25000]"), ["output.gripper.pulse_us"]),
        (GRIPPER.replace("[0, 180]", "[180, 0]"), ["output.gripper.angles_deg"]),
        (GRIPPER.replace('"open"\n', '"opn"\n'), ["output.gripper.safe = 'opn'", "open, closed"]),
        (GRIPPER.replace('safe = "open"', "safe = 200"), ["output.gripper.safe = 200", "0 to 180"]),
        (GRIPPER.replace('safe = "open"\n', ""), ["output.gripper.safe is missing"]),
        (GRIPPER.replace("gripper", '"my gripper"'), ["output.my gripper", "letters, digits"]),
        (PART + "debounce_ms = -1\n", ["input.part.debounce_ms = -1"]),
        (PART + 'active = "up"\n', ["input.part.active = 'up'"]),
        ("".join(PART.replace("part", f"p{n}") for n in range(9)), ["9 tables [input.NAME]", "space for 8"]),
        ("\n[output]\npump = 3\n", ["output.pump = 3", "a table"]),
    ],
)
def test_tables_that_are_not_allowed(tmp_path: Path, tables: str, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        Arm.load(arms.write(tmp_path, tables))
    for word in words:
        assert word in f"{caught.value.problem} {caught.value.hint}", caught.value


def test_boards(tmp_path: Path) -> None:
    """A free pin of one board may be taken, or missing, on another."""
    arms.load(tmp_path, PUMP.replace("PD0", "PB9"))
    with pytest.raises(InputError, match="PB9 is taken on the VCC_GND_F407VE by a LED"):
        arms.load(tmp_path, PUMP.replace("PD0", "PB9"), board="VCC_GND_F407VE")
    with pytest.raises(InputError, match="PA6 is taken on the VCC_GND_F407ZG by the flash chip"):
        arms.load(tmp_path, PUMP.replace("PD0", "PA6"), board="VCC_GND_F407ZG")
    with pytest.raises(
        InputError, match=r"PYBV11 does not have the pins that the engine takes: PE12 \(ENABLE"
    ):
        arms.load(tmp_path, board="PYBV11")
    with pytest.raises(InputError, match="board = 'PYBV10' is not allowed"):
        arms.load(tmp_path, board="PYBV10")


@pytest.mark.parametrize("board", [name for name in BOARDS if name != "PYBV11"])
def test_every_pin_of_the_engine_is_there_and_free(tmp_path: Path, board: str) -> None:
    arm = arms.load(tmp_path, PUMP.replace("PD0", "PB12"), board=board)
    pins = engine_pins.table()
    used = [*(row[0] for row in pins["STEP"]), *pins["DIR"], *pins["LIMIT"], *pins["LEDS"], pins["ESTOP"]]
    used += [pin for row in pins["ENCODER"] for pin in row[1:3]]
    assert {f"P{pin}" for pin in used} <= BOARDS[board].pins - BOARDS[board].taken.keys()
    assert set(engine_pins.taken_pins(arm)) <= BOARDS[board].pins


def test_taken_pins_of_the_board_program_are_those_of_its_own_table(arm: Arm) -> None:
    """The host reads the table of the board; the shipped arm has channels 1 to 3 with encoders."""
    taken = engine_pins.taken_pins(arm)
    assert {pin for pin, use in taken.items() if use.startswith("STEP")} == {"PA15", "PA1", "PB10"}
    assert {pin for pin, use in taken.items() if use == "encoder 1"} == {"PE9", "PE11"}
    assert set(engine_pins.taken_timers(arm)) == {1, 2, 3, 5, 6, 8}


def test_the_page_lists_boards_and_timer_pins() -> None:
    text = HARDWARE_PAGE.read_text(encoding="utf-8")
    for name in BOARDS:
        assert f"`{name}`" in text
    for pin, places in TIMER_OUTPUTS.items():
        row = next(line for line in text.splitlines() if line.startswith(f"| {pin} |"))
        for place in places:
            assert f"TIM{place.timer} CH{place.channel}" in row


def test_difference_in_words(tmp_path: Path) -> None:
    arm = arms.load(tmp_path, ALL)
    old = encode.arm_record(arm)
    fewer = encode.arm_record(replace(arm, outputs=arm.outputs[:2]))
    assert arm_state.difference(old, fewer) == "other outputs"
    assert arm_state.difference(old, encode.arm_record(Arm.paper())) == "other outputs; inputs"
    assert "keeps the position" in arm_state.consequence(old, fewer)


def test_placing_takes_the_timer_that_is_free(tmp_path: Path) -> None:
    """PB8 has TIM10 and TIM4; PA6 TIM13, and TIM3 if no encoder has it."""
    arm = arms.load(tmp_path, GRIPPER + GRIPPER.replace("gripper", "hand").replace("PB8", "PA6") + DOOR)
    assert {name: place.timer for name, place in pin_use.timer_outputs(arm).items()} == {
        "gripper": 10,
        "hand": 13,
    }
