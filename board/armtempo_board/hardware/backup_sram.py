"""The backup SRAM of the STM32F405 and F407: 4 KB of memory that MicroPython leaves to programs.

RM0090 2.3 (memory map) and 5.1.2 (battery backup domain). It keeps its content over a reset, which nobody here relies
on. It is on the bus of the peripherals (AHB1), not with the memories that DMA is meant to read: no ring of edge times
lies in it. The processor may take a cycle or two more for an access than to its main memory: not measured on a chip.
Accesses are aligned, as they must be in the address range of peripherals.
"""

import stm
from armtempo_shared.engine_memory import PROCESSOR_WORDS
from machine import mem32
from micropython import const

_BEGIN = const(0x40024000)  # not in MicroPython's table of addresses
_ONES = const(0x2AAAAAAA)  # a small integer
_PROBED = (0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 512, PROCESSOR_WORDS - 1)  # words: every line of the address


def find() -> int:
    """Its address, ready to be used; 0 if it does not keep what is written to it.

    A chip without it is not asked: there the access itself would fail.
    """
    from armtempo_board.hardware import registers  # here, so that it can be forgotten

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
