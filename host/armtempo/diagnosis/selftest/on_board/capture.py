"""Prefix of parts that capture STEP pins: DMA2 copies ports A, B at 1 MHz, by TIM1 (RM0090 10.3.3, table 43)."""

from array import array

import micropython
import uctypes

_SAMPLES = 4096  # 4 ms, more than a turn of the loop
_PERIOD = 167  # of TIM1 at 168 MHz: 1 us
_DMA2EN, _TIM1EN = 1 << 22, 1
_TIM1 = stm.TIM1
# Very high priority, memory incremented, circular
_HALF_WORDS = 3 << 16 | 1 << 13 | 1 << 11 | 1 << 10 | 1 << 8
_CHANNEL = 6 << 25
_STREAMS = (("A", 5), ("B", 1))  # stream 5 by TIM1's update, stream 1 by its compare channel 1
_REQUESTS = 1 << 8 | 1 << 9
_MASK, _LAST, _COUNT, _TIME = 0, 1, 2, 3


@micropython.viper
def scan(samples: ptr16, begin: int, end: int, state: ptr32, edges: ptr32, most: int):
    """Store the edges between two indices: (microsecond << 8) + (pin << 1) + level.

    Eight samples without an edge are skipped together, in a quarter of the time, which two ports need. Every second
    sample is enough, as pulses last two samples or more.
    """
    mask = state[0]
    last = state[1]
    count = state[2]
    time = state[3]
    place = begin
    while place < end:
        if place + 8 <= end:
            others = samples[place + 1] ^ last | samples[place + 3] ^ last
            if not (others | samples[place + 5] ^ last | samples[place + 7] ^ last) & mask:
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
    state[1] = last
    state[2] = count
    state[3] = time


@micropython.viper
def measure_rises(samples: ptr16, begin: int, end: int, state: ptr32):
    """Between two indices: number of rising edges of a pin, shortest and longest time between two."""
    mask = state[0]
    last = state[1]
    count = state[2]
    time = state[3]
    for place in range(begin, end):
        level = samples[place] & mask
        if level != last:
            last = level
            if level:
                if count:
                    passed = time - state[4]
                    if passed < state[5]:
                        state[5] = passed
                    if passed > state[6]:
                        state[6] = passed
                state[4] = time
                count += 1
        time += 1
    state[1] = last
    state[2] = count
    state[3] = time


class Capture:
    """The samples of a port; at most ``most`` edges of the pins in ``mask``."""

    def __init__(self, port, stream, mask, most):
        self.name = port
        self.samples = array("H", bytes(2 * _SAMPLES))
        self.edges = array("i", bytes(4 * most))
        self.state = array("i", [mask, 0, 0, 0])
        self.port = getattr(stm, "GPIO" + port)
        self.at = stm.DMA2 + 0x10 + 0x18 * stream
        self.place = 0

    def arm(self):
        """Set up the stream for port and memory, and enable it."""
        mem32[self.at] = 0
        mem32[self.at + 4] = _SAMPLES
        mem32[self.at + 8] = self.port + stm.GPIO_IDR
        mem32[self.at + 12] = uctypes.addressof(self.samples)
        mem32[self.at + 20] = 0
        self.state[1] = mem32[self.port + stm.GPIO_IDR] & self.state[0]
        mem32[self.at] = _CHANNEL | _HALF_WORDS
        mem32[self.at] = _CHANNEL | _HALF_WORDS | 1

    def look(self):
        """Process the samples since the last call."""
        place = (_SAMPLES - mem32[self.at + 4]) % _SAMPLES
        if place < self.place:
            scan(self.samples, self.place, _SAMPLES, self.state, self.edges, len(self.edges))
            self.place = 0
        scan(self.samples, self.place, place, self.state, self.edges, len(self.edges))
        self.place = place

    def window(self):
        """(count, shortest, longest time between two in us) of the last 4096 samples' rising edges, by pin."""
        found = {}
        for line in range(16):
            if self.state[_MASK] >> line & 1:
                first = self.samples[self.place] & 1 << line
                state = array("i", [1 << line, first, 0, 0, 0, _SAMPLES, 0])
                measure_rises(self.samples, self.place, _SAMPLES, state)
                measure_rises(self.samples, 0, self.place, state)
                found[self.name + str(line)] = (state[2], state[5], state[6])
        return found


def begin(captures):
    """Start TIM1's requests, one per microsecond."""
    mem32[stm.RCC + stm.RCC_AHB1ENR] = mem32[stm.RCC + stm.RCC_AHB1ENR] | _DMA2EN
    mem32[stm.RCC + stm.RCC_APB2ENR] = mem32[stm.RCC + stm.RCC_APB2ENR] | _TIM1EN
    for register in (stm.TIM_CR1, stm.TIM_DIER, stm.TIM_SMCR, stm.TIM_CCER, stm.TIM_CCMR1, stm.TIM_PSC):
        mem32[_TIM1 + register] = 0
    mem32[_TIM1 + stm.TIM_ARR] = _PERIOD
    mem32[_TIM1 + stm.TIM_CCR1] = _PERIOD // 2
    mem32[_TIM1 + stm.TIM_EGR] = 1
    mem32[_TIM1 + stm.TIM_SR] = 0
    mem32[stm.DMA2 + 8] = 0x0F7D0F7D
    mem32[stm.DMA2 + 12] = 0x0F7D0F7D
    for capture in captures:
        capture.arm()
    mem32[_TIM1 + stm.TIM_DIER] = _REQUESTS
    mem32[_TIM1 + stm.TIM_CR1] = 1


def end(captures):
    """Stop the requests."""
    mem32[_TIM1 + stm.TIM_CR1] = 0
    mem32[_TIM1 + stm.TIM_DIER] = 0
    for capture in captures:
        if mem32[capture.at] & 1:
            capture.place = (_SAMPLES - mem32[capture.at + 4]) % _SAMPLES
        mem32[capture.at] = 0


def captured(record, joints, most, wanted="AB"):
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
