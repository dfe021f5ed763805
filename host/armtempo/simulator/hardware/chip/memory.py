"""The peripheral registers and the backup SRAM, in real memory, so that viper code can access them as on the chip.

``words`` are the registers; ``seen`` are their values when the models last read or wrote them: a difference
means that the program has written a register since.
"""

import sys

import uctypes

# TIM2 to TIM5, and the ports, are as far apart as on the chip: code may rely on that
BLOCKS = (
    "TIM1", "TIM2", "GPIOA", "TIM3", "TIM4", "TIM6", "GPIOB", "TIM7", "TIM8", "DMA1",
    "GPIOC", "DMA2", "RCC", "TIM5", "GPIOD", "EXTI", "SYSCFG", "DBGMCU", "GPIOE", "PWR",
    "IWDG", "FLASH", "TIM9", "TIM10", "TIM11", "TIM12", "TIM13", "TIM14",
    "RTC", "DWT", "SCS", "NVIC_IPR",
)  # fmt: skip
# the chip's addresses (RM0090 table 1), for programs with literal addresses
_ON_CHIP = (
    0x40010000, 0x40000000, 0x40020000, 0x40000400, 0x40000800, 0x40001000, 0x40020400, 0x40001400, 0x40010400,
    0x40026000, 0x40020800, 0x40026400, 0x40023800, 0x40000C00, 0x40020C00, 0x40013C00, 0x40013800, 0xE0042000,
    0x40021000, 0x40007000, 0x40003000, 0x40023C00,
    0x40014000, 0x40014400, 0x40014800, 0x40001800, 0x40001C00, 0x40002000,
    0x40002800, 0xE0001000, 0xE000ED00,
)  # fmt: skip
BLOCK_WORDS = 64
BLOCK_BYTES = 4 * BLOCK_WORDS
SIZE = BLOCK_BYTES * len(BLOCKS)
MASK = 0xFFFFFFFF
BACKUP_WORDS = 1024
_BACKUP_ON_CHIP = 0x40024000
SECTORS_AT = 0x080C0000
SECTOR_BYTES = 128 * 1024
SECTORS_BYTES = 2 * SECTOR_BYTES
"""Of the last two sectors of a flash of 1 MB."""
_FLASH_SIZE_AT = 0x1FFF7A20
_FLASH_SIZE = 1024 << 16  # KB, in the upper half of the word (RM0090 39.2)
_AHB1ENR, _APB1ENR = 12, 16  # words of RCC
_BKPSRAMEN, _PWREN, _DBP = 18, 28, 8  # bits
_RTC_BYTES = BLOCK_BYTES


def _memory(size):
    """(bytearray, the same memory as 32-bit words)."""
    if sys.implementation.name == "micropython":
        from array import array

        cells = array("I", [0] * (size // 4))
        return uctypes.bytearray_at(uctypes.addressof(cells), size), cells
    raw = bytearray(size)
    return raw, memoryview(raw).cast("I")


raw, words = _memory(SIZE)
raw_seen, seen = _memory(SIZE)
base = uctypes.addressof(words)
raw_backup, backup = _memory(4 * BACKUP_WORDS)
"""The backup SRAM; it has no registers, so writes to it are not detected."""
backup_base = uctypes.addressof(backup)
raw_sectors, sectors = _memory(SECTORS_BYTES)
_sectors_base = uctypes.addressof(sectors)

objects = {}
"""Buffers that a DMA stream can use, by the low 32 bits of their address: those of ``uctypes.addressof``."""


def index(name):
    """Word index of a register block."""
    return BLOCKS.index(name) * BLOCK_WORDS


def address(name):
    """Address of a register block."""
    return base + 4 * index(name)


def word_at(where):
    """Word index of the register at an address; ValueError if the virtual board has no register."""
    offset = where - base
    if 0 <= offset < SIZE:
        return offset >> 2
    for block, start in enumerate(_ON_CHIP):
        if 0 <= where - start < BLOCK_BYTES:
            return block * BLOCK_WORDS + (where - start >> 2)
    raise ValueError("the virtual board has no register at 0x%x" % where)


def place(where):
    """(words, index) of the register or the memory at an address; ValueError as above."""
    for begin in (backup_base, _BACKUP_ON_CHIP):
        if 0 <= where - begin < 4 * BACKUP_WORDS:
            return backup, where - begin >> 2
    if 0 <= where - SECTORS_AT < SECTORS_BYTES:
        return sectors, where - SECTORS_AT >> 2
    if where & ~3 == _FLASH_SIZE_AT:
        return [_FLASH_SIZE], 0
    return words, word_at(where)


def real(where):
    """Where memory is in this process that on the chip is at an address."""
    return _sectors_base + where - SECTORS_AT if 0 <= where - SECTORS_AT < SECTORS_BYTES else where


def word_at_low(where):
    """As ``word_at``, from the low 32 bits of an address (what fits a register)."""
    return word_at(base + ((where - base) & MASK))


def poke(at, value):
    """A model writes a register."""
    words[at] = value
    seen[at] = value


def changed_blocks():
    """Indices of the blocks that the program has written since; marks them as seen."""
    if raw == raw_seen:
        return ()
    blocks = []
    for block in range(len(BLOCKS)):
        start = block * BLOCK_BYTES
        if raw[start : start + BLOCK_BYTES] != raw_seen[start : start + BLOCK_BYTES]:
            blocks.append(block)
    return blocks


def accept(block):
    """The models have handled the writes to this block."""
    start = block * BLOCK_BYTES
    raw_seen[start : start + BLOCK_BYTES] = raw[start : start + BLOCK_BYTES]


def clear():
    """A reset: all registers are 0, except the RTC's with its backup registers (RM0090 5.1.2)."""
    kept = index("RTC")
    for at in range(SIZE // 4):
        if not kept <= at < kept + BLOCK_WORDS:
            words[at] = 0
            seen[at] = 0
    objects.clear()


class BackupSram:
    """The backup domain (RM0090 5.1.2): without write access its SRAM and RTC keep their values.

    Without a clock the SRAM reads as 0. ``is_open``: it is writable; otherwise ``undo`` restores it after a write.
    """

    def __init__(self):
        for word in range(BACKUP_WORDS):
            backup[word] = (word + 1) * 0x9E3779B1 & MASK  # arbitrary at power-up
        self.is_open = True
        self._kept = b""
        self.sync()

    def sync(self):
        """RCC or PWR were written."""
        if self.is_open:
            self._kept = bytes(raw_backup)
        rcc, power = index("RCC"), index("PWR")
        if not words[rcc + _APB1ENR] >> _PWREN & 1:  # without a clock writes have no effect
            poke(power, seen[power])
        clocked = words[rcc + _AHB1ENR] >> _BKPSRAMEN & 1
        self._shown = self._kept if clocked else bytes(len(self._kept))
        self.is_open = clocked and words[power] >> _DBP & 1
        self.undo()

    def sync_rtc(self):
        """The RTC was written."""
        if not words[index("PWR")] >> _DBP & 1:
            at = 4 * index("RTC")
            raw[at : at + _RTC_BYTES] = raw_seen[at : at + _RTC_BYTES]

    def undo(self):
        """Restore its values."""
        raw_backup[0 : len(self._shown)] = self._shown
