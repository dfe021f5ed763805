"""Compiled code that reaches registers: rings, the compare interrupt, the freeze. Allocates nothing.

One file, as the compiler puts constants in only within a file. The offsets here are the only home of the register
layout (in words; RM0090). ``block`` is the memory that the main loop and the interrupts share; its layout follows the
offsets. Costs are instructions of the Cortex-M4 (docs/hardware.md). The same code runs on 64-bit interpreters, where
words do not wrap and loads are not sign-extended; so every difference of two times is cut to size before it is judged.

Ki ticks are 1024 ticks (12.2 us): the counter in them has 22 bits, which are a small integer.
"""

import micropython
import uctypes
from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from collections.abc import Callable

# TIM2, TIM5 and encoder timers: RM0090 18.4.21
CR1 = const(0)
CR2 = const(1)
SMCR = const(2)
DIER = const(3)
SR = const(4)
EGR = const(5)
CCMR1 = const(6)
CCER = const(8)
CNT = const(9)
PSC = const(10)
ARR = const(11)
CCR1 = const(13)
CCR4 = const(16)
# one DMA stream: RM0090 10.5.11
STREAM_CR = const(0)
STREAM_NDTR = const(1)
STREAM_PAR = const(2)
STREAM_M0AR = const(3)
STREAM_FCR = const(5)
STREAM_ON = const(1)
# GPIO: RM0090 8.4.11
IDR = const(4)
ODR = const(5)
BSRR = const(6)

# words of the block
NEXT_SAMPLE = const(0)  # time of the next sample
SAMPLES_LEFT = const(1)  # samples still to come before the last one
LAST_SAMPLE = const(2)  # time of the last sample
SAMPLES_DONE = const(3)  # the last sample has been taken
RAW_IN = const(4)  # raw samples taken
RAW_OUT = const(5)  # raw samples converted
RAW_LOST = const(6)  # raw samples that found no space
FROZEN = const(8)  # outputs are frozen; why, as bits as in LINE_MASK
FAULT = const(9)
FAULT_JOINT = const(10)
HIGH_A = const(11)  # port A when frozen: a STEP pin that was high finishes its pulse;
PULSE_TICKS = const(12)  # STEP high time
JOINTS = const(13)
ENCODERS = const(14)
REVERSAL_LATE = const(15)  # a reversal of DIR came too late
REVERSAL_SLACK_TICKS = const(16)  # how late it may come
DIR_SETUP_TICKS = const(17)  # DIR stable before a rising edge
HIGH_B = const(18)  # and port B
TIM2_AT = const(19)  # its address: the low 30 bits, and in the next word the rest
PORT_A_OFFSET = const(21)  # bytes from TIM2 to port A
BLOCK_HEAD = const(22)
ALWAYS = const(1 << 16)  # in LINE_LEVELS and LINE_MASK, where no pin is: whatever DIR says
# words of a joint in the block, after the head
DIR_BIT = const(0)  # in the DIR port
REVERSALS_IN = const(1)  # reversals of DIR that were queued,
REVERSALS_OUT = const(2)  # and made
CCR_AT = const(3)  # word of its compare register in the timer
CCMR_AT = const(4)  # and of the register that has its mode,
MODE_SHIFT = const(5)  # with the mode's place there
ON_PORT_B = const(6)  # its STEP pin; else on port A
PIN_BIT = const(7)
REVERSAL_TIMES = const(8)  # when the queued reversals are due
MOST_REVERSALS = const(8)  # this many
RING = const(16)  # the state of its ring
JOINT_WORDS = const(29)
# words of a line after six joints: of an external interrupt, 8 to 15, or of the program itself
FIRST_LINE = const(196)
SOFTWARE_LINE = const(7)
LINE_LEVELS = const(0)  # DIR pins that freeze if they are low,
LINE_MASK = const(1)  # and all that freeze at one of their levels
LINE_RELEASE = const(2)  # written to port E's BSRR
LINE_TRIPPED = const(3)  # it has called for a freeze
LINE_WORDS = const(4)
BLOCK_WORDS = const(232)
# words of a ring's state
WRITTEN = const(0)  # entries written since the stream was started
MATCHED = const(1)  # words that the stream has handed on since; as many matches have been
NDTR_AT_START = const(2)  # NDTR right after the start
LAST_TIME = const(3)  # time of the last entry written
FAR_TIME = const(4)  # of the entry after it, half a round of the counter away
MASK = const(5)  # entries of the ring, a power of two, less 1
NDTR_AT = const(6)  # word offset of its stream's NDTR in DMA1
FED = const(7)  # the interrupt writes to the ring; it stops that when the ring has run out of entries
SPACE = const(8)  # entries that may be written now
RING_AT = const(9)  # where its words are: the low 30 bits of the address, and in the next word the rest
QUEUE_AT = const(11)  # and those of the queue that it is filled from
STATE_WORDS = const(13)

# words of a raw sample
RAW_COUNTER = const(0)
RAW_MATCHES = const(1)  # six, one a joint
RAW_ENCODERS = const(7)  # four counters
RAW_WORDS = const(11)
RAW_SPACE = const(4)  # raw samples: 0.4 s; the main loop comes every few milliseconds

# SAMPLE_TICKS of limits.py
_SAMPLE_TICKS = const(8400000)

_FIRST_ENTRY = const(0)
_LEAST_AHEAD_TICKS = const(84)  # 1 us: a compare value nearer than that may be missed
_CALL_TICKS = const(336)  # 4 us
_LOW_BITS = const(0x3FFFFFFF)
SPARE_ENTRIES = const(8)  # of a ring, that are not overwritten: those matched last, and the far-away entry
_GUARD_TICKS = const(32768)  # 390 us: entries are only added after a rising edge that is further away,
_FAR_AHEAD_TICKS = const(3145728)  # but not 37 ms away,
_MOST_ENTRIES = const(512)  # and at most this many, which takes less than the 390 us
# modes of an output (RM0090 18.4.7), by what is subtracted from all three bits set
_MODE_BITS = const(7)
_TO_TOGGLE = const(4)  # 3: toggle on match
_TO_FORCED_LOW = const(3)  # 4: forced inactive
# what the freeze reaches by constant distances (RM0090 2.3), in words
_TIM5 = const(768)  # after TIM2
_PORT_B = const(256)  # after port A
_PORT_E = const(1024)
_CCMR2 = const(7)
_LINE_0 = const(168)  # FIRST_LINE - SOFTWARE_LINE * LINE_WORDS
_LINE_BYTES = const(16)
_LOW = const(64)  # forced inactive for the first channel of a CCMR register,
_BOTH_LOW = const(16448)  # for both of them; less 1 in a mode's place: toggle


@micropython.viper
def counter_kiticks(timer: ptr32) -> int:
    """The counter in Ki ticks, 22 bits."""
    return (timer[CNT] >> 10) & 0x3FFFFF


@micropython.viper
def counters_agree(timer2: ptr32, timer5: ptr32) -> int:
    """1 if both counters show the same time, as far as reads one after the other can tell; else 0.

    0 also if an interrupt came between the reads.
    """
    before = timer2[CNT]
    other = timer5[CNT]
    took = (timer2[CNT] - before) & 0x3FFFFFFF
    apart = (other - before + 16) & 0x3FFFFFFF
    return 1 if took < 100 and apart <= took + 32 else 0


@micropython.viper
def word_kiticks(words: ptr32, at: int) -> int:
    """A counter value in an array, in Ki ticks, 22 bits."""
    return (words[at] >> 10) & 0x3FFFFF


@micropython.viper
def copy_word(source: ptr32, at: int, target: ptr32, to: int) -> object:
    """Copy a word that may be too large for a small integer."""
    target[to] = source[at]


@micropython.viper
def read_counter(timer: ptr32) -> int:
    """A 16-bit counter."""
    return timer[CNT] & 0xFFFF


@micropython.viper
def kiticks_until(timer: ptr32, words: ptr32, at: int) -> int:
    """Ki ticks from now until the time ``words[at]``; negative when it has passed."""
    return ((((words[at] - timer[CNT]) >> 10) + 0x200000) & 0x3FFFFF) - 0x200000


@micropython.viper
def matches(state: ptr32, dma: ptr32) -> int:
    """Matches of a ring since its stream was started.

    Fewer than the ring has entries can have come since MATCHED was written. So the difference is unambiguous, also
    if the interrupt writes MATCHED meanwhile.
    """
    matched = state[MATCHED]
    return matched + ((state[NDTR_AT_START] - dma[state[NDTR_AT]] - matched) & state[MASK])


@micropython.viper
def rings_to_refill(block: ptr32, dma: ptr32, timer: ptr32) -> int:
    """One bit per joint: three eighths of its ring are free, so up to SPACE entries are added. -1: no ring is fed.

    130 instructions and 79 a joint, 126 if entries are to be added.
    """
    found = 0
    fed = 0
    now = timer[CNT] + block[PULSE_TICKS] + _GUARD_TICKS
    joint = 0 if block[FROZEN] else block[JOINTS]
    block = ptr32(int(block) + 4 * (BLOCK_HEAD + RING) + joint * (4 * JOINT_WORDS))
    while joint:
        joint -= 1
        block = ptr32(int(block) - 4 * JOINT_WORDS)
        if block[FED]:
            fed = 1
            block[MATCHED] = (
                (block[NDTR_AT_START] - dma[block[NDTR_AT]] - block[MATCHED]) & block[MASK]
            ) + block[MATCHED]
            space = block[MATCHED] - block[WRITTEN]
            if space:
                space += block[MASK] + 1
                if (
                    8 * space > 3 * block[MASK]
                    and ((block[LAST_TIME] - now) & 0x3FFFFFFF) < _FAR_AHEAD_TICKS - _GUARD_TICKS
                ):
                    found |= 1 << joint
                    space -= SPARE_ENTRIES
                    block[SPACE] = space
                    if space > _MOST_ENTRIES:
                        block[SPACE] = _MOST_ENTRIES
            else:
                block[FED] = 0
    return found if fed else -1


def set_places(state: "array[int] | memoryview[int]", ring: object, queue: object) -> None:
    """Note where a ring's words and its queue are."""
    for at, part in ((RING_AT, ring), (QUEUE_AT, queue)):
        address = uctypes.addressof(part)
        state[at] = address & _LOW_BITS
        state[at + 1] = address >> 30


@micropython.viper
def arm_channel(block: ptr32, timer: ptr32, ring: ptr32, at: int) -> int:
    """Put the first entry into the compare register and let it toggle; 1 if it is too late for that.

    ``at``: the joint's words in the block. Call it with interrupts off.
    """
    if block[FROZEN]:
        return 0
    first = ring[_FIRST_ENTRY]
    due = first - block[DIR_SETUP_TICKS]
    block = ptr32(int(block) + 4 * at)
    if (
        block[REVERSALS_IN] != block[REVERSALS_OUT]
        and ((due - block[REVERSAL_TIMES + ((block[REVERSALS_IN] - 1) & (MOST_REVERSALS - 1))]) >> 31) & 1
    ):
        return 1
    timer[block[CCR_AT]] = first
    bit = 1 << (block[CCR_AT] - CCR1 + 1)
    timer[SR] = (1 << 16) - 1 - bit
    mode = block[CCMR_AT]
    timer[mode] = (timer[mode] | (_MODE_BITS << block[MODE_SHIFT])) - (_TO_TOGGLE << block[MODE_SHIFT])
    timer[DIER] = timer[DIER] | (bit << 8)
    return ((first - timer[CNT] - _LEAST_AHEAD_TICKS) >> 31) & 1


@micropython.viper
def release_channel(block: ptr32, timer: ptr32, at: int) -> object:
    """Hold the output low and take no more words from DMA. Call it with interrupts off."""
    block = ptr32(int(block) + 4 * at)
    mode = block[CCMR_AT]
    timer[mode] = (timer[mode] | (_MODE_BITS << block[MODE_SHIFT])) - (_TO_FORCED_LOW << block[MODE_SHIFT])
    timer[DIER] = timer[DIER] & (0xFFFF - (1 << (block[CCR_AT] - CCR1 + 9)))


@micropython.viper
def park_compare(timer: ptr32, compare: int, state: ptr32) -> object:
    """Move the compare value of an empty ring half a round of the counter away."""
    half = 1
    far = timer[CNT] + (half << 31)
    timer[compare] = far
    state[FAR_TIME] = far


@micropython.viper
def add_reversal(block: ptr32, state: ptr32, at: int, delay: int) -> int:
    """Queue a reversal of DIR, ``delay`` ticks after the last entry; 0 when the queue is full."""
    block = ptr32(int(block) + 4 * at)
    queued = block[REVERSALS_IN]
    if ((queued - block[REVERSALS_OUT]) & 0xFF) >= MOST_REVERSALS:
        return 0
    block[REVERSAL_TIMES + (queued & (MOST_REVERSALS - 1))] = state[LAST_TIME] + delay
    block[REVERSALS_IN] = (queued + 1) & 0xFF
    return 1


@micropython.viper
def interrupt_soon(timer: ptr32) -> object:
    """Let the compare interrupt come in 4 us, to look at what was queued."""
    while True:
        timer[CCR4] = timer[CNT] + _CALL_TICKS
        if ((timer[CCR4] - timer[CNT]) >> 31) & 1 == 0:
            break


@micropython.viper
def serve_compare(block: ptr32, timer: ptr32, port: ptr32) -> int:
    """The compare interrupt: turn the DIR pins that are due; 1 when a sample is due, else arm for the next.

    185 instructions and 24 a joint; a reversal of DIR takes almost as much again.
    """
    head = block
    while True:
        now = timer[CNT]
        soonest = 1 << 29
        reversed_pins = 0
        joints = block[JOINTS]
        block = ptr32(int(block) + 4 * BLOCK_HEAD)
        while joints:
            joints -= 1
            if block[REVERSALS_OUT] != block[REVERSALS_IN] and not head[FROZEN]:
                gap = block[REVERSAL_TIMES + (block[REVERSALS_OUT] & (MOST_REVERSALS - 1))] - now
                if ((gap - 1) >> 31) & 1:
                    bit = block[DIR_BIT]
                    if port[ODR] & bit:
                        bit <<= 16
                    reversed_pins |= bit
                    block[REVERSALS_OUT] = (block[REVERSALS_OUT] + 1) & 0xFF
                    if ((gap + head[REVERSAL_SLACK_TICKS]) >> 31) & 1:
                        head[REVERSAL_LATE] = 1
                    soonest = 0
                else:
                    gap &= 0x3FFFFFFF
                    if gap < soonest:
                        soonest = gap
            block = ptr32(int(block) + 4 * JOINT_WORDS)
        block = head
        if reversed_pins:
            port[BSRR] = reversed_pins
        if not block[SAMPLES_DONE]:
            gap = block[NEXT_SAMPLE] - now
            if ((gap - 1) >> 31) & 1:
                return 1
            gap &= 0x3FFFFFFF
            if gap < soonest:
                soonest = gap
        if soonest:
            now += soonest
            timer[CCR4] = now
            if not ((now - timer[CNT] - 1) >> 31) & 1:
                return 0


@micropython.viper
def take_sample(raw: ptr32, block: ptr32, dma: ptr32, encoders: object, timer: ptr32) -> object:
    """Store a raw sample, with the counter just before it, and find the time of the next.

    180 instructions, 40 a joint, 100 an encoder.
    """
    n = block[RAW_IN]
    if ((n - block[RAW_OUT]) & 0xFF) >= RAW_SPACE:
        block[RAW_LOST] = block[RAW_LOST] + 1
    else:
        block[RAW_IN] = (n + 1) & 0xFF
        raw = ptr32(int(raw) + (n & (RAW_SPACE - 1)) * (4 * RAW_WORDS))
        raw[RAW_COUNTER] = timer[CNT]
        head = block
        n = block[JOINTS]
        raw = ptr32(int(raw) + 4 * n)
        block = ptr32(int(block) + 4 * (BLOCK_HEAD + RING) + n * (4 * JOINT_WORDS))
        while n:
            n -= 1
            block = ptr32(int(block) - 4 * JOINT_WORDS)
            raw[0] = ((block[NDTR_AT_START] - dma[block[NDTR_AT]] - block[MATCHED]) & block[MASK]) + block[
                MATCHED
            ]
            raw = ptr32(int(raw) - 4)
        block = head
        n = block[ENCODERS]
        while n:
            n -= 1
            raw[RAW_ENCODERS + n] = ptr32(encoders[n])[CNT]  # type: ignore[index]
    n = block[SAMPLES_LEFT]
    if n:
        n -= 1
        block[SAMPLES_LEFT] = n
        if n:
            block[NEXT_SAMPLE] = block[NEXT_SAMPLE] + _SAMPLE_TICKS
        else:
            block[NEXT_SAMPLE] = block[LAST_SAMPLE]
    else:
        block[SAMPLES_DONE] = 1


def freezer(shared: "array[int]") -> "Callable[[int], object]":
    """What stops all STEP outputs: the callback of E-stop and limit switches. ``shared``: the block.

    Looking up a name takes 110 to 150 instructions of an interrupt, so nothing is looked up: all that it needs is
    in the block. It takes the same time whatever the joints do (docs/hardware.md).

    The counters are stopped: no edge comes, and what it reads belongs together. DMA has long brought each compare
    register its next edge when its requests are switched off. Pins that are low are held low. One that is high has its
    falling edge in its compare register, which comes when the counters continue.
    """
    address = uctypes.addressof(shared)

    @micropython.viper
    def freeze(line: int) -> object:
        block = ptr32(int(address))
        tim2 = ptr32((block[TIM2_AT + 1] << 30) + block[TIM2_AT])
        port_a = ptr32(int(tim2) + block[PORT_A_OFFSET])
        words = ptr32(int(block) + _LINE_BYTES * line)
        why = (port_a[_PORT_E + ODR] ^ words[_LINE_0 + LINE_LEVELS]) & words[_LINE_0 + LINE_MASK]
        if why:
            if not block[FROZEN]:
                block[FROZEN] = why
                runs = tim2[CR1]
                tim2[CR1] = 0
                tim2[_TIM5 + CR1] = 0
                high = port_a[IDR]
                high_b = port_a[_PORT_B + IDR]
                # PA0 and PA2, PA3 on TIM5; PA15 and PA1, PB10 on TIM2: see pins.py
                tim2[_TIM5 + CCMR1] = _BOTH_LOW - ((high & 1) << 4)
                tim2[_TIM5 + _CCMR2] = _BOTH_LOW - ((high & 4) << 2) - ((high & 8) << 9)
                tim2[CCMR1] = _BOTH_LOW - ((high & 2) << 11) - ((high >> 11) & 16)
                tim2[_CCMR2] = _LOW - ((high_b >> 6) & 16)
                tim2[_TIM5 + DIER] = 0
                tim2[DIER] = 0
                tim2[CR1] = runs  # starts TIM5 as well
                block[HIGH_A] = high
                block[HIGH_B] = high_b
            port_a[_PORT_E + BSRR] = words[_LINE_0 + LINE_RELEASE]
            words[_LINE_0 + LINE_TRIPPED] = 1
        return shared  # so that the callback keeps it alive

    return freeze


@micropython.viper
def set_fault(block: ptr32, code: int, joint: int) -> object:
    """Note a fault; the first one stays."""
    if not block[FAULT]:
        block[FAULT] = code
        block[FAULT_JOINT] = joint


@micropython.viper
def output_levels(port: ptr32) -> int:
    """Levels that the program drives the DIR port to."""
    return port[ODR]
