"""The board program's ``micropython``: the interpreter's own, and what the Unix port lacks."""

import machine_state
import micropython as _own
from micropython import *  # noqa: F403

const = _own.const


def alloc_emergency_exception_buf(size):
    """Does nothing: the Unix port always has this buffer."""


def kbd_intr(char):
    """Set the byte that interrupts the program; -1: none."""
    machine_state.serial.interrupt_char = char


def schedule(function, argument):
    """Call ``function(argument)`` soon, outside of interrupts."""
    machine_state.board.schedule(function, argument)
