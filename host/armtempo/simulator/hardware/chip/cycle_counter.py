"""DWT's cycle counter (ARMv7-M Architecture Reference Manual C1.8.8): it counts while trace and counter are on."""

from chip import memory

CYCLES_PER_TICK = 2  # 168 MHz, in ticks of 84 MHz
_CTRL, _CYCCNT = 0, 1  # words of DWT
_DEMCR = 63  # word of the block from 0xE000ED00 on
_TRCENA = 24


class CycleCounter:
    """``look`` updates the register before it is read; ``sync`` takes what was written."""

    def __init__(self, board):
        self._board = board
        self.at = memory.index("DWT") + _CYCCNT
        self._since = 0

    def _on(self):
        words = memory.words
        return words[self.at - _CYCCNT + _CTRL] & 1 and words[memory.index("SCS") + _DEMCR] >> _TRCENA & 1

    def look(self):
        """The register is about to be read."""
        self._board.spend(0)
        if self._on():
            passed = (self._board.now - self._since) * CYCLES_PER_TICK
            memory.poke(self.at, (memory.words[self.at] + passed) & memory.MASK)
        self._since = self._board.now

    def sync(self):
        """Counter or switches were written: it counts on from there."""
        self._since = self._board.now
