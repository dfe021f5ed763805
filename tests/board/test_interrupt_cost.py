"""What the interrupts cost, counted on an emulated Cortex-M4; a change must not make it more."""

from __future__ import annotations

import re
from array import array

import pytest
from armtempo.diagnosis.selftest.board_part import EMITTED

from tests import interpreters, slack
from tests.benchmark import freeze
from tests.board.emulated import Machine, ring_state

pytestmark = pytest.mark.xdist_group("interrupt cost")  # what they share is made once

BOARD = interpreters.ROOT / "board" / "armtempo_board"

SERVE = {1: (209, 382), 3: (257, 478), 6: (329, 622)}
TAKE = {1: 198, 3: 278, 6: 398}
REFILL = {1: (211, 258), 3: (369, 510), 6: (606, 888)}
EMIT = {**EMITTED, 32: 1060}
ARM_CHANNEL = 228

RING = 1024  # entries


def _offsets(module: str) -> dict[str, int]:
    """The numbers that a board module names."""
    found = re.findall(
        r"^([A-Z_]+[A-Z0-9]*) = (?:const\()?(\d+)\b", (BOARD / module).read_text(), re.MULTILINE
    )
    return {name: int(number) for name, number in found}


AT = _offsets("hardware/isr.py")
QUEUE = _offsets("stepgen/step_queue.py")


def _words(count: int) -> array[int]:
    return array("I", bytes(4 * count))


def _block(joints: int, made: int = 20) -> array[int]:
    """Joints whose rings are fed; ``made`` entries are in each."""
    block = _words(AT["BLOCK_HEAD"] + 6 * AT["JOINT_WORDS"])
    block[AT["JOINTS"]] = joints
    block[AT["NEXT_SAMPLE"]] = 5000
    for joint in range(joints):
        at = AT["BLOCK_HEAD"] + joint * AT["JOINT_WORDS"]
        block[at + AT["CCR_AT"]] = AT["CCR1"] + joint % 3
        block[at + AT["CCMR_AT"]] = AT["CCMR1"]
        ring = at + AT["RING"]
        block[ring + AT["FED"]] = 1
        block[ring + AT["WRITTEN"]] = made
        block[ring + AT["NDTR_AT_START"]] = RING
        block[ring + AT["MASK"]] = RING - 1
        block[ring + AT["LAST_TIME"]] = 100_000
    return block


@pytest.fixture(scope="module")
def machine() -> Machine:
    return Machine(BOARD / "hardware" / "isr.py", BOARD / "stepgen" / "step_queue.py")


def _cost(
    machine: Machine, name: str, *arguments: array[int] | int, beside: tuple[array[int], ...] = ()
) -> int:
    before = machine.count
    machine.run(name, *arguments, beside=beside)
    return machine.count - before


@pytest.mark.parametrize("joints", sorted(SERVE))
def test_turning_and_stopping(machine: Machine, joints: int) -> None:
    idle, turn = SERVE[joints]
    block, timer2, port = _block(joints), _words(18), _words(10)
    timer2[AT["CNT"]] = 100
    slack.hold("no turn", _cost(machine, "serve_compare", block, timer2, port), idle)
    block[AT["BLOCK_HEAD"] + AT["DIR_BIT"]] = 128
    block[AT["BLOCK_HEAD"] + AT["TURN_TIMES"]] = 100
    block[AT["BLOCK_HEAD"] + AT["TURNS_IN"]] = 1
    slack.hold("turn", _cost(machine, "serve_compare", block, timer2, port), turn)
    assert port[AT["BSRR"]] == 128


@pytest.mark.parametrize("joints", sorted(TAKE))
def test_a_sample(machine: Machine, joints: int) -> None:
    """Without encoders: these come by way of objects."""
    raw = _words(AT["RAW_ROOM"] * AT["RAW_WORDS"])
    slack.hold("a sample", _cost(machine, "take_sample", raw, _block(joints), _words(60), 0), TAKE[joints])


@pytest.mark.parametrize("joints", sorted(REFILL))
def test_looking_after_the_rings(machine: Machine, joints: int) -> None:
    """All of them full, and all to be written to."""
    full, to_refill = REFILL[joints]
    dma, timer = _words(60), _words(18)
    dma[0] = RING
    slack.hold(
        "rings that are full", _cost(machine, "rings_to_refill", _block(joints, RING - 8), dma, timer), full
    )
    assert machine.run("rings_to_refill", _block(joints, RING - 8), dma, timer) == 0
    slack.hold("rings to refill", _cost(machine, "rings_to_refill", _block(joints), dma, timer), to_refill)
    assert machine.run("rings_to_refill", _block(joints), dma, timer) == (1 << joints) - 1


@pytest.mark.parametrize("entries", sorted(EMIT))
def test_writing_to_a_ring(machine: Machine, entries: int) -> None:
    """Edges of a long cubic in groups of 16 steps, counted as written."""
    queue, ring, timer = _words(128), _words(RING + 1), _words(18)
    values = {"FIRST": 252 << 22, "SECOND": 1 << 29, "THIRD": 1 << 29, "POWER": 9, "SHIFT": 13, "GROUP": 5}
    values |= {"STEPS": 512, "UNTIL_KITICKS": 1 << 28, "PULSE": 168}
    for name, value in values.items():
        queue[QUEUE[name]] = value
    state = ring_state(AT, entries, ring, queue)
    slack.hold(
        f"{entries} entries", _cost(machine, "emit", 1, state, timer, beside=(ring, queue)), EMIT[entries]
    )
    assert queue[QUEUE["HEAD"]] == entries
    assert state[AT["WRITTEN"]] == entries


def test_the_freeze_is_the_one_that_was_counted_on_the_firmware() -> None:
    """Else count it there anew: python -m tests.benchmark.freeze."""
    slack.hold("the freeze by itself", freeze.alone(), freeze.stored()["alone"])


def test_outputs_stand_still_within_500_instructions() -> None:
    """From the edge of a switch, as counted on MicroPython's firmware, whatever it looks up; every line alike."""
    counted = freeze.stored()["lines"]
    assert set(counted) == {"E-stop", "limit 1", "limit 2", "limit 3"}
    for line in counted.values():
        assert line["still"] <= 500
        assert line["still"] < line["whole"]


def test_arming_a_channel(machine: Machine) -> None:
    ring = _words(RING + 1)
    ring[0] = 5000
    slack.hold(
        "arming a channel",
        _cost(machine, "arm_channel", _block(1), _words(18), ring, AT["BLOCK_HEAD"]),
        ARM_CHANNEL,
    )
