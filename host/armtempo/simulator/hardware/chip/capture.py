"""DMA2: circular streams that copy a port's input register into memory at requests of TIM1 (RM0090 10.3.3, table 43).

Only DMA2 can access the ports, which are on AHB1. The samples are computed afterwards, from the edges of the
port's pins.
"""

from chip import memory
from chip.gpio import IDR, PORTS
from chip.timers import ARR, CCR1, CNT, CR1, DIER

REQUESTS = {(5, 6): 0, (1, 6): 1, (3, 6): 1, (2, 6): 2, (6, 6): 3}
"""(stream, channel selection): the request, TIM1's update (0) or a compare channel."""
_CR, _NDTR, _PAR, _M0AR = range(4)
_NEEDS = ((0xC0, 0, "direction peripheral to memory"), (0x600, 0x400, "memory increment alone"),
          (0x7800, 0x2800, "half words"), (0x100, 0x100, "circular mode"))  # fmt: skip
_AHB1ENR, _DMA2EN = 12, 22
_UDE = 8


class PortStream:
    """A running stream; receives the edges of the port that it reads."""

    def __init__(self, number, timer, port, ring, size):
        words = memory.words
        self.at = memory.index("DMA2") + 4 + 6 * number
        self._port = port
        self._ring = ring
        self._size = size
        self._place = 0
        period = words[timer.at + ARR] + 1
        request = REQUESTS[(number, words[self.at + _CR] >> 25 & 7)]
        matched = words[timer.at + CCR1 + request - 1] if request else period
        wait = (matched - words[timer.at + CNT]) % period or period
        self._period, self._rate = period * timer.scale, timer.rate
        self._next = timer.board.now * timer.rate + wait * timer.scale  # in counts of the timer's clock
        self._level = words[port.at + IDR]
        self._edges = []
        for line in port.lines:
            line.sinks.append(self)

    def stop(self):
        """Disconnect from the port."""
        for line in self._port.lines:
            line.sinks.remove(self)

    def edges(self, line, before, count, times, origin):
        """A pin toggled."""
        bit = 1 << line.number
        for time in times:
            before ^= 1
            self._edges.append((origin + time, bit, bit * before))

    def run(self, now):
        """Write all samples up to ``now``."""
        edges = sorted(self._edges)
        self._edges = []
        for time, bit, level in edges:
            self._fill(time)
            self._level = self._level & ~bit | level
        self._fill(now + 1)
        memory.poke(self.at + _NDTR, self._size - self._place)

    def _fill(self, until):
        """Write the samples before a tick, all of the present level."""
        count = (until * self._rate - self._next - 1) // self._period + 1
        if count <= 0:
            return
        self._next += count * self._period
        ring, size, level = self._ring, self._size, self._level
        for _ in range(min(count, size)):
            ring[self._place] = level
            self._place += 1
            if self._place == size:
                self._place = 0
        if count > size:
            self._place = (self._place + count - size) % size


class PortReader:
    """The controller DMA2."""

    def __init__(self, board):
        self._board = board
        self.streams = {}

    def sync(self):
        """The program may have written DMA2, TIM1 or their clocks."""
        words = memory.words
        timer = self._board.timers[1]
        clocked = words[memory.index("RCC") + _AHB1ENR] >> _DMA2EN & 1
        runs = clocked and timer.clocked and words[timer.at + CR1] & 1
        for number in range(8):
            at = memory.index("DMA2") + 4 + 6 * number
            request = REQUESTS.get((number, words[at + _CR] >> 25 & 7))
            asked = request is not None and words[timer.at + DIER] >> _UDE + request & 1
            wanted = runs and asked and words[at + _CR] & 1
            if wanted and number not in self.streams:
                self.streams[number] = self._start(number, timer, at)
            elif not wanted and number in self.streams:
                self.streams.pop(number).stop()

    def _start(self, number, timer, at):
        words = memory.words
        for mask, needed, what in _NEEDS:
            if words[at + _CR] & mask != needed:
                raise ValueError("DMA2 stream %d: wants %s" % (number, what))
        ring = memory.objects.get(words[at + _M0AR] & memory.MASK)
        size = words[at + _NDTR]
        if ring is None or len(ring) < size or not size:
            raise ValueError("DMA2 stream %d: no buffer of %d half words at M0AR" % (number, size))
        read = memory.word_at_low(words[at + _PAR])
        for port in self._board.pins.ports:
            if port.at + IDR == read:
                return PortStream(number, timer, port, ring, size)
        raise ValueError("DMA2 stream %d reads no port of %s" % (number, PORTS))

    def run(self, now):
        """Time has passed."""
        for stream in self.streams.values():
            stream.run(now)
