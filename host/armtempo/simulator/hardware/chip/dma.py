"""DMA1: circular streams that feed timers' compare registers (RM0090 chapter 10)."""

from chip import memory

# (stream, channel selection): the timers' compare channels that request a transfer (RM0090 10.3.3)
REQUESTS = {
    (5, 3): ((2, 1),),
    (6, 3): ((2, 2), (2, 4)),
    (1, 3): ((2, 3),),
    (7, 3): ((2, 4),),
    (2, 6): ((5, 1),),
    (4, 6): ((5, 2),),
    (0, 6): ((5, 3),),
    (3, 6): ((5, 4),),
    (1, 6): ((5, 4),),
}
CR, NDTR, PAR, M0AR = 0, 1, 2, 3
_EN = 1
_CIRC = 1 << 8
# fields of CR required for a stream into a compare register
_NEEDS = ((0xC0, 0x40, "direction memory to peripheral"), (0x600, 0x400, "memory increment alone"),
          (0x7800, 0x5000, "word sizes"), (_CIRC, _CIRC, "circular mode"))  # fmt: skip
_FLAG_SHIFT = (0, 6, 16, 22)
_TCIF = 0x20


class Stream:
    """One stream. ``ring`` is None while it is off.

    ``place`` is the ring index of the next word to fetch, ``left`` the NDTR count, ``ahead`` the word
    already fetched: in direct mode the stream fetches one word before the request comes (RM0090 10.3.12).
    """

    def __init__(self, number):
        self.number = number
        self.is_dead = False  # an injected fault: it serves no request
        self.at = memory.index("DMA1") + 4 + 6 * number
        self.ring = None
        self.place = 0
        self.left = 0
        self.ahead = 0

    def requests(self):
        """(timer, channel) pairs whose requests reach this stream."""
        if self.is_dead:
            return ()
        selection = (memory.words[self.at + CR] >> 25) & 7
        return REQUESTS.get((self.number, selection), ())

    def sync(self, clocked):
        """The program may have written the stream's registers."""
        enabled = memory.words[self.at + CR] & _EN and clocked
        if enabled and self.ring is None:
            self._start()
        elif not enabled:
            self.ring = None

    def _start(self):
        words = memory.words
        control = words[self.at + CR]
        for mask, wanted, what in _NEEDS:
            if control & mask != wanted:
                raise ValueError("DMA1 stream %d: wants %s" % (self.number, what))
        self.left = words[self.at + NDTR]
        ring = memory.objects.get(words[self.at + M0AR] & memory.MASK)
        if ring is None or len(ring) < self.left or self.left == 0:
            raise ValueError("DMA1 stream %d: no buffer of %d words at M0AR" % (self.number, self.left))
        self.ring = ring
        self.size = self.left
        self.place = 1 % self.size
        self.ahead = ring[0] & 0xFFFFFFFF

    def target(self):
        """Word index of the register that the stream writes."""
        return memory.word_at_low(memory.words[self.at + PAR])

    def moved(self, count):
        """``count`` words were transferred: update the registers."""
        left = self.left - count
        if left <= 0:
            left = (left - 1) % self.size + 1
            flags = memory.index("DMA1") + (self.number >> 2)
            memory.poke(flags, memory.words[flags] | _TCIF << _FLAG_SHIFT[self.number & 3])
        self.left = left
        memory.poke(self.at + NDTR, left)


class Controller:
    """The controller DMA1."""

    def __init__(self):
        self.at = memory.index("DMA1")
        self.streams = [Stream(number) for number in range(8)]

    def sync(self, clocked):
        """The program may have written DMA1 or its clock bit."""
        for flags, clear in ((0, 2), (1, 3)):
            written = memory.words[self.at + clear]
            if written:
                memory.poke(self.at + flags, memory.seen[self.at + flags] & ~written)
                memory.poke(self.at + clear, 0)
        for stream in self.streams:
            stream.sync(clocked)

    def feeding(self, timer, channel):
        """The running stream that a compare channel's request reaches, or None."""
        for stream in self.streams:
            if stream.ring is not None and (timer, channel) in stream.requests():
                return stream
        return None
