"""The simulated hardware, case by case; each asserts by itself and prints its name.

Argument: a scratch folder.
"""

import sys

import bare_board
import cases
import injected_faults  # replaces time, os, uctypes, micropython; so before everything else
import machine_state
import pace
import power_cycles
from chip import memory, timers
from chip.flash import real_open
from chip.processor import TICKS_PER_US
from firmware import repl, usb_serial
from firmware.external_interrupts import set_level
from machine_state import Reset

# isort: split
import io
import os
import struct
import time
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

    def fail(timer):
        calls.append(1)
        raise ValueError("on purpose")

    pyb.Timer(6, freq=1000, callback=fail)
    board.spend(5 * 84_000)
    assert len(calls) == 1


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


def case_usb_buffers():
    bare_board.start()
    port, line = pyb.USB_VCP(), machine_state.serial
    line.received.extend(b"hello")
    assert port.any() and port.recv(3, timeout=0) == b"hel"
    buffer = bytearray(8)
    assert port.readinto(buffer, 1) == 1 and buffer[:2] == b"l\0"
    assert port.readinto(buffer) == 1 and buffer[:2] == b"o\0"
    assert port.read(5) is None and port.recv(2, timeout=3) == b""
    assert port.send(b"abc") == 3 and bytes(line.sending) == b"abc"
    port.init(flow=pyb.USB_VCP.RTS | pyb.USB_VCP.CTS)
    assert port.write(bytes(2000)) == 1021
    assert port.write(b"x") is None
    assert line.rts and line.cts
    port.init(flow=0)
    assert not line.rts and not line.cts


def case_a_program_that_receives_waits_for_what_comes():
    board = bare_board.start()
    line = machine_state.serial
    board.at(board.now + 20 * 84_000, lambda: line.received.extend(b"late"))
    assert pyb.USB_VCP().recv(4, timeout=1000) == b"late"


def case_a_program_that_sends_waits_for_room():
    board = bare_board.start()
    line = machine_state.serial
    port = pyb.USB_VCP()
    port.init(flow=pyb.USB_VCP.RTS | pyb.USB_VCP.CTS)

    def take():
        line.sending = bytearray()

    board.at(board.now + 20 * 84_000, take)
    assert port.send(bytes(1500), timeout=1000) == 1500


class Written(usb_serial.Serial):
    """The line to a host that has written this already."""

    def __init__(self, data):
        usb_serial.SilentPort.__init__(self)
        self._in = io.BytesIO(data)
        self._chunk = memoryview(bytearray(64))


def case_what_the_program_does_not_read_is_lost_unless_the_host_is_held_back():
    for is_held_back in (0, 1):
        bare_board.start()
        line = Written(bytes(3000))
        line.rts = bool(is_held_back)
        line.pump()
        taken = line._in.tell()
        if is_held_back:
            assert 1023 - 65 < taken == len(line.received) < 1024
        else:
            assert taken == 3000 and len(line.received) == 1023


def case_a_silenced_board_speaks_again():
    board = bare_board.start()
    injected_faults._silence(board, {"ms": 2})
    assert machine_state.serial.silent
    board.spend(3 * 84_000)
    assert not machine_state.serial.silent


def case_watchdog_bites():
    pace.Pace._elapsed_us = lambda self: 0  # no real time comes in
    board = bare_board.start()
    watchdog = machine.WDT(timeout=100)
    assert mem32[0x40003008] == 100 // 8  # IWDG_RLR, in units of 8 ms
    for _ in range(5):
        board.spend(90 * 84_000)
        watchdog.feed()
    try:
        board.spend(101 * 84_000)
        raise AssertionError("no bite")
    except Reset as reset:
        assert reset.cause == machine.WDT_RESET
    bare_board.start(cause=machine.WDT_RESET)
    assert machine.reset_cause() == machine.WDT_RESET


def case_a_timer_that_was_given_up_calls_nobody():
    board = bare_board.start()
    called = []
    timer = pyb.Timer(4, freq=1000)
    timer.channel(1, pyb.Timer.OC_TIMING, callback=called.append)
    timer.deinit()
    timer.init(freq=1000)
    board.spend(5 * 84_000)
    assert called == []


def case_a_soft_reset_starts_python_again():
    bare_board.start()
    try:
        machine.soft_reset()
        raise AssertionError("it went on")
    except Reset as reset:
        assert reset.cause == machine.SOFT_RESET


def case_after_a_soft_reset_the_prompt_has_the_port_again():
    bare_board.start()
    os.dupterm(None, 1)
    assert not machine_state.serial.attached
    power_cycles._soft_reset()
    assert machine_state.serial.attached


def case_ctrl_c_interrupts_only_what_the_prompt_runs():
    """As micropython.kbd_intr(3) and, at the prompt, kbd_intr(-1)."""
    bare_board.start()
    line = machine_state.serial
    assert line.interrupt_char == -1
    seen = []
    repl.Repl()._run(lambda: seen.append(line.interrupt_char))
    assert (seen, line.interrupt_char) == ([3], -1)


class Terminal(usb_serial.SilentPort):
    """A host that has typed all it will, and keeps what the board says."""

    def __init__(self):
        self.shown = b""
        super().__init__()

    def put(self, data):
        self.shown += bytes(data)
        assert len(self.shown) < 2000, "the prompt continues without end"
        return len(data)


def case_the_prompt_echoes_and_answers():
    terminal = Terminal()
    bare_board.start(line=terminal)
    terminal.received.extend(b"6 * 7\r\x04")
    repl.Repl().run()
    assert terminal.shown.endswith(
        b">>> 6 * 7\r\n42\r\n>>> \r\nMPY: sync filesystems\r\nMPY: soft reboot\r\n"
    ), terminal.shown


def case_the_backup_sram_has_4_kb():
    bare_board.start()
    mem32[stm.RCC + stm.RCC_AHB1ENR] |= 1 << 18
    assert mem32[0x40024000 + 4092]
    try:
        assert mem32[0x40024000 + 4096] is None
    except ValueError:
        return
    raise AssertionError("there is more")


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


def case_each_timer_is_clocked_by_its_bit():
    """RM0090 6.3.13 and 6.3.14."""
    bare_board.start()
    for enable, first_bit, numbers in (
        (stm.RCC_APB1ENR, 0, (2, 3, 4, 5, 6, 7, 12, 13, 14)),
        (stm.RCC_APB2ENR, 0, (1, 8)),
        (stm.RCC_APB2ENR, 16, (9, 10, 11)),
    ):
        for place, number in enumerate(numbers):
            before = mem32[stm.RCC + enable]
            pyb.Timer(number, prescaler=0, period=0xFFFF)
            assert mem32[stm.RCC + enable] ^ before == 1 << first_bit + place, number


def case_peripherals_of_a_bus_are_1_kb_apart():
    """RM0090 table 1."""
    for first, names in (
        (0x40000000, "TIM2 TIM3 TIM4 TIM5 TIM6 TIM7 TIM12 TIM13 TIM14"),
        (0x40010000, "TIM1 TIM8"),
        (0x40013800, "SYSCFG EXTI"),
        (0x40014000, "TIM9 TIM10 TIM11"),
        (0x40020000, "GPIOA GPIOB GPIOC GPIOD GPIOE"),
        (0x40023800, "RCC FLASH"),
        (0x40026000, "DMA1 DMA2"),
    ):
        for number, name in enumerate(names.split()):
            assert memory.word_at(first + 0x400 * number) == memory.index(name), name


def case_kinds_of_memory_have_micropythons_numbers():
    """extmod/moductypes.c, of version 1.28: also if CPython has a stand-in."""
    assert (uctypes.ARRAY, uctypes.INT32) == (-1 << 30, 5 << 27)


def case_registers_by_the_chips_addresses():
    bare_board.start()
    mem32[0x40000000 + 0x2C] = -1
    assert mem32[stm.TIM2 + stm.TIM_ARR] == -1
    assert machine.mem8[stm.TIM2 + stm.TIM_ARR] == machine.mem8[stm.TIM2 + stm.TIM_ARR + 3] == 0xFF
    assert machine.mem16[stm.TIM2 + stm.TIM_ARR] == 0xFFFF
    machine.mem8[stm.TIM2 + stm.TIM_CCR1 + 1] = 0xAB
    machine.mem16[stm.TIM2 + stm.TIM_CCR1 + 2] = 0x1234
    assert mem32[stm.TIM2 + stm.TIM_CCR1] == 0x1234AB00
    assert machine.freq() == (168_000_000, 168_000_000, 42_000_000, 84_000_000)
    try:
        mem32[0x50000000] = 1
        raise AssertionError("no such register")
    except ValueError:
        pass


def case_backup_sram_needs_its_clock_and_write_access():
    """RM0090 5.1.2: a clock for the power interface, DBP, a clock of its own."""
    rcc, power, memory = stm.RCC, stm.PWR, stm.BKPSRAM
    last = memory + 4092
    mem32[last] = 5
    assert mem32[last] == 0, "without a clock it reads as 0"
    mem32[rcc + stm.RCC_AHB1ENR] |= 1 << 18
    before = mem32[last]
    mem32[last] = before ^ 5
    assert before and mem32[last] == before, "without write access it keeps what it had"
    mem32[power + stm.PWR_CR] |= 1 << 8
    mem32[last] = before ^ 5
    assert mem32[last] == before, "without a clock the power interface takes nothing"
    mem32[rcc + stm.RCC_APB1ENR] |= 1 << 28
    mem32[power + stm.PWR_CR] |= 1 << 8
    mem32[last] = -5
    put(memory, 0, 7)
    assert mem32[last] == mem32[0x40024000 + 4092] == -5 and mem32[memory] == 7
    mem32[rcc + stm.RCC_AHB1ENR] &= ~(1 << 18)
    assert mem32[last] == 0
    mem32[rcc + stm.RCC_AHB1ENR] |= 1 << 18
    assert mem32[last] == -5 and mem32[memory] == 7, "its content waits for the clock"
    mem32[power + stm.PWR_CR] &= ~(1 << 8)
    put(memory, 0, 8)
    time.sleep_us(1)
    assert mem32[memory] == 7
    words = uctypes.struct(last, (uctypes.ARRAY, 1 | uctypes.INT32))
    assert words[0] == -5 and uctypes.addressof(words) == last


for name in cases.wanted(globals()):
    bare_board.start(flash=SCRATCH + "/flash")
    globals()[name]()
    print(name)
