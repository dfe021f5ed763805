"""How the simulated board's time passes, in calls and against real time; its serial port, prompt and watchdog.

Each case asserts by itself and prints its name.
"""

import bare_board
import cases
import injected_faults  # replaces time, os, uctypes, micropython; so before everything else
import machine_state
import pace
import power_cycles
from chip.processor import CALL_TICKS, TICKS_PER_MS
from firmware import boot, repl, usb_serial
from machine_state import Reset

# isort: split
import io
import os
import time

import machine
import pyb
from machine import mem32


def case_time_passes_in_calls():
    bare_board.start()
    assert time.localtime()[:6] == (2026, 1, 1, 0, 0, 0)
    before = time.ticks_us()
    time.sleep_us(1500)
    assert 1500 <= time.ticks_diff(time.ticks_us(), before) < 102_000
    before = time.ticks_ms()
    for _ in range(3):
        machine.idle()
    # real time while nothing moves, at most 50 ms at once
    assert 2 <= time.ticks_diff(time.ticks_ms(), before) <= 160
    pace.Pace._elapsed_us = lambda self: 0
    before = time.ticks_us()
    os.sync()
    assert time.ticks_diff(time.ticks_us(), before) > 0


def case_a_host_talks_while_its_input_comes_often():
    """Twice within 150 ms, and not longer than a second ago; then virtual time need not keep to real time."""
    bare_board.start()
    kept, line = machine_state.pace, machine_state.serial
    now = [kept._looked_us]
    kept._ticks_us = lambda: now[0]
    heard = []
    for passed_us, pieces in ((10, 1), (400_000, 1), (100_000, 1), (100_000, 0), (850_000, 0), (100_000, 0)):
        now[0] += passed_us
        line.pieces += pieces
        heard.append(kept._host_talks())
    assert heard == [False, False, True, True, True, False], heard


def case_what_a_host_watches_moves_in_real_time():
    board = bare_board.start()
    kept, speeds = machine_state.pace, []
    kept._host_talks = lambda: True
    kept._keep_pace = speeds.append
    board.moving = lambda horizon: True
    kept._millisecond()
    assert speeds == [1]


def case_the_clock_counts_nanoseconds():
    bare_board.start()
    before = time.time_ns()
    time.sleep_us(2_500)
    assert 2_500_000 <= time.time_ns() - before < 103_000_000
    assert time.time_ns() // 1_000_000_000 == time.time()


def case_an_interrupt_ends_the_wait():
    pace.Pace._elapsed_us = lambda self: 0
    bare_board.start()
    pyb.Timer(6, freq=10_000, callback=lambda timer: None)
    before = time.ticks_us()
    machine.idle()
    assert 0 < time.ticks_diff(time.ticks_us(), before) < 200  # and not until the next millisecond


def case_each_call_of_the_serial_port_takes_its_time():
    """As all calls do; else a program that only looks at the port would stand still in time."""
    board = bare_board.start()
    port = pyb.USB_VCP()
    for call in (port.isconnected, port.any, lambda: port.recv(1, timeout=0), lambda: port.send(b"")):
        before = board.now + board.unspent_ticks
        call()
        assert board.now + board.unspent_ticks - before == CALL_TICKS


class Looked(usb_serial.SilentPort):
    """Counts how often the board has looked for input."""

    looks = 0

    def pump(self):
        self.looks += 1


def case_the_host_is_heard_from_the_first_millisecond_on():
    line = Looked()
    board = bare_board.start(line=line)
    board.spend(TICKS_PER_MS - 1)
    assert line.looks == 0
    board.spend(1)
    assert line.looks > 0


def case_without_a_speed_no_motion_keeps_to_real_time():
    board = bare_board.start()
    kept, speeds = machine_state.pace, []
    kept._keep_pace = speeds.append
    board.moving = lambda horizon: True
    kept._millisecond()
    assert speeds == []


def case_real_time_that_a_free_motion_took_is_not_caught_up():
    """From where it keeps to real time again it waits for all of the time that it is ahead."""
    board = bare_board.start()
    kept, waits = machine_state.pace, []
    now_us = [kept._last_us]
    kept._ticks_us = lambda: now_us[0]
    kept._serial.wait = waits.append
    kept._free = True
    now_us[0] += 15_000
    kept._keep_pace(1)
    board.now += 5 * TICKS_PER_MS
    kept._keep_pace(1)
    assert waits == [5], waits


class Lamp:
    """Notes when a LED changes, in ms of the board's time."""

    def __init__(self, board, pin):
        self.changes_ms = []
        board.pins.line(pin).sinks.append(self)

    def edges(self, line, before, count, times, origin):
        self.changes_ms.extend([(origin + time) // TICKS_PER_MS for time in times])


def case_the_leds_tell_the_mode_with_the_firmwares_times():
    """MicroPython, ports/stm32/boardctrl.c: a mode lasts 30 looks at the button, 20 ms apart; then it flashes."""
    pace.Pace._elapsed_us = lambda self: 0  # no real time comes in
    board = bare_board.start()
    green, orange = Lamp(board, "PD12"), Lamp(board, "PD13")
    assert boot.choose_mode(board, 905) == boot.SAFE
    assert green.changes_ms == [0, 600]
    flashes = [920 + 50 * number for number in range(12)]
    assert orange.changes_ms == [600] + flashes + [920 + 600 + 400], orange.changes_ms


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


def case_a_program_that_sends_waits_for_space():
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


for name in cases.wanted(globals()):
    bare_board.start()
    globals()[name]()
    print(name)
