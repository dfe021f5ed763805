"""The backup SRAM of the STM32F405 and F407: 4 KB of memory that MicroPython leaves to programs.

RM0090 2.3 (memory map) and 5.1.2 (battery backup domain). It keeps its content over a reset, which is not
used here. It is on the bus of the peripherals (AHB1), where DMA does not read memory, so no ring of edge
times is in it. An access may take a cycle or two longer than to main memory (not measured on a chip).
Accesses must be aligned, as in the address range of peripherals.
"""

import stm
from armtempo_shared.engine_memory import PROCESSOR_WORDS
from machine import mem32
from micropython import const

from armtempo_board.hardware import registers

_BEGIN = const(0x40024000)  # not in MicroPython's table of addresses
_ONES = const(0x2AAAAAAA)  # a small integer
_PROBED = (0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 512, PROCESSOR_WORDS - 1)  # words: every line of the address


def find() -> int:
    """Switch it on; returns its address, or 0 if it does not keep what is written to it.

    Not called on a chip without it, where the access itself would fail.
    """
    registers.apply(registers.BACKUP_SRAM)
    # DBP acts some bus cycles after it is written (errata ES0182, delay of the backup domain's protection): a line of
    # Python takes longer, and the test finds out
    begin = int(getattr(stm, "BKPSRAM", _BEGIN))
    for value in (_ONES, _ONES >> 1):
        for word in _PROBED:
            mem32[begin + 4 * word] = value ^ word
        for word in _PROBED:
            if mem32[begin + 4 * word] != value ^ word:
                return 0
    return begin
