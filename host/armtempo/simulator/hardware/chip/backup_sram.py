"""The backup domain (RM0090 5.1.2): without write access its SRAM and RTC keep their values.

Without a clock the SRAM reads as 0.
"""

from chip import memory

_AHB1ENR, _APB1ENR = 12, 16  # words of RCC
_BKPSRAMEN, _PWREN, _DBP = 18, 28, 8  # bits
_RTC_BYTES = memory.BLOCK_BYTES


class BackupSram:
    """``is_open``: it is writable; otherwise ``undo`` restores it after a write."""

    def __init__(self):
        for word in range(memory.BACKUP_WORDS):
            memory.backup[word] = (word + 1) * 0x9E3779B1 & memory.MASK  # arbitrary at power-up
        self.is_open = True
        self._kept = b""
        self.sync()

    def sync(self):
        """RCC or PWR were written."""
        if self.is_open:
            self._kept = bytes(memory.raw_backup)
        rcc, power = memory.index("RCC"), memory.index("PWR")
        if not memory.words[rcc + _APB1ENR] >> _PWREN & 1:  # without a clock writes have no effect
            memory.poke(power, memory.seen[power])
        clocked = memory.words[rcc + _AHB1ENR] >> _BKPSRAMEN & 1
        self._shown = self._kept if clocked else bytes(len(self._kept))
        self.is_open = clocked and memory.words[power] >> _DBP & 1
        self.undo()

    def sync_rtc(self):
        """The RTC was written."""
        if not memory.words[memory.index("PWR")] >> _DBP & 1:
            at = 4 * memory.index("RTC")
            memory.raw[at : at + _RTC_BYTES] = memory.raw_seen[at : at + _RTC_BYTES]

    def undo(self):
        """Restore its values."""
        memory.raw_backup[0 : len(self._shown)] = self._shown
