"""Viper code that reaches registers: rings, the compare interrupt, the freeze. Allocates nothing.

The offsets here are the only home of the register layout (word offsets; RM0090). ``block`` is the
memory shared by the main loop and the interrupts; its layout follows the offsets. Costs are instructions of
the Cortex-M4 (see docs/hardware.md); the same code runs on 64-bit interpreters, where words do not wrap and
loads are not sign-extended, so every difference of two times is cut to size before it is judged.
"""

import micropython
from micropython import const

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

# words of a ring's state
MADE = const(0)  # entries written since the stream was started
LOADS = const(1)  # words that the stream has handed on since; as many matches have been
FIRST = const(2)  # NDTR right after the start
LAST = const(3)  # time of the last entry written
FAR = const(4)  # the far-away entry behind it
MASK = const(5)  # entries of the ring less 1; they are a power of two, so that an index is a mask away
STATE_WORDS = const(6)

# words of the block
NEXT = const(0)  # time of the next sample
LEFT = const(1)  # samples still to come before the last one
END = const(2)  # time of the last sample
DONE = const(3)  # the last sample has been taken
TAKEN = const(4)  # raw samples taken
READ = const(5)  # raw samples converted
LOST = const(6)  # raw samples that found no room
NOW = const(7)  # counter when the interrupt came
FROZEN = const(8)  # outputs are frozen
FROZEN_AT = const(9)  # counter at that moment
FAULT = const(10)
FAULT_JOINT = const(11)
HIGH = const(12)  # bit a joint: its STEP was high when frozen, so the step begun was finished
PULSE = const(13)  # STEP high time
JOINTS = const(14)
ENCODERS = const(15)
LATE = const(16)  # a DIR turn came too late
SLACK = const(17)  # how late it may come
SETUP = const(18)  # DIR stable before a rising edge
BLOCK_HEAD = const(19)
# words of a joint in the block, behind the head
DIR_BIT = const(0)
TURNS_IN = const(1)
TURNS_OUT = const(2)
NDTR_AT = const(3)  # word offset of its stream's NDTR in DMA1
ON_TIM5 = const(4)
CCR_AT = const(5)
CCMR_AT = const(6)
MODE_SHIFT = const(7)
ON_PORT_B = const(8)
PIN_BIT = const(9)
TURN_TIMES = const(10)
TURN_ROOM = const(8)
JOINT_WORDS = const(18)

# a limit switch and a joint: line, DIR bit, DIR level that moves towards it, joint, whether it moves
PAIR_WORDS = const(5)
# a raw sample: counter, NDTR a joint (6), encoder counter (4)
RAW_WORDS = const(11)
RAW_ROOM = const(4)  # 0.4 s; the main loop comes every few milliseconds
_SAMPLE_TICKS = const(8400000)
_LATEST = const(84)  # 1 us: a compare value nearer than that may be missed
_TOGGLE = const(3)
_FORCED_LOW = const(4)


@micropython.viper
def clock_k(timer: ptr32) -> int:
    """The counter in units of 1024 ticks, 22 bits."""
    return (timer[CNT] >> 10) & 0x3FFFFF


@micropython.viper
def in_step(timer2: ptr32, timer5: ptr32) -> int:
    """1 where both counters show the same time, as far as reads one after the other can tell; else 0.

    0 also where an interrupt came between the reads.
    """
    before = timer2[CNT]
    other = timer5[CNT]
    took = (timer2[CNT] - before) & 0x3FFFFFFF
    apart = (other - before + 16) & 0x3FFFFFFF
    return 1 if took < 100 and apart <= took + 32 else 0


@micropython.viper
def word_k(words: ptr32, at: int) -> int:
    """A counter value kept in an array, in units of 1024 ticks, 22 bits."""
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
def until_k(timer: ptr32, words: ptr32, at: int) -> int:
    """Units of 1024 ticks from now until the time ``words[at]``; negative when it has passed."""
    gap = ((words[at] - timer[CNT]) >> 10) & 0x3FFFFF
    if gap >= 0x200000:
        gap -= 0x400000
    return gap


@micropython.viper
def advance(state: ptr32, ndtr: int) -> int:
    """Count the stream's loads up to a reading of NDTR; entries that have not matched yet.

    Fewer loads than the ring has entries can have come since the last count, so the difference is unambiguous.
    """
    loads = state[LOADS]
    loads += (state[FIRST] - ndtr - loads) & state[MASK]
    state[LOADS] = loads
    return state[MADE] - loads


@micropython.viper
def read_ndtr(stream: ptr32, block: ptr32) -> int:
    """Words that the stream has still to hand on in this round; -1 while a raw sample waits to be converted.

    Counts go forward only, and the raw sample may be older than this reading.
    """
    ndtr = stream[STREAM_NDTR] & 0xFFFF
    if block[TAKEN] != block[READ]:
        return -1
    return ndtr


@micropython.viper
def seal(state: ptr32, ring: ptr32, count: int) -> object:
    """Take ``count`` new entries in and write the far-away entry behind them.

    Entry 0 goes into the compare register by hand, so the stream begins with entry 1 and runs over the
    words behind it: word 0 is repeated behind the end.
    """
    mask = state[MASK]
    made = state[MADE] + count
    last = ring[(made - 1) & mask]
    half = 1
    far = last + (half << 31)
    ring[made & mask] = far
    ring[mask + 1] = ring[0]
    state[MADE] = made
    state[LAST] = last
    state[FAR] = far


@micropython.viper
def arm_channel(block: ptr32, timer: ptr32, ring: ptr32, at: int) -> int:
    """Put the first entry into the compare register and let it toggle; 1 unless it is too late for that.

    ``at``: the joint's words in the block. Call it with interrupts off.
    """
    if block[FROZEN]:
        return 1
    first = ring[0]
    given = block[at + TURNS_IN]
    if given != block[at + TURNS_OUT]:
        turn = block[at + TURN_TIMES + ((given - 1) & (TURN_ROOM - 1))]
        if ((first - turn - block[SETUP]) >> 31) & 1:
            return 0
    shift = block[at + MODE_SHIFT]
    compare = block[at + CCR_AT]
    timer[compare] = first
    channel = compare - CCR1 + 1
    timer[SR] = (1 << 16) - 1 - (1 << channel)
    mode = block[at + CCMR_AT]
    timer[mode] = (timer[mode] & (0xFFFF - (7 << shift))) | (_TOGGLE << shift)
    timer[DIER] = timer[DIER] | (1 << (8 + channel))
    return 1 - (((first - timer[CNT] - _LATEST) >> 31) & 1)


@micropython.viper
def release_channel(block: ptr32, timer: ptr32, at: int) -> object:
    """Hold the output low and take no more words from DMA. Call it with interrupts off."""
    shift = block[at + MODE_SHIFT]
    channel = block[at + CCR_AT] - CCR1 + 1
    mode = block[at + CCMR_AT]
    timer[mode] = (timer[mode] & (0xFFFF - (7 << shift))) | (_FORCED_LOW << shift)
    timer[DIER] = timer[DIER] & (0xFFFF - (1 << (8 + channel)))


@micropython.viper
def push_away(timer: ptr32, compare: int, state: ptr32) -> object:
    """Move an idle compare value as far away as the counter allows."""
    half = 1
    far = timer[CNT] + (half << 31)
    timer[compare] = far
    state[FAR] = far


@micropython.viper
def mark(timer: ptr32, state: ptr32) -> object:
    """Count the last entry as being now."""
    state[LAST] = timer[CNT]


@micropython.viper
def add_turn(block: ptr32, state: ptr32, at: int, delay: int) -> int:
    """Queue a turn of DIR, ``delay`` ticks behind the last entry; 0 when the queue is full."""
    given = block[at + TURNS_IN]
    if ((given - block[at + TURNS_OUT]) & 0xFF) >= TURN_ROOM:
        return 0
    block[at + TURN_TIMES + (given & (TURN_ROOM - 1))] = state[LAST] + delay
    block[at + TURNS_IN] = (given + 1) & 0xFF
    return 1


@micropython.viper
def call_soon(timer: ptr32) -> object:
    """Have the compare interrupt come in 4 us, to look at what was queued."""
    while True:
        timer[CCR4] = timer[CNT] + 336
        if ((timer[CCR4] - timer[CNT]) >> 31) & 1 == 0:
            break


@micropython.viper
def serve(block: ptr32, timer: ptr32, port: ptr32) -> int:
    """The compare interrupt: turn the DIR pins that are due; 1 when a sample is due, else arm for the next.

    200 instructions and 48 a joint; a turn of DIR takes as much again.
    """
    while True:
        now = timer[CNT]
        soonest = 1 << 29
        levels = port[ODR]
        turned = 0
        at = BLOCK_HEAD
        for _ in range(block[JOINTS]):
            out = block[at + TURNS_OUT]
            if out != block[at + TURNS_IN] and block[FROZEN] == 0:
                gap = block[at + TURN_TIMES + (out & (TURN_ROOM - 1))] - now
                if ((gap - 1) >> 31) & 1:
                    bit = block[at + DIR_BIT]
                    turned |= bit << 16 if levels & bit else bit
                    block[at + TURNS_OUT] = (out + 1) & 0xFF
                    if ((gap + block[SLACK]) >> 31) & 1:
                        block[LATE] = 1
                    soonest = 0
                else:
                    gap &= 0x3FFFFFFF
                    if gap < soonest:
                        soonest = gap
            at += JOINT_WORDS
        if turned:
            port[BSRR] = turned
        if block[DONE] == 0:
            gap = block[NEXT] - now
            if ((gap - 1) >> 31) & 1:
                block[NOW] = now
                return 1
            gap &= 0x3FFFFFFF
            if gap < soonest:
                soonest = gap
        if soonest:
            timer[CCR4] = now + soonest
            if ((now + soonest - timer[CNT] - 1) >> 31) & 1 == 0:
                return 0


@micropython.viper
def take(raw: ptr32, block: ptr32, dma: ptr32, encoders: object) -> object:
    """Store a raw sample and find the time of the next. 250 instructions, 30 a joint, 100 an encoder."""
    taken = block[TAKEN]
    if ((taken - block[READ]) & 0xFF) >= RAW_ROOM:
        block[LOST] += 1
    else:
        to = (taken & (RAW_ROOM - 1)) * RAW_WORDS
        raw[to] = block[NOW]
        at = BLOCK_HEAD + NDTR_AT
        for joint in range(block[JOINTS]):
            raw[to + 1 + joint] = dma[block[at]]
            at += JOINT_WORDS
        for index in range(block[ENCODERS]):
            counter = ptr32(encoders[index])  # type: ignore[index]
            raw[to + 7 + index] = counter[CNT]
        block[TAKEN] = (taken + 1) & 0xFF
    left = block[LEFT]
    if left > 1:
        block[LEFT] = left - 1
        block[NEXT] = block[NEXT] + _SAMPLE_TICKS
    elif left == 1:
        block[LEFT] = 0
        block[NEXT] = block[END]
    else:
        block[DONE] = 1


@micropython.viper
def freeze(block: ptr32, timer2: ptr32, timer5: ptr32) -> int:
    """Stop all STEP outputs now; ``finish_pulses`` has to follow; 0 where that is done. 135 + 50 a joint.

    First no more words come from DMA, then every compare value goes far away: from there on the pins stand
    still. What DMA had been asked for before is served within a few bus cycles, long before its compare value
    is overwritten here.
    """
    if block[FROZEN]:
        return 0
    block[FROZEN] = 1
    timer2[DIER] = 0
    timer5[DIER] = 0
    now = timer2[CNT]
    half = 1
    far = now + (half << 31)
    at = BLOCK_HEAD
    for _ in range(block[JOINTS]):
        if block[at + ON_TIM5]:
            timer5[block[at + CCR_AT]] = far
        else:
            timer2[block[at + CCR_AT]] = far
        at += JOINT_WORDS
    block[FROZEN_AT] = now
    return 1


@micropython.viper
def finish_pulses(block: ptr32, timer2: ptr32, timer5: ptr32, ports: object) -> object:
    """After ``freeze``: a STEP pin that is high gets its falling edge, one that is low is held low."""
    port_a = ptr32(ports[0])  # type: ignore[index]
    port_b = ptr32(ports[1])  # type: ignore[index]
    high = 0
    at = BLOCK_HEAD
    for joint in range(block[JOINTS]):
        timer = timer2
        if block[at + ON_TIM5]:
            timer = timer5
        port = port_a
        if block[at + ON_PORT_B]:
            port = port_b
        if (port[IDR] >> block[at + PIN_BIT]) & 1:
            high |= 1 << joint
            timer[block[at + CCR_AT]] = timer[CNT] + block[PULSE]
        else:
            mode = block[at + CCMR_AT]
            shift = block[at + MODE_SHIFT]
            timer[mode] = (timer[mode] & (0xFFFF - (7 << shift))) | (_FORCED_LOW << shift)
        at += JOINT_WORDS
    block[HIGH] = high


@micropython.viper
def trip(block: ptr32, code: int, joint: int) -> object:
    """Note a fault; the first one stays."""
    if block[FAULT] == 0:
        block[FAULT] = code
        block[FAULT_JOINT] = joint


@micropython.viper
def towards(pairs: ptr32, count: int, line: int, levels: int) -> int:
    """1 + the active joint that moves towards the switch on ``line``, or 0; ``levels`` of the DIR port."""
    at = 0
    for _ in range(count):
        if pairs[at] == line and pairs[at + 4] and ((levels >> pairs[at + 1]) & 1) == pairs[at + 2]:
            return pairs[at + 3] + 1
        at += PAIR_WORDS
    return 0


@micropython.viper
def directions(port: ptr32) -> int:
    """Levels that the program drives the DIR port to."""
    return port[ODR]
