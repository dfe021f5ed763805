"""Counting, times and turns on plain memory: what the rings and the interrupts compute with."""

from array import array

import bare_board  # noqa: F401
import cases
import stm
import uctypes
from armtempo_board.hardware import isr, pins, registers
from armtempo_board.stepgen import step_queue
from armtempo_shared.engine_memory import ring_words
from engine_rig import Rig, arm, row
from machine import mem32

BLOCK = isr.BLOCK_HEAD + 6 * isr.JOINT_WORDS
ITEM_TIME, ITEM_BASE = 0, 6  # as in step_queue.py: words of a queue
APART = 6_000_000  # ticks from one step to the next


def words(count):
    return array("I", bytearray(4 * count))


def ring_state(entries):
    """The state of a ring with that many entries."""
    state = words(isr.STATE_WORDS)
    state[isr.MASK] = entries - 1
    return state


def states(block):
    """Where the states of the rings begin."""
    return memoryview(block)[isr.BLOCK_HEAD + isr.RING :]


def case_counting_matches():
    """NDTR counts down and starts again; every match is counted whatever the number since the last look."""
    for entries, first in ((1024, 1024), (1024, 1023), (64, 64), (128, 127)):
        state, dma = ring_state(entries), words(60)
        state[isr.NDTR_AT_START] = first
        state[isr.NDTR_AT] = 35
        total = 0
        for jump in (0, 1, 2, entries - 1, 0, entries // 2 - 1, entries - 1, entries - 24, 7) * 3:
            total += jump
            dma[35] = (first - total) % entries or entries
            assert isr.matches(state, dma) == total
            state[isr.MATCHED] = total


def ready(entries, made, matched, last, now):
    """A block whose second joint has a fed ring, the ring's state in it, DMA, timer."""
    block, dma, timer = words(BLOCK), words(60), words(18)
    block[isr.JOINTS] = 2
    block[isr.PULSE_TICKS] = 100
    at = isr.BLOCK_HEAD + isr.JOINT_WORDS + isr.RING
    state = memoryview(block)[at : at + isr.STATE_WORDS]
    state[isr.MASK] = entries - 1
    state[isr.NDTR_AT_START] = entries
    state[isr.NDTR_AT] = 35
    state[isr.WRITTEN] = made
    state[isr.FED] = 1
    state[isr.LAST_TIME] = last & 0xFFFFFFFF
    dma[35] = (entries - matched) % entries or entries
    timer[isr.CNT] = now & 0xFFFFFFFF
    return block, state, dma, timer


def case_when_to_write():
    """If three eighths are free and the last rising edge is 390 us to 37 ms ahead; a dry ring is fed no more."""
    guard, plenty = 32768 + 100, 3145728 + 100
    for entries, made, matched, last, now, hungry, fed in (
        (64, 20, 8, guard, 0, 1, 1),
        (64, 20, 8, guard - 1, 0, 0, 1),
        (64, 20, 8, guard, 0x100000000, 1, 1),
        (64, 20, 8, 5, 0xFFFFFFFF - guard + 6, 1, 1),
        (64, 20, 8, 5, 0xFFFFFFFF - guard + 7, 0, 1),
        (64, 20, 8, 0xFFFFFFFF, 5, 0, 1),
        (64, 20, 8, plenty - 1, 0, 1, 1),
        (64, 20, 8, plenty, 0, 0, 1),
        (64, 20, 20, guard, 0, 0, 0),
        (64, 48, 8, guard, 0, 1, 1),
        (64, 49, 8, guard, 0, 0, 1),
        (1024, 5000, 4990, guard, 0, 1, 1),
    ):
        block, state, dma, timer = ready(entries, made, matched, last, now)
        if matched > entries:
            state[isr.MATCHED] = matched - entries // 2
        assert isr.rings_to_refill(block, dma, timer) == 2 * hungry, (made, matched, last, now)
        assert state[isr.FED] == fed
        assert state[isr.MATCHED] == matched
        if hungry:
            assert state[isr.SPACE] == min(entries - 8 - (made - matched), 512)
        if not fed:
            assert isr.rings_to_refill(block, dma, timer) == -1
        block[isr.FROZEN] = 1
        assert isr.rings_to_refill(block, dma, timer) == -1


def case_written_and_wrapped():
    """The far-away entry is after the newest, the first word is repeated after the end; too late is told."""
    for entries in (64, 256, 1024):
        block, state, _, timer = ready(entries, 0, 0, 1000, 0)
        queue, ring = words(step_queue.QUEUE_SIZE), words(entries + 1)
        isr.set_places(state, ring, queue)
        queue[step_queue.PULSE] = 100
        queue[step_queue.FIRST] = APART
        queue[step_queue.SECOND] = queue[step_queue.THIRD] = 1 << 29
        queue[step_queue.GROUP] = 1
        queue[step_queue.UNTIL_KITICKS] = 1 << 28
        made = 0
        for count in (2, entries - 24, 20, 2, entries - 16, 16, 2, 0):
            before = state[isr.LAST_TIME]
            queue[ITEM_TIME] = 0
            queue[ITEM_BASE] = made // 2 * APART & 0xFFFFFFFF
            queue[step_queue.STEPS] = count // 2
            state[isr.SPACE] = count
            timer[isr.CNT] = (before - 100 + (count == 20)) & 0xFFFFFFFF
            assert step_queue.emit(2, states(block), timer) == 2 * (count == 20)
            made += count
            last = (made // 2 * APART + 100) & 0xFFFFFFFF
            assert state[isr.WRITTEN] == made
            assert state[isr.LAST_TIME] == last
            assert ring[made % entries] == last ^ 0x80000000 == state[isr.FAR_TIME]
            assert ring[entries] == ring[0]


def case_sizes():
    """A ring lasts as long as asked at a joint's highest rate, or is of the largest size."""
    previous = 64
    for rate in (0, 1, 1796, 1900, 3592, 4100, 8000, 20_000, 34_000, 333_000):
        entries = ring_words(rate, 3) - 1
        assert entries in (64, 128, 256, 512, 1024) and entries >= previous
        assert entries == 1024 or (entries - 8) * 1000 >= 2 * rate * 3, rate
        previous = entries
    assert [ring_words(rate, 3) for rate in (0, 9_300, 9_600, 333_000)] == [65, 65, 129, 1025]


def case_how_often_rings_are_written():
    """Every millisecond if each ring lasts 6.3 ms when it is full, else twice as often; TIM6 has 16 bits."""
    for rates, ticks in (
        ([20_000] * 3, 84_000),
        ([81_000], 84_000),
        ([82_000], 42_000),
        ([5_000, 82_000, 5_000], 42_000),
    ):
        Rig([row(channel=n, max_rate=rate) for n, rate in enumerate(rates)])
        prescaler, period = (mem32[stm.TIM6 + 4 * word] for word in (isr.PSC, isr.ARR))
        assert (prescaler + 1) * (period + 1) == ticks, rates


def case_times_across_the_wrap():
    """Differences of times that straddle 2**32, and both halves of the range."""
    timer = words(18)
    times = words(1)
    for now in (0, 5, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0xFFFFF000):
        timer[isr.CNT] = now
        assert isr.counter_kiticks(timer) == now >> 10
        for gap_kiticks in (0, 1, 16, 1000, (1 << 21) - 1, -1, -16, -(1 << 20)):
            times[0] = (now + 1024 * gap_kiticks) & 0xFFFFFFFF
            assert isr.kiticks_until(timer, times, 0) == gap_kiticks, (now, gap_kiticks)


def case_due_or_not():
    """Turns and samples at, before and after the present, around the wrap; the soonest is armed."""
    for now in (0, 1000, 0x7FFFFFF0, 0xFFFFFFF0):
        block, timer, port, state = words(BLOCK), words(18), words(8), words(isr.STATE_WORDS)
        block[isr.JOINTS] = 2
        block[isr.REVERSAL_SLACK_TICKS] = 100
        timer[isr.CNT] = now
        for joint in range(2):
            block[isr.BLOCK_HEAD + joint * isr.JOINT_WORDS + isr.DIR_BIT] = 1 << (7 + joint)
        second = isr.BLOCK_HEAD + isr.JOINT_WORDS
        block[isr.NEXT_SAMPLE] = (now + 900) & 0xFFFFFFFF
        state[isr.LAST_TIME] = (now - 50) & 0xFFFFFFFF
        assert isr.add_reversal(block, state, isr.BLOCK_HEAD, 50)
        assert isr.add_reversal(block, state, second, 51)
        assert isr.add_reversal(block, state, second, 400)
        assert isr.serve_compare(block, timer, port) == 0
        assert port[isr.BSRR] == 1 << 7
        port[isr.ODR] = 1 << 7
        assert timer[isr.CCR4] == (now + 1) & 0xFFFFFFFF
        timer[isr.CNT] = (now + 20) & 0xFFFFFFFF
        assert isr.serve_compare(block, timer, port) == 0
        assert port[isr.BSRR] == 1 << 8
        port[isr.ODR] = 3 << 7
        assert timer[isr.CCR4] == (now + 350) & 0xFFFFFFFF
        assert block[isr.REVERSAL_LATE] == 0
        timer[isr.CNT] = (now + 460) & 0xFFFFFFFF
        assert isr.serve_compare(block, timer, port) == 0
        assert port[isr.BSRR] == 1 << (8 + 16)
        assert block[isr.REVERSAL_LATE] == 1
        timer[isr.CNT] = (now + 900) & 0xFFFFFFFF
        assert isr.serve_compare(block, timer, port) == 1


def case_turn_queue():
    """Eight turns fit; the ninth waits."""
    block, state = words(BLOCK), words(isr.STATE_WORDS)
    for n in range(isr.MOST_REVERSALS):
        state[isr.LAST_TIME] = 1000 * n
        assert isr.add_reversal(block, state, isr.BLOCK_HEAD, 5)
    assert not isr.add_reversal(block, state, isr.BLOCK_HEAD, 5)
    block[isr.BLOCK_HEAD + isr.REVERSALS_OUT] = 1
    assert isr.add_reversal(block, state, isr.BLOCK_HEAD, 5)


def case_sample_times():
    """From 0 in steps of a tenth of a second to the end; raw samples that find no space are counted."""
    block, raw, dma, encoder = words(BLOCK), words(isr.RAW_SPACE * isr.RAW_WORDS), words(60), words(18)
    timer = words(18)
    at = isr.BLOCK_HEAD + isr.RING
    block[at + isr.MASK] = 63
    block[at + isr.NDTR_AT_START] = 64
    block[at + isr.NDTR_AT] = 35
    block[at + isr.MATCHED] = 60
    block[isr.JOINTS] = 1
    block[isr.ENCODERS] = 1
    block[isr.SAMPLES_LEFT] = 3
    block[isr.LAST_SAMPLE] = 20_000_000
    dma[35] = 51
    encoder[isr.CNT] = 65535
    times = []
    for n in range(4):
        times.append(block[isr.NEXT_SAMPLE])
        assert not block[isr.SAMPLES_DONE]
        timer[isr.CNT] = 1000 + n  # as it is read, not when the interrupt came
        isr.take_sample(raw, block, dma, (uctypes.addressof(encoder),), timer)
    assert times == [0, 8_400_000, 16_800_000, 20_000_000]
    assert block[isr.SAMPLES_DONE]
    assert list(raw[11:13]) == [1001, 77] and raw[18] == 65535
    for _ in range(20):
        isr.take_sample(raw, block, dma, (uctypes.addressof(encoder),), timer)
    assert (block[isr.RAW_IN], block[isr.RAW_LOST]) == (isr.RAW_SPACE, 24 - isr.RAW_SPACE)
    assert raw[0] == 1000


def case_late_first_step():
    """A channel is armed only while its first edge lies ahead, and after a DIR turn and its set-up."""
    block, timer, ring = words(BLOCK), words(18), words(1)
    at = isr.BLOCK_HEAD
    block[at + isr.CCR_AT] = isr.CCR1 + 1
    block[at + isr.CCMR_AT] = isr.CCMR1
    block[at + isr.MODE_SHIFT] = 12
    block[isr.DIR_SETUP_TICKS] = 420
    timer[isr.CNT] = 0xFFFFFFF0
    for first, turn, late in (
        (200, None, 0),
        (0xFFFFFFF0 + 84, None, 0),
        (0xFFFFFFF0 + 83, None, 1),
        (0xFFFFFF00, None, 1),
        (1000, 580, 0),
        (1000, 581, 1),
        (1000, 0xFFFFFFFF, 0),
    ):
        block[at + isr.REVERSALS_IN] = block[at + isr.REVERSALS_OUT] = 0
        if turn is not None:
            block[at + isr.REVERSAL_TIMES] = turn
            block[at + isr.REVERSALS_IN] = 1
        ring[0] = first & 0xFFFFFFFF
        timer[isr.CCMR1] = 4 << 4 | 4 << 12
        timer[isr.DIER] = 1 << 4
        assert isr.arm_channel(block, timer, ring, at) == late, (first, turn)
        if not late:
            assert timer[isr.CCR1 + 1] == ring[0]
            assert timer[isr.CCMR1] == 4 << 4 | 3 << 12
            assert timer[isr.DIER] == 1 << 4 | 1 << 10
    isr.release_channel(block, timer, at)
    assert timer[isr.CCMR1] == 4 << 4 | 4 << 12
    assert timer[isr.DIER] == 1 << 4


def case_counters_in_step():
    """Two counters that were read one after the other agree, or do not."""
    first, second = words(18), words(18)
    for a, b, agree in (
        (5, 5, 1),
        (5, 0xFFFFFFFF, 1),
        (0xFFFFFFF8, 3, 1),
        (1000, 1016, 1),
        (1000, 1017, 0),
        (1000, 900, 0),
    ):
        first[isr.CNT], second[isr.CNT] = a, b
        assert isr.counters_agree(first, second) == agree, (a, b)


PORT_A, TIM5, PORT_B, PORT_E = 1024, 768, 1280, 2048  # words after TIM2


def of(line):
    """The words of a line in the block."""
    return isr.FIRST_LINE + isr.LINE_WORDS * (line - isr.SOFTWARE_LINE)


def frozen(line, levels, high_a=0, high_b=0, runs=1, before=0):
    """The block and the registers after a freeze that a line calls for, with the levels of DIR and the STEP pins."""
    block, registers = words(isr.BLOCK_WORDS), words(PORT_E + 8)
    address = uctypes.addressof(registers)
    block[isr.TIM2_AT], block[isr.TIM2_AT + 1] = address & 0x3FFFFFFF, address >> 30
    block[isr.PORT_A_OFFSET] = 4 * PORT_A
    for of_line, low, mask, release in (
        (7, isr.ALWAYS, isr.ALWAYS, 0),
        (8, 1 << 10, 1 << 7 | 1 << 10, 0),
        (9, isr.ALWAYS, isr.ALWAYS | 1 << 7, 0),
        (15, isr.ALWAYS, isr.ALWAYS, 1 << 28),
    ):
        at = of(of_line)
        block[at + isr.LINE_LEVELS], block[at + isr.LINE_MASK], block[at + isr.LINE_RELEASE] = (
            low,
            mask,
            release,
        )
    block[isr.FROZEN] = before
    registers[isr.CR1] = registers[TIM5 + isr.CR1] = runs
    registers[isr.DIER] = registers[TIM5 + isr.DIER] = 0xFF
    registers[PORT_A + isr.IDR], registers[PORT_B + isr.IDR] = high_a, high_b
    registers[PORT_E + isr.ODR] = levels
    isr.freezer(block)(line)
    return block, registers


def case_towards_a_switch():
    """A limit switch freezes if a joint moves towards it, at one of its levels of DIR; E-stop and program always."""
    for line, levels, freezes in (
        (8, 1 << 7 | 1 << 10, 1),
        (8, 1 << 10, 0),
        (8, 0, 1),
        (9, 0, 1),
        (9, 1 << 7, 1),
        (10, 0xFFFF, 0),
        (7, 0xFFFF, 1),
        (15, 0, 1),
    ):
        block, registers = frozen(line, levels)
        assert (block[isr.FROZEN] != 0) == freezes, (line, levels)
        assert registers[isr.DIER] == registers[TIM5 + isr.DIER] == (0 if freezes else 0xFF)
        tripped = [other for other in range(7, 16) if block[of(other) + isr.LINE_TRIPPED]]
        assert tripped == [line] * freezes
        assert registers[PORT_E + isr.BSRR] == (1 << 28 if line == 15 else 0)


def case_modes_of_a_freeze():
    """STEP pins that are low are held low, those that are high keep their falling edge; other pins do not matter."""
    both = 4 << 4 | 4 << 12
    for pin, place, mode in (
        ("A15", isr.CCMR1, 3 << 4 | 4 << 12),
        ("A1", isr.CCMR1, 4 << 4 | 3 << 12),
        ("B10", isr.CCMR1 + 1, 3 << 4),
        ("A2", TIM5 + isr.CCMR1 + 1, 3 << 4 | 4 << 12),
        ("A3", TIM5 + isr.CCMR1 + 1, 4 << 4 | 3 << 12),
        ("A0", TIM5 + isr.CCMR1, 3 << 4 | 4 << 12),
        ("A14", isr.CCMR1, both),
        ("B9", isr.CCMR1, both),
    ):
        bit = 1 << pins.line(pin)
        for others in (0, 0x7FF0):
            high_a, high_b = others, others & ~0x400
            if pin[0] == "A":
                high_a |= bit
            else:
                high_b |= bit
            block, registers = frozen(15, 0, high_a, high_b)
            modes = {isr.CCMR1: both, isr.CCMR1 + 1: 64, TIM5 + isr.CCMR1: both, TIM5 + isr.CCMR1 + 1: both}
            modes[place] = mode
            assert {at: registers[at] for at in modes} == modes, (pin, others)
            assert (block[isr.HIGH_A], block[isr.HIGH_B]) == (high_a, high_b)


def case_freezing_again():
    """What is frozen is left as it is, but an E-stop still releases the drivers; counters that stood stand."""
    block, registers = frozen(15, 0, high_a=2, before=1)
    assert block[isr.FROZEN] == 1
    assert registers[isr.DIER] == 0xFF
    assert registers[PORT_E + isr.BSRR] == 1 << 28
    assert block[of(15) + isr.LINE_TRIPPED]
    for runs in (0, 1):
        assert frozen(15, 0, runs=runs)[1][isr.CR1] == runs


def case_interrupts_wait_while_a_channel_is_armed_or_released():
    """Registers that an interrupt writes too are read, changed and written back."""
    from armtempo_board.hardware import ring
    from machine import disable_irq, enable_irq

    enabled = []

    def watched(function):
        def call(*arguments):
            before = disable_irq()
            enabled.append(bool(before))
            result = function(*arguments)
            enable_irq(before)
            return result

        return call

    class Watched:
        def __getattr__(self, name):
            found = getattr(isr, name)
            return watched(found) if name in ("arm_channel", "release_channel") else found

    rig = Rig(arm(1))
    each = rig.engine.drives[0].ring
    ring.isr = Watched()
    try:
        each.run()
        each.release()
    finally:
        ring.isr = isr
    assert enabled == [False, False], enabled
    assert disable_irq(), "interrupts stay off"
    enable_irq(True)


def case_a_stream_is_off_while_it_is_set_up():
    """Else it takes nothing of it (RM0090 10.5.5): CR, PAR, M0AR, FCR, and CR again, which does not start it yet."""
    rows = registers.stream_rows(5, 3, 0x34, 0x20000000)
    assert [4 * row[1] - (0x10 + 0x18 * 5) for row in rows] == [0x00, 0x08, 0x0C, 0x14, 0x00]
    assert [row[3] for row in rows[:-1]] == [0, 0x34, 0x20000000, 0]
    assert rows[-1][3] >> 25 == 3
    assert not rows[-1][3] & 1


cases.run(globals())
