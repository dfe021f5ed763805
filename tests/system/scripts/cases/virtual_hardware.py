"""The simulated timers, DMA, pins and interrupts, case by case; each asserts by itself and prints its name.

Argument: a scratch folder.
"""

import sys

import bare_board  # replaces time, os, uctypes, micropython; so before everything else
import cases
import machine_state
from chip import timers
from chip.flash import real_open
from chip.processor import TICKS_PER_US
from firmware.external_interrupts import set_level

# isort: split
import struct
from array import array

import machine
import micropython
import pyb
import stm
import uctypes
from machine import mem32

SCRATCH = sys.argv[1]
LEAD = 8400
RING = 64
STREAM_MODE = 2 << 13 | 2 << 11 | 1 << 10 | 1 << 8 | 1 << 6


@micropython.viper
def put(block: ptr32, word: int, value: int):
    """Write a register as board code does."""
    block[word] = value


def edges(path):
    """{pin: [ticks]} of an edge log, and the tick of TIM2's last start."""
    machine_state.edges.flush()
    with real_open(path, "rb") as file:
        data = file.read()
    at, found, start = 4, {}, None
    while at < len(data):
        kind, pin, before, _, count, base = struct.unpack_from("<BBBBIq", data, at)
        at += 16
        if kind == 2 and pin == 2 and before:
            start = base
        if kind in (1, 3):
            for _ in range(count):
                found.setdefault(pin, []).append(base + struct.unpack_from("<I", data, at)[0])
                at += 4
    return found, start


def counters():
    """TIM2 and TIM5 set up to count all 32 bits, from a little before 0, TIM5 waiting for TIM2."""
    timers = []
    for number in (2, 5):
        timer = pyb.Timer(number, prescaler=0, period=0x3FFFFFFF)
        timers.append(timer)
    channels = (
        timers[0].channel(1, pyb.Timer.OC_TOGGLE, pin=pyb.Pin("A15")),
        timers[1].channel(3, pyb.Timer.OC_TOGGLE, pin=pyb.Pin("A2")),
    )
    for timer, base in zip(timers, (stm.TIM2, stm.TIM5)):
        mem32[base + stm.TIM_CR1] = 0x80
        timer.period(-1)
        mem32[base + stm.TIM_EGR] = 1
        timer.counter(-LEAD)
    mem32[stm.TIM5 + stm.TIM_SMCR] = 6
    mem32[stm.TIM2 + stm.TIM_CR2] = 1 << 4
    mem32[stm.RCC + stm.RCC_AHB1ENR] |= 1 << 21
    return channels


def feed(number, selection, compare, ring):
    """A DMA1 stream from a ring to a compare register."""
    stream = stm.DMA1 + 0x10 + 0x18 * number
    mem32[stream + 4] = len(ring)
    mem32[stream + 8] = compare
    mem32[stream + 12] = uctypes.addressof(ring)
    mem32[stream] = selection << 25 | STREAM_MODE | 1


def left(number):
    """NDTR of a stream."""
    return mem32[stm.DMA1 + 0x10 + 0x18 * number + 4]


def times(count):
    """Edge times with uneven gaps."""
    now, made = 0, []
    for index in range(count):
        now += 100 + index * 37 % 91
        made.append(now)
    return made


def case_dma_feeds_two_timers_exactly():
    log = SCRATCH + "/dma"
    board = bare_board.start(edge_log=log)
    wanted = times(1000)
    ring = array("I", wanted[1 : 1 + RING])
    counters()
    feed(5, 3, stm.TIM2 + stm.TIM_CCR1, ring)
    feed(0, 6, stm.TIM5 + stm.TIM_CCR3, ring)
    put(stm.TIM2, 13, wanted[0])
    put(stm.TIM5, 15, wanted[0])
    mem32[stm.TIM2 + stm.TIM_DIER] = 1 << 9
    mem32[stm.TIM5 + stm.TIM_DIER] = 1 << 11
    mem32[stm.TIM2 + stm.TIM_CR1] |= 1
    assert mem32[stm.TIM5 + stm.TIM_CR1] & 1
    made = 1 + RING
    while mem32[stm.TIM2 + stm.TIM_CNT] < wanted[-1]:
        board.spend(1500)
        assert mem32[stm.TIM2 + stm.TIM_CNT] == mem32[stm.TIM5 + stm.TIM_CNT]
        while made < len(wanted) and (RING - left(5) - (made - 1)) % RING > 4:
            ring[(made - 1) % RING] = wanted[made]
            made += 1
    found, start = edges(log)
    for pin in (15, 2):
        assert [tick - start - LEAD for tick in found[pin][:1000]] == wanted, pin


def case_each_stream_hears_its_channels():
    """RM0090 table 42, request channels 3 and 6: the streams for a timer's channels 1 to 4."""
    board = bare_board.start()
    for selection, timer, wanted in (
        (3, 2, [[5], [6], [1], [6, 7]]),
        (6, 5, [[2], [4], [0], [1, 3]]),
    ):
        for stream in board.dma.streams:
            mem32[stm.DMA1 + 0x10 + 0x18 * stream.number] = selection << 25
        for channel, streams in enumerate(wanted, 1):
            hearing = [each.number for each in board.dma.streams if (timer, channel) in each.requests()]
            assert hearing == streams, (timer, channel)


def match_count(preload, late):
    """Matches of three when the third entry is written after the first match (``late``) or before."""
    board = bare_board.start(edge_log=SCRATCH + "/preload", dma_preload=preload)
    ring = array("I", [2000, 0, 0, 0])
    counters()
    feed(5, 3, stm.TIM2 + stm.TIM_CCR1, ring)
    put(stm.TIM2, 13, 1000)
    mem32[stm.TIM2 + stm.TIM_DIER] = 1 << 9
    mem32[stm.TIM2 + stm.TIM_CR1] |= 1
    if not late:
        ring[1] = 3000
    board.spend(0)  # what the calls before owe
    board.spend(1500 - machine_state.board.timers[2].count(board.timers[2].total) + (1 << 32))
    ring[1] = 3000
    board.spend(3000)
    return len(edges(SCRATCH + "/preload")[0][15])


def case_dma_fetches_one_word_ahead():
    assert match_count(preload=True, late=False) == 3
    assert match_count(preload=True, late=True) == 2
    assert match_count(preload=False, late=True) == 3


def case_stale_ring_entries_do_not_match():
    board = bare_board.start(edge_log=SCRATCH + "/stale")
    counters()
    feed(5, 3, stm.TIM2 + stm.TIM_CCR1, array("I", [500, 400, 300, 200]))
    put(stm.TIM2, 13, 100)
    mem32[stm.TIM2 + stm.TIM_DIER] = 1 << 9
    mem32[stm.TIM2 + stm.TIM_CR1] |= 1
    board.spend(84_000)
    assert len(edges(SCRATCH + "/stale")[0][15]) == 2


def case_an_entry_that_the_stream_brings_too_late_does_not_match():
    """It takes a few ticks from the match to the next compare value."""
    for gap, matches in ((6, 1), (7, 3)):
        board = bare_board.start(edge_log=SCRATCH + "/late")
        counters()
        feed(5, 3, stm.TIM2 + stm.TIM_CCR1, array("I", [100 + gap, 5000, 0, 0]))
        put(stm.TIM2, 13, 100)
        mem32[stm.TIM2 + stm.TIM_DIER] = 1 << 9
        mem32[stm.TIM2 + stm.TIM_CR1] |= 1
        board.spend(84_000)
        assert len(edges(SCRATCH + "/late")[0][15]) == matches, gap
        if matches == 1:  # it matches when the counter has come round
            for _ in range(17):
                board.spend(1 << 28)
            first, second, third = edges(SCRATCH + "/late")[0][15]
            assert (second - first, third - second) == ((1 << 32) + gap, 5000 - 100 - gap)


def case_a_channel_that_made_pulses_matches_again():
    """In another mode with the same compare value."""
    board = bare_board.start()
    seen = []
    timer = pyb.Timer(4, prescaler=0, period=999)
    for mode, options in (
        (pyb.Timer.OC_TIMING, {"compare": 250}),
        (pyb.Timer.PWM, {"pulse_width": 250}),
        (pyb.Timer.OC_TIMING, {"compare": 250, "callback": seen.append}),
    ):
        timer.channel(1, mode, **options)
        board.spend(2000)
    assert len(seen) >= 2, seen


def case_forced_modes_act_at_once():
    bare_board.start()
    counters()
    line = machine_state.board.pins.line("A15")
    mode = stm.TIM2 + stm.TIM_CCMR1
    for setting, level in ((5, 1), (0, 1), (4, 0), (0, 0)):
        mem32[mode] = setting << 4
        assert line.level == level
        assert mem32[stm.GPIOA + stm.GPIO_IDR] >> 15 & 1 == level
    mem32[mode] = 5 << 4
    mem32[stm.TIM2 + stm.TIM_CCER] = 0
    assert line.level == 0


def case_prescaler_period_and_update_callback():
    board = bare_board.start()
    seen = []
    timer = pyb.Timer(7, freq=1000, callback=lambda timer: seen.append(board.now))
    begun = board.now
    board.spend(10 * 84_000 + 42_000)
    assert len(seen) == 10, seen
    for number, tick in enumerate(seen):
        assert 0 < tick - begun - (number + 1) * 84_000 + 1700 < 2000, (number, tick - begun)
    timer.deinit()
    board.spend(84_000 * 3)
    assert len(seen) == 10
    slow = pyb.Timer(3, prescaler=83, period=0xFFFF)
    slow.counter(0)
    board.spend(84 * 500)
    assert 499 <= slow.counter() <= 510, slow.counter()


def case_compare_interrupt_comes_soon_and_gets_the_timer():
    board = bare_board.start()
    seen = []
    timer = pyb.Timer(2, prescaler=0, period=0x3FFFFFFF)
    channel = timer.channel(
        4, pyb.Timer.OC_TIMING, compare=50_000, callback=lambda t: seen.append((t, t.counter()))
    )
    timer.counter(0)
    board.spend(60_000)
    assert len(seen) == 1 and seen[0][0] is timer
    assert 50_000 < seen[0][1] < 50_000 + 5 * TICKS_PER_US
    channel.callback(None)


def case_a_match_before_there_was_a_callback_calls_none():
    board = bare_board.start()
    seen = []
    timer = pyb.Timer(2, prescaler=0, period=0x3FFFFFFF)
    channel = timer.channel(4, pyb.Timer.OC_TIMING, compare=50_000)
    timer.counter(0)
    board.spend(60_000)
    channel.callback(seen.append)
    board.spend(60_000)
    assert not seen


def case_an_exception_in_a_callback_switches_it_off():
    board = bare_board.start()
    calls = []

    class Ended(BaseException):
        """As of a user's program."""

    def fail(timer):
        calls.append(timer)
        raise Ended("on purpose")

    pyb.Timer(6, freq=1000, callback=fail)
    board.spend(5 * 84_000)
    assert len(calls) == 1
    board.schedule(fail, 5)
    board.schedule(calls.append, 6)
    board.spend(1)
    assert calls[1:] == [5, 6]


def case_encoder_counter_wraps():
    board = bare_board.start()
    timer = pyb.Timer(3, prescaler=0, period=0xFFFF)
    timer.channel(1, pyb.Timer.ENC_AB, pin=pyb.Pin("B4"))
    assert mem32[stm.TIM3 + stm.TIM_CCMR1] == 0x0101  # both channels are inputs (RM0090 18.4.7)
    timer.counter(0)
    board.timers[3].turn(-3)
    assert timer.counter() == 0xFFFD
    board.timers[3].turn(5)
    assert timer.counter() == 2
    board.spend(100_000)
    assert timer.counter() == 2


def case_pins():
    bare_board.start(edge_log=SCRATCH + "/pins")
    modes = (pyb.Pin.IN, pyb.Pin.OUT_PP, pyb.Pin.OUT_OD, pyb.Pin.AF_PP, pyb.Pin.AF_OD, pyb.Pin.ANALOG)
    assert modes == (0, 1, 0x11, 2, 0x12, 3)  # as on the chip
    assert (pyb.Pin.PULL_NONE, pyb.Pin.PULL_UP, pyb.Pin.PULL_DOWN) == (0, 1, 2)
    assert (pyb.Pin.AF1_TIM2, pyb.Pin.AF2_TIM5, pyb.Pin.AF3_TIM8) == (1, 2, 3)
    pin = pyb.Pin("PE7", pyb.Pin.OUT_PP, value=1)
    assert pin.value() == 1 and mem32[stm.GPIOE + stm.GPIO_ODR] == 1 << 7
    assert mem32[stm.GPIOE + stm.GPIO_IDR] == 1 << 7
    mem32[stm.GPIOE + stm.GPIO_BSRR] = 1 << 8 | 1 << (16 + 7)
    assert pin() == 0 and mem32[stm.GPIOE + stm.GPIO_ODR] == 1 << 8
    assert mem32[stm.GPIOE + stm.GPIO_BSRR] == 0  # reads as 0, and acts once
    pin.high()
    assert mem32[stm.GPIOE + stm.GPIO_ODR] == 1 << 7 | 1 << 8
    pin.low()
    assert mem32[stm.GPIOE + stm.GPIO_ODR] == 1 << 8
    pin.high()
    pyb.Pin("E3", pyb.Pin.AF_PP, alt=2)
    pyb.Pin("E3", pyb.Pin.AF_PP, alt=0)
    assert mem32[stm.GPIOE + stm.GPIO_AFR0] == 0
    pull = pyb.Pin("D8", pyb.Pin.IN, pyb.Pin.PULL_UP)
    assert pull.value() == 1
    set_level("PD8", 0)
    assert pull.value() == 0
    set_level("PD8", None)
    assert pull.value() == 1
    found, _ = edges(SCRATCH + "/pins")
    assert len(found[4 * 16 + 7]) == 5 and len(found[3 * 16 + 8]) == 2


def case_pins_that_the_chip_has_not():
    bare_board.start()
    for name in ("E16", "PZ9", "LED", "", None):
        try:
            pyb.Pin(name)
        except ValueError as error:
            assert str(error) == "Pin(%r) doesn't exist" % (name,)
        else:
            raise AssertionError(name)


class Listener:
    """Notes the pulses that a pin is said to make."""

    def __init__(self):
        self.told = []

    def pulses(self, line, pulses, now):
        self.told.append(pulses)


def case_a_pin_that_is_taken_from_its_timer_makes_no_pulses():
    board = bare_board.start()
    listener = Listener()
    board.pins.line("D12").pulse_sinks.append(listener)
    board.pins.line("D13").pulse_sinks.append(listener)
    timer = pyb.Timer(4, prescaler=0, period=999)
    timer.channel(1, pyb.Timer.PWM, pin=pyb.Pin("D12"), pulse_width=250)
    board.spend(1)
    assert listener.told == [(250, 1000)]
    pyb.Pin("D12", pyb.Pin.OUT_PP)
    board.spend(1)
    assert listener.told == [(250, 1000), (0, 0)]


def case_eight_calls_can_wait():
    """MICROPY_SCHEDULER_DEPTH."""
    board = bare_board.start()
    called = []
    for number in range(8):
        board.schedule(called.append, number)
    try:
        board.schedule(called.append, 8)
        raise AssertionError("one more")
    except RuntimeError:
        pass
    board.spend(1)
    assert called == list(range(8))


def case_step_1_is_low_from_the_first_line_on():
    """A reset pulls PA15 up, as it is one of JTAG's pins; boot.py drives it low before anything else."""
    board = bare_board.start()
    line = board.pins.line("A15")
    assert line.read() == 1
    with open(__file__.rsplit("/tests/", 1)[0] + "/board/armtempo_board/boot.py") as file:
        first = next(text for text in file.read().split("\n") if text.startswith("pyb."))
    exec(first, {"pyb": pyb})
    board.spend(1)
    assert line.mode() == 1 and line.read() == 0


def case_after_a_reset_jtags_pins_are_pulled_up():
    """PA13, PA15 and PB4 (RM0090 8.4.1)."""
    bare_board.start()
    levels = [mem32[port + stm.GPIO_IDR] for port in (stm.GPIOA, stm.GPIOB, stm.GPIOC, stm.GPIOD, stm.GPIOE)]
    assert levels == [1 << 15 | 1 << 13, 1 << 4, 0, 0, 0], levels


def case_external_interrupt_within_20_us():
    board = bare_board.start()
    seen = []
    pin = pyb.Pin("PE15", pyb.Pin.IN, pyb.Pin.PULL_UP)
    pyb.ExtInt(pin, pyb.ExtInt.IRQ_FALLING, pyb.Pin.PULL_UP, lambda line: seen.append((line, board.now)))
    at = board.now + 123_456
    board.at(at, lambda: set_level("PE15", 0))
    board.at(at + 50_000, lambda: set_level("PE15", 1))
    board.spend(400_000)
    assert [line for line, _ in seen] == [15]
    rises = []
    pyb.ExtInt("PE14", pyb.ExtInt.IRQ_RISING, pyb.Pin.PULL_UP, rises.append)
    for level in (0, 1, 0):
        set_level("PE14", level)
        board.spend(50_000)
    assert rises == [14]
    assert 0 <= seen[0][1] - at < 20 * TICKS_PER_US


def case_interrupts_wait_while_off():
    board = bare_board.start()
    seen = []
    pyb.Timer(6, freq=10_000, callback=lambda timer: seen.append(1))
    before = machine.disable_irq()
    board.spend(84_000)
    assert not seen
    machine.enable_irq(before)
    assert len(seen) == 1


def case_a_timer_that_was_given_up_calls_nobody():
    board = bare_board.start()
    called = []
    timer = pyb.Timer(4, freq=1000)
    timer.channel(1, pyb.Timer.OC_TIMING, callback=called.append)
    timer.deinit()
    timer.init(freq=1000)
    board.spend(5 * 84_000)
    assert called == []


def case_timers_of_the_faster_bus_count_twice_as_fast():
    """TIM1 counts 168 million a second, TIM2 half as many (RM0090 figure 21); a prescaler divides that."""
    board = bare_board.start()
    slow, fast = (pyb.Timer(number, prescaler=3, period=0xFFFF) for number in (2, 1))
    before = [timer.counter() for timer in (slow, fast)]
    board.spend(8000)
    counted = [timer.counter() - first for timer, first in zip((slow, fast), before)]
    assert abs(counted[0] - 2000) < 50 and abs(counted[1] - 4000) < 100, counted


def case_a_new_timer_has_nothing_to_do():
    timer = timers.TimerUnit(bare_board.start(), 2, 32)
    assert (timer.next_match(), timer.next_interrupt()) == (timers.NEVER, timers.NEVER)


for name in cases.wanted(globals()):
    bare_board.start(flash=SCRATCH + "/flash")
    globals()[name]()
    print(name)
