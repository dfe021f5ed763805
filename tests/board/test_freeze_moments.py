"""The freeze between two instructions: compiled for the Cortex-M4, on an emulated core next to timers that continue.

On the virtual board no time passes within a callback. Here each instruction takes its time: matches, DMA and edges come
wherever they fall.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field

import pytest
from unicorn import UC_HOOK_CODE, UC_HOOK_MEM_READ, UC_HOOK_MEM_WRITE, Uc

from tests.benchmark.freeze import ISR, block_at
from tests.board.emulated import DATA_AT, Machine

AT = block_at()
TIM2, TIM5, PORT_A, PORT_B, WORDS = 0, 768, 1024, 1280, 2100
REGISTERS = DATA_AT + 4 * AT["BLOCK_WORDS"]
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
        self.mode_at = self.timer + AT["CCMR1"] + (self.number - 1) // 2
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
            self.registers[timer + AT["CR1"]] = 1
            self.registers[timer + AT["DIER"]] = 0x1E00
            self.registers[timer + AT["CCMR1"]] = self.registers[timer + AT["CCMR1"] + 1] = 0x3030

    def run(self, now: float) -> None:
        """Let the time come to ``now``, in ticks."""
        while self.now + 1 <= now:
            self.now += 1
            for channel in self.channels:
                self._bring(channel)
            for timer in (TIM2, TIM5):
                if self.registers[timer + AT["CR1"]]:
                    self.counters[timer] += 1
                    self._match(timer)

    def _bring(self, channel: Channel) -> None:
        if channel.due is not None and self.now >= channel.due:
            channel.due = None
            if self.registers[channel.timer + AT["DIER"]] >> 8 + channel.number & 1:
                channel.handed_on += 1
                channel.compare = channel.ring[channel.handed_on]

    def _match(self, timer: int) -> None:
        for channel in self.channels:
            if channel.timer == timer and channel.compare == self.counters[timer]:
                if self.registers[channel.mode_at] >> channel.mode_shift & 7 == 3:
                    self._set(channel, 1 - channel.level)
                if self.registers[timer + AT["DIER"]] >> 8 + channel.number & 1:
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
            if word == port + AT["IDR"]:
                value = sum(one.level << one.bit for one in self.channels if one.port == port)
        uc.mem_write(address, value.to_bytes(4, "little"))

    def write(self, address: int, value: int) -> None:
        """The program writes a word."""
        word = (address - REGISTERS) // 4
        self.registers[word] = value
        if word == TIM2 + AT["CR1"] and value:
            self.registers[TIM5 + AT["CR1"]] = 1  # its trigger
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

    block = array("I", bytes(4 * (AT["BLOCK_WORDS"] + WORDS)))
    block[AT["TIM2_AT"]] = REGISTERS
    block[AT["PORT_A_BEHIND"]] = 4 * PORT_A
    line = AT["FIRST_LINE"] + AT["LINE_WORDS"] * (15 - AT["SOFTWARE_LINE"])
    block[line + AT["LINE_LEVELS"]] = block[line + AT["LINE_MASK"]] = 1
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


@pytest.mark.slow
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
            was_high = block[AT["HIGH_B" if channel.port == PORT_B else "HIGH_A"]] >> channel.bit & 1
            assert (matches + 1) // 2 + (was_high and not matches & 1) == len(rises), (tick, channel.bit)
            stops_after.add(rises[-1] - edge)
    assert 0 < max(stops_after) <= 128 * cycles / 2
