"""The speed of virtual time, and the calls that wait.

While a timer has an event soon, virtual time runs as fast as this process can, or, with ``speed``, at that
multiple of real time. It runs in real time

- while nothing moves (the process sleeps until input comes);
- if the arm stops when the host is silent, and for a while after two messages in quick succession, as from a host
  that holds a motion: both depend on the host's real time;
- while the host does not read, so that a busy host loses no more than with a real board.
"""

import time

import machine_state
from chip.flash import real_open
from chip.processor import TICKS_PER_MS, TICKS_PER_US
from machine_state import PowerOff

_HORIZON_TICKS = 500 * TICKS_PER_MS
_NAP_MS = 5
_LAG_US = 20_000  # a longer delay is not caught up
_QUICK_US = 150_000
_TALK_US = 1_000_000
_NEVER_US = 1 << 28


class Pace:
    """Runs the board's virtual time against real time."""

    def __init__(self, board, serial, speed):
        self._board = board
        self._serial = serial
        self._speed = speed
        self._ticks_us = time.ticks_us
        self._ticks_diff = time.ticks_diff
        self._last_us = self._looked_us = self._ticks_us()
        self._lead_us = 0
        self._last_tick = 0
        self._free = False
        self._pieces = 0
        self._quiet_us = self._since_talk_us = _NEVER_US
        board.millisecond = self._first_millisecond

    def idle(self):
        """Wait until the next interrupt or millisecond; in real time if nothing moves."""
        board = self._board
        board.run_until(board.next_ms, wake=True)

    def _first_millisecond(self):
        """The program has started: make the file that the launcher waits for."""
        self._board.millisecond = self._millisecond
        if machine_state.options["up"]:
            real_open(machine_state.options["up"], "w").close()
        self._millisecond()

    def _millisecond(self):
        self._serial.pump()
        if self._serial.ended:
            raise PowerOff
        if self._board.interrupted:
            self._board.interrupted = False
            raise KeyboardInterrupt
        if not self._board.moving(_HORIZON_TICKS):
            self._nap()
        elif (
            self._speed
            or (machine_state.arm and machine_state.arm.watches_host)
            or self._host_talks()
            or self._serial.stuck()
        ):
            self._keep_pace(self._speed or 1)
        else:
            self._free = True

    def _host_talks(self):
        """Whether two messages came in quick succession during the motion, not long ago."""
        now = self._ticks_us()
        passed = self._ticks_diff(now, self._looked_us)
        self._looked_us = now
        self._since_talk_us = min(self._since_talk_us + passed, _NEVER_US)
        self._quiet_us = min(self._quiet_us + passed, _NEVER_US)
        if self._serial.pieces != self._pieces:
            self._pieces = self._serial.pieces
            if self._quiet_us < _QUICK_US:
                self._since_talk_us = 0
            self._quiet_us = 0
        return self._since_talk_us < _TALK_US

    def _elapsed_us(self):
        now = self._ticks_us()
        elapsed = self._ticks_diff(now, self._last_us)
        self._last_us = now
        return elapsed

    def _nap(self):
        """Nothing moves: sleep until input comes, and let the same virtual time pass."""
        if not self._serial.received and not self._serial.stuck():
            self._serial.wait(_NAP_MS)
            self._serial.pump()
        slept_ms = min(self._elapsed_us() // 1000, 10 * _NAP_MS)
        if machine_state.edges:
            machine_state.edges.flush()
        board = self._board
        if slept_ms > 1:
            board.next_ms = board.now + 10 * _NAP_MS * TICKS_PER_MS
            board.run_until(board.now + (slept_ms - 1) * TICKS_PER_MS)
            board.next_ms = (board.now // TICKS_PER_MS + 1) * TICKS_PER_MS
        self._lead_us = 0
        self._last_tick = board.now
        self._pieces = self._serial.pieces
        self._quiet_us = self._since_talk_us = _NEVER_US
        self._looked_us = self._last_us

    def _keep_pace(self, speed):
        """Moving in real time: sleep while virtual time is ahead."""
        if self._free:  # do not wait for virtual time that ran freely
            self._free = False
            self._elapsed_us()
            self._last_tick = self._board.now
            self._lead_us = 0
        passed_us = (self._board.now - self._last_tick) // TICKS_PER_US
        self._last_tick = self._board.now
        self._lead_us = max(self._lead_us + passed_us / speed - self._elapsed_us(), -_LAG_US)
        if self._lead_us > 1000:
            self._serial.wait(int(self._lead_us) // 1000)

    def stall(self, ms):
        """The processor stands still: in real time, so does this process."""
        if self._speed:
            time.sleep(ms / 1000 / self._speed)

    def sleep_us(self, us):
        """The program waits."""
        target = self._board.now + us * TICKS_PER_US
        while self._board.now < target:
            self._board.run_until(min(target, self._board.next_ms))

    def milliseconds(self):
        """Milliseconds since power-up, modulo 2**30; raises an injected crash."""
        if self._board.crash:
            self._board.crash = False
            raise RuntimeError("injected crash")
        self._board.call()
        return self._board.now // TICKS_PER_MS & 0x3FFFFFFF

    def microseconds(self):
        """Microseconds since power-up, modulo 2**30."""
        self._board.call()
        return self._board.now // TICKS_PER_US & 0x3FFFFFFF
