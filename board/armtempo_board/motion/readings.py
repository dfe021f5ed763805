"""From raw samples to samples, kept until they are fetched.

The words of a sample are named in ``buffers.py``.
"""

from array import array

from micropython import const

from armtempo_board.buffers import COMMANDED, TICKS_HIGH, TICKS_LOW
from armtempo_board.hardware import isr
from armtempo_board.hardware.encoders import EncoderInput, NoEncoder
from armtempo_board.hardware.sampler import Sampler
from armtempo_board.motion.joint_drive import JointDrive

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_CAPACITY = const(4)  # samples
_HALF_ROUND_KITICKS = const(1 << 21)  # of the counter


class Readings:
    """``joints`` and ``encoders``: one of each a joint; ``slots``: word of its encoder in a raw sample."""

    def __init__(
        self,
        sampler: Sampler,
        joints: "list[JointDrive]",
        encoders: "list[EncoderInput | NoEncoder]",
        slots: "list[int]",
    ) -> None:
        self._sampler = sampler
        self._joints = joints
        self._encoders = encoders
        self._slots = slots
        self._override: "Any" = None
        self._size = COMMANDED + 2 * len(joints)
        self._words = array("i", bytearray(4 * _CAPACITY * self._size))
        self._in = self._out = 0
        self.lost = 0

    def clear(self, override: "Any") -> None:
        """Forget what was not fetched; ``override``: of the motion that comes."""
        self._override = override
        self._in = self._out = 0
        self.lost = 0

    def convert(self, epoch: int, now_kiticks: int) -> None:
        """Convert all raw samples; the counter is at ``epoch`` * 2**32 + ``now_kiticks`` * 1024."""
        sampler = self._sampler
        at = sampler.next_raw()
        while at >= 0:
            if self._in - self._out >= _CAPACITY:
                self._out += 1
                self.lost += 1
            self._convert(at, (self._in & (_CAPACITY - 1)) * self._size, epoch, now_kiticks)
            self._in += 1
            sampler.drop()
            at = sampler.next_raw()

    def _convert(self, at: int, to: int, epoch: int, now_kiticks: int) -> None:
        raw, words = self._sampler.raw, self._words
        ahead = isr.word_kiticks(raw, at) - now_kiticks  # a sample may have come since the clock was read
        if ahead > _HALF_ROUND_KITICKS:
            epoch -= 1
        elif ahead < -_HALF_ROUND_KITICKS:
            epoch += 1
        words[to + TICKS_LOW] = 0
        words[to + TICKS_HIGH] = max(epoch, 0)
        if epoch >= 0:
            isr.copy_word(raw, at, words, to)
        if (
            self._override
        ):  # else something failed while the motion was ended, and this belongs to what comes of that
            self._override.put_path(words, to)
        commanded, counts = to + COMMANDED, to + COMMANDED + len(self._joints)
        for number in range(len(self._joints)):
            joint = self._joints[number]
            encoder = self._encoders[number]
            encoder.take(raw[at + self._slots[number]])
            words[commanded + number] = joint.position(raw[at + isr.RAW_MATCHES + number])
            words[counts + number] = encoder.counts

    def close(self) -> None:
        """All are converted, no more come: let the override go."""
        self._override = None

    def next(self, buffer: "array[int]") -> bool:
        """Copy the oldest sample to ``buffer`` and forget it; False where there is none."""
        if self._in == self._out:
            return False
        at = (self._out & (_CAPACITY - 1)) * self._size
        for word in range(self._size):
            buffer[word] = self._words[at + word]
        self._out += 1
        return True
