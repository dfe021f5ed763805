"""The board program's ``micropython``: the interpreter's own, and what the unix port lacks."""

import machine_state
import micropython as _own
from micropython import *  # noqa: F403

const = _own.const


def alloc_emergency_exception_buf(size):
    """The unix port has such a buffer without asking."""


def kbd_intr(char):
    """Which byte interrupts the program; -1 none."""
    machine_state.serial.interrupt_char = char


def schedule(function, argument):
    """Call soon, outside interrupts."""
    machine_state.board.schedule(function, argument)
