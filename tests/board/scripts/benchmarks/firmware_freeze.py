"""Lets switches trip in an emulated board, and counts instructions: see tests/benchmark/freeze.py.

TIM4 counts nanoseconds of the emulator's time there, in which an instruction takes one. Nothing is connected to pins,
and the registers of the external interrupts are memory: a flag is set there, and the interrupt made pending. The
callback is told that port A is where its level register is TIM4's counter: so what it takes for the levels of the pins,
right behind the stop of both counters, is the time.
"""

from array import array

import micropython
from arm_rows import HEAD, row
from armtempo_board.hardware import isr
from armtempo_board.hardware.inputs import Inputs
from armtempo_board.hardware.sampler import Sampler
from armtempo_shared import armrecord
from micropython import const

FLAGS = armrecord.FLAG_ESTOP_FITTED | armrecord.FLAG_ESTOP_ACTIVE_HIGH | armrecord.FLAG_ESTOP_RELEASES
JOINTS = [row(channel=n, limit_high=n, limit_active_high=1) for n in range(3)]
LINES = (("E-stop", 15), ("limit 1", 8), ("limit 2", 9), ("limit 3", 10))
_SET_PENDING = const(0xE000E200)  # of the NVIC
_FLAGS_AT = const(0x14)  # of the external interrupts
_FLAG_WORD = const(0)
_PENDING_WORD = const(0)
_COUNTER = const(9)
_CLOCK_AS_PORT = const(0x814)  # bytes after TIM2: IDR lies 0x10 after it

began = array("I", [0])


@micropython.viper
def spent(flags: ptr32, flag: int, pending: ptr32, interrupt: int) -> int:
    """Instructions between two looks at the clock; in between an interrupt, with the flag of an external line."""
    clock = ptr32((1 << 30) + 0x800)
    at = ptr32(began)
    flags[_FLAG_WORD] = flag
    before = clock[_COUNTER]
    pending[_PENDING_WORD] = interrupt
    after = clock[_COUNTER]
    at[0] = before
    return after - before


@micropython.viper
def until(words: ptr32, word: int) -> int:
    """Instructions from the last ``before`` to a time."""
    return words[word] - ptr32(began)[0]


def count(registers, line):
    """Instructions that the interrupt of a line takes."""
    number = 40 if line > 9 else 23
    pending = _SET_PENDING + 4 * (number >> 5)
    between = spent(registers + _FLAGS_AT, 0, pending, 0)
    return spent(registers + _FLAGS_AT, 1 << line, pending, 1 << (number & 31)) - between


def main(registers):
    """Count for each line; ``registers``: address of what the firmware takes for those of the external interrupts."""
    head = dict(HEAD)
    head["flags"] = FLAGS
    sampler = Sampler()
    sampler.configure(len(JOINTS), ())
    inputs = Inputs(head, JOINTS, sampler)
    block = sampler.block
    block[isr.PORT_A_OFFSET] = _CLOCK_AS_PORT
    for name, line in LINES:
        inputs.thaw()
        inputs.watch(1)
        at = isr.FIRST_LINE + isr.LINE_WORDS * (line - isr.SOFTWARE_LINE)
        block[at + isr.LINE_LEVELS] = block[at + isr.LINE_MASK]  # the DIR port reads 0 here
        whole = count(registers, line)
        still = until(block, isr.HIGH_A)
        froze = block[isr.FROZEN] and block[at + isr.LINE_TRIPPED]
        again = count(registers, line)
        inputs.watch(0)
        away = count(registers, line)
        if froze:
            print("@ %s: %d %d %d %d" % (name, still, whole, again, away))
    print("@ end")
