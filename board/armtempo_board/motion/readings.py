"""From raw samples to samples, kept until they are fetched.

The words of a sample are named in ``buffers.py``.
"""

from array import array

from micropython import const

from armtempo_board.hardware import isr
from armtempo_board.hardware.encoders import Encoder, NoEncoder
from armtempo_board.hardware.sampler import Sampler
from armtempo_board.motion.joint import Joint

_ROOM = const(4)
_HALF_K = const(1 << 21)  # half a round of the counter in 1024 ticks


class Readings:
    """``joints`` and ``encoders``: one of each a joint; ``slots``: place of its encoder in a raw sample."""

    def __init__(
        self,
        sampler: Sampler,
        joints: "list[Joint]",
        encoders: "list[Encoder | NoEncoder]",
        slots: "list[int]",
    ) -> None:
        self._sampler = sampler
        self._joints = joints
        self._encoders = encoders
        self._slots = slots
        self._size = 2 + 2 * len(joints)
        self._words = array("i", bytearray(4 * _ROOM * self._size))
        self._in = self._out = 0
        self.lost = 0

    def clear(self) -> None:
        """Forget what was not fetched."""
        self._in = self._out = 0
        self.lost = 0

    def convert(self, epoch: int, now_k: int) -> None:
        """Convert all raw samples; the counter is at ``epoch`` * 2**32 + ``now_k`` * 1024."""
        sampler = self._sampler
        at = sampler.next_raw()
        while at >= 0:
            if self._in - self._out >= _ROOM:
                self._out += 1
                self.lost += 1
            self._convert(at, (self._in & (_ROOM - 1)) * self._size, epoch, now_k)
            self._in += 1
            sampler.drop()
            at = sampler.next_raw()

    def _convert(self, at: int, to: int, epoch: int, now_k: int) -> None:
        raw, words = self._sampler.raw, self._words
        ahead = isr.word_k(raw, at) - now_k  # a sample may have come since the clock was read
        if ahead > _HALF_K:
            epoch -= 1
        elif ahead < -_HALF_K:
            epoch += 1
        words[to] = 0
        words[to + 1] = max(epoch, 0)
        if epoch >= 0:
            isr.copy_word(raw, at, words, to)
        for number in range(len(self._joints)):
            joint = self._joints[number]
            encoder = self._encoders[number]
            encoder.take(raw[at + self._slots[number]])
            words[to + 2 + number] = joint.position(raw[at + 1 + number])
            words[to + 2 + len(self._joints) + number] = encoder.counts

    def next(self, buffer: "array[int]") -> bool:
        """Copy the oldest sample to ``buffer`` and forget it; False where there is none."""
        if self._in == self._out:
            return False
        at = (self._out & (_ROOM - 1)) * self._size
        for word in range(self._size):
            buffer[word] = self._words[at + word]
        self._out += 1
        return True
