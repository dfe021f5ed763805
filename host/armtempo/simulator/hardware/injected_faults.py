"""The injected faults of the options: at a time in a motion, or from power-up on."""

import machine_state
from chip.processor import TICKS_PER_MS
from firmware import external_interrupts

_TICK_HZ = 84_000_000
_HALF = 1 << 31


class Faults:
    """Schedules each fault in its motion (TIM2 starts)."""

    def __init__(self, board, faults):
        self._board = board
        self._faults = faults
        self._run = 0
        board.observers.append(self)
        for fault in faults:
            if fault["run"] == 0:
                _KINDS[fault["kind"]](board, fault)

    def counting(self, timer, now):
        """A timer started or stopped."""
        if timer.number != 2 or not timer.running or timer.count(0) < _HALF:
            return  # motions are started shortly before the counter overflows to 0
        self._run += 1
        zero = now + timer.modulus - timer.count(0)
        for fault in self._faults:
            if fault["run"] == self._run:
                self._schedule(zero + int(fault["at_s"] * _TICK_HZ), fault)

    def _schedule(self, tick, fault):
        self._board.at(tick, lambda: _KINDS[fault["kind"]](self._board, fault))

    def input_changed(self, line, level, now):
        """Nothing to do."""


def _stall(board, fault):
    board.lost_ticks += int(fault["ms"] * TICKS_PER_MS)


def _input(board, fault):
    external_interrupts.set_level(fault["name"], fault["level"])


def _block(board, fault):
    machine_state.arm.motors[fault["joint"]].blocked = True


def _slip(board, fault):
    machine_state.arm.motors[fault["joint"]].slip(fault["counts"])


def _silence(board, fault):
    machine_state.serial.silent = True
    board.at(board.now + int(fault["ms"] * TICKS_PER_MS), _speak)


def _speak():
    machine_state.serial.silent = False


def _hang(board, fault):
    board.lost_ticks = 1 << 50


def _crash(board, fault):
    board.crash = True


def _dead_pin(board, fault):
    board.pins.line(fault["name"]).is_dead = True


def _short(board, fault):
    one, other = fault["name"].split("-")
    board.pins.line(one).tied_to = board.pins.line(other)


def _half_clock(board, fault):
    board.timers[2].divider = 2


def _slow_flash(board, fault):
    machine_state.flash.busy_ms = fault["ms"]


def _late_interrupts(board, fault):
    board.late_ticks = int(fault["ms"] * TICKS_PER_MS)


def _dead_stream(board, fault):
    board.dma.streams[fault["joint"]].is_dead = True


_KINDS = {
    "dead_pin": _dead_pin,
    "short": _short,
    "half_clock": _half_clock,
    "slow_flash": _slow_flash,
    "late_interrupts": _late_interrupts,
    "dead_stream": _dead_stream,
    "stall": _stall,
    "input": _input,
    "block": _block,
    "slip": _slip,
    "silence": _silence,
    "hang": _hang,
    "crash": _crash,
}
