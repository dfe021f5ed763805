"""Captures STEP pins: DMA2 copies ports A, B at 1 MHz, by TIM1 (RM0090 10.3.3, table 43)."""

from array import array

import micropython
import stm
import uctypes
from armtempo_shared import armrecord
from machine import mem32
from micropython import const

_SAMPLES = 4096  # 4 ms, more than a pass of the loop
_PERIOD = 167  # of TIM1 at 168 MHz: 1 us
_DMA2EN, _TIM1EN = 1 << 22, 1
_TIM1 = stm.TIM1
# Very high priority, memory incremented, circular
_HALF_WORDS = 3 << 16 | 1 << 13 | 1 << 11 | 1 << 10 | 1 << 8
_CHANNEL = 6 << 25
_STREAMS = (("A", 5), ("B", 1))  # stream 5 by TIM1's update, stream 1 by its compare channel 1
_REQUESTS = 1 << 8 | 1 << 9
# Words of the state of a scan, and three more of one of rising edges
_MASK = const(0)
_LAST = const(1)
_COUNT = const(2)
_TIME = const(3)
_ROSE = const(4)
_SHORTEST = const(5)
_LONGEST = const(6)
# Of eight samples
_FOURTH = const(3)
_SIXTH = const(5)
_EIGHTH = const(7)
# Registers of a stream, and of the controller: flags to clear (RM0090 10.5)
_NDTR, _PAR, _M0AR, _FCR = 4, 8, 12, 20
_LIFCR, _HIFCR = 8, 12


@micropython.viper
def scan(samples: ptr16, begin: int, end: int, state: ptr32, edges: ptr32, most: int) -> object:
    """Store the edges between two indices: (microsecond << 8) + (pin << 1) + level.

    Eight samples without an edge are skipped together, in a quarter of the time, which two ports need. Every second
    sample is enough, as pulses last two samples or more.
    """
    mask = state[_MASK]
    last = state[_LAST]
    count = state[_COUNT]
    time = state[_TIME]
    place = begin
    while place < end:
        if place + 8 <= end:
            others = samples[place + 1] ^ last | samples[place + _FOURTH] ^ last
            if not (others | samples[place + _SIXTH] ^ last | samples[place + _EIGHTH] ^ last) & mask:
                place += 8
                time += 8
                continue
        level = samples[place] & mask
        if level != last:
            changed = level ^ last
            pin = 0
            while changed:
                if changed & 1:
                    if count < most:
                        edges[count] = time << 8 | pin << 1 | (level >> pin & 1)
                    count += 1
                changed = changed >> 1
                pin += 1
            last = level
        place += 1
        time += 1
    state[_LAST] = last
    state[_COUNT] = count
    state[_TIME] = time


@micropython.viper
def measure_rises(samples: ptr16, begin: int, end: int, state: ptr32) -> object:
    """Between two indices: number of rising edges of a pin, shortest and longest time between two."""
    mask = state[_MASK]
    last = state[_LAST]
    count = state[_COUNT]
    time = state[_TIME]
    for place in range(begin, end):
        level = samples[place] & mask
        if level != last:
            last = level
            if level:
                if count:
                    passed = time - state[_ROSE]
                    if passed < state[_SHORTEST]:
                        state[_SHORTEST] = passed
                    if passed > state[_LONGEST]:
                        state[_LONGEST] = passed
                state[_ROSE] = time
                count += 1
        time += 1
    state[_LAST] = last
    state[_COUNT] = count
    state[_TIME] = time


class Capture:
    """The samples of a port; at most ``most`` edges of the pins in ``mask``."""

    def __init__(self, port: str, stream: int, mask: int, most: int) -> None:
        self.name = port
        self.samples = array("H", bytes(2 * _SAMPLES))
        self.edges = array("i", bytes(4 * most))
        self.state = array("i", [mask, 0, 0, 0])
        self.port = getattr(stm, "GPIO" + port)
        self.at = stm.DMA2 + 0x10 + 0x18 * stream
        self.place = 0

    def arm(self) -> None:
        """Set up the stream for port and memory, and enable it."""
        mem32[self.at] = 0
        mem32[self.at + _NDTR] = _SAMPLES
        mem32[self.at + _PAR] = self.port + stm.GPIO_IDR
        mem32[self.at + _M0AR] = uctypes.addressof(self.samples)
        mem32[self.at + _FCR] = 0
        self.state[_LAST] = mem32[self.port + stm.GPIO_IDR] & self.state[_MASK]
        mem32[self.at] = _CHANNEL | _HALF_WORDS
        mem32[self.at] = _CHANNEL | _HALF_WORDS | 1

    def count(self) -> int:
        """Number of edges, also of those beyond ``most``."""
        return self.state[_COUNT]

    def look(self) -> None:
        """Process the samples since the last call."""
        place = (_SAMPLES - mem32[self.at + _NDTR]) % _SAMPLES
        if place < self.place:
            scan(self.samples, self.place, _SAMPLES, self.state, self.edges, len(self.edges))
            self.place = 0
        scan(self.samples, self.place, place, self.state, self.edges, len(self.edges))
        self.place = place

    def window(self) -> "dict[str, tuple[int, int, int]]":
        """(count, shortest, longest time between two in us) of the last 4096 samples' rising edges, by pin."""
        found = {}
        for line in range(16):
            if self.state[_MASK] >> line & 1:
                first = self.samples[self.place] & 1 << line
                state = array("i", [1 << line, first, 0, 0, 0, _SAMPLES, 0])
                measure_rises(self.samples, self.place, _SAMPLES, state)
                measure_rises(self.samples, 0, self.place, state)
                found[self.name + str(line)] = (state[_COUNT], state[_SHORTEST], state[_LONGEST])
        return found


def begin(captures: "list[Capture]") -> None:
    """Start TIM1's requests, one per microsecond."""
    mem32[stm.RCC + stm.RCC_AHB1ENR] = mem32[stm.RCC + stm.RCC_AHB1ENR] | _DMA2EN
    mem32[stm.RCC + stm.RCC_APB2ENR] = mem32[stm.RCC + stm.RCC_APB2ENR] | _TIM1EN
    for register in (stm.TIM_CR1, stm.TIM_DIER, stm.TIM_SMCR, stm.TIM_CCER, stm.TIM_CCMR1, stm.TIM_PSC):
        mem32[_TIM1 + register] = 0
    mem32[_TIM1 + stm.TIM_ARR] = _PERIOD
    mem32[_TIM1 + stm.TIM_CCR1] = _PERIOD // 2
    mem32[_TIM1 + stm.TIM_EGR] = 1
    mem32[_TIM1 + stm.TIM_SR] = 0
    mem32[stm.DMA2 + _LIFCR] = 0x0F7D0F7D
    mem32[stm.DMA2 + _HIFCR] = 0x0F7D0F7D
    for capture in captures:
        capture.arm()
    mem32[_TIM1 + stm.TIM_DIER] = _REQUESTS
    mem32[_TIM1 + stm.TIM_CR1] = 1


def end(captures: "list[Capture]") -> None:
    """Stop the requests."""
    mem32[_TIM1 + stm.TIM_CR1] = 0
    mem32[_TIM1 + stm.TIM_DIER] = 0
    for capture in captures:
        if mem32[capture.at] & 1:
            capture.place = (_SAMPLES - mem32[capture.at + _NDTR]) % _SAMPLES
        mem32[capture.at] = 0


def captured(record: str, joints: int, most: int, wanted: str = "AB") -> "tuple[list[Capture], list[str]]":
    """A capture for each of the ``wanted`` ports with a STEP pin of the arm's first joints; and those pins.

    Call it before the engine is made, which leaves no large free block.
    """
    from armtempo_board.hardware import pins

    with open(record, "rb") as file:
        _, rows, _ = armrecord.unpack(file.read())
    steps = [pins.STEP[row["channel"]][0] for row in rows[:joints]]
    found = []
    for port, stream in _STREAMS:
        mask = 0
        for pin in steps:
            if pins.port(pin) == port and port in wanted:
                mask |= 1 << pins.line(pin)
        if mask:
            found.append(Capture(port, stream, mask, most))
    return found, steps
