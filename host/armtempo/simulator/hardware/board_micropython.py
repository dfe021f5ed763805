"""The board program's ``micropython``: the interpreter's own, and what the unix port lacks."""

import micropython as _own
from micropython import *  # noqa: F403
from simulator import the

const = _own.const


def alloc_emergency_exception_buf(size):
    """The unix port has such a buffer without asking."""


def kbd_intr(char):
    """Which byte interrupts the program; -1 none."""
    the.serial.interrupt_char = char


def schedule(function, argument):
    """Call soon, outside interrupts."""
    the.board.schedule(function, argument)
