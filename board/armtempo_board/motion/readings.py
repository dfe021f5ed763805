"""Positions of the joints: samples converted from raw samples, kept until they are fetched, and snapshots.

The words of a sample are named in ``buffers.py``.
"""

from array import array

from micropython import const

from armtempo_board.buffers import COMMANDED, PATH_HIGH, PATH_LOW, TICKS_HIGH, TICKS_LOW
from armtempo_board.hardware import isr
from armtempo_board.hardware.encoders import EncoderInput, NoEncoder
from armtempo_board.hardware.sampler import Sampler
from armtempo_board.motion.clock import MotionClock
from armtempo_board.motion.joint_drive import JointDrive

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_CAPACITY = const(4)  # samples
_HALF_ROUND_KITICKS = const(1 << 21)  # of the counter


class Readings:
    """``joints``, ``encoders``: one per joint; ``slots``: word of its encoder in a raw sample."""

    def __init__(
        self,
        sampler: Sampler,
        clock: MotionClock,
        joints: "list[JointDrive]",
        encoders: "list[EncoderInput | NoEncoder]",
        slots: "list[int]",
    ) -> None:
        self._sampler = sampler
        self._clock = clock
        self._joints = joints
        self._encoders = encoders
        self._slots = slots
        self._override: "Any" = None
        self._end = array("i", [0] * COMMANDED)  # the two end times of the last motion, as in a sample
        self._has_ended = False
        self._size = COMMANDED + 2 * len(joints)
        self._words = array("i", bytearray(4 * _CAPACITY * self._size))
        self._in = self._out = 0
        self.lost = 0

    def begin(self, override: "Any") -> None:
        """Drop samples that were not fetched; ``override``: of the next motion."""
        self._override = override
        self._has_ended = False
        self._in = self._out = 0
        self.lost = 0

    def convert(self) -> None:
        """Convert all raw samples; the clock was read just before."""
        sampler = self._sampler
        at = sampler.next_raw()
        while at >= 0:
            if self._in - self._out >= _CAPACITY:
                self._out += 1
                self.lost += 1
            self._convert(at, (self._in & (_CAPACITY - 1)) * self._size)
            self._in += 1
            sampler.drop()
            at = sampler.next_raw()

    def _convert(self, at: int, to: int) -> None:
        raw, words = self._sampler.raw, self._words
        epoch = self._clock.epoch
        # It may have come since that was read
        ahead = isr.word_kiticks(raw, at) - self._clock.counter_kiticks
        if ahead > _HALF_ROUND_KITICKS:
            epoch -= 1
        elif ahead < -_HALF_ROUND_KITICKS:
            epoch += 1
        words[to + TICKS_LOW] = 0
        words[to + TICKS_HIGH] = max(epoch, 0)
        if epoch >= 0:
            isr.copy_word(raw, at, words, to)
        # Else something failed while the motion was ended, and this belongs to what comes of that
        if self._override:
            self._override.put_path(words, to)
        commanded, counts = to + COMMANDED, to + COMMANDED + len(self._joints)
        for number in range(len(self._joints)):
            joint = self._joints[number]
            encoder = self._encoders[number]
            encoder.take(raw[at + self._slots[number]])
            words[commanded + number] = joint.position(raw[at + isr.RAW_MATCHES + number])
            words[counts + number] = encoder.counts - joint.extra_counts

    def end(self, ticks: int) -> None:
        """The motion has ended at ``ticks``: note the end times, and release its override."""
        if self._override:
            self.convert()
            _put_ticks(self._end, ticks)
            self._override.put_path(self._end, 0)
            self._override = None
        self._has_ended = True

    def next(self, buffer: "array[int]") -> bool:
        """Move the oldest sample to ``buffer``; returns False if there is none."""
        if self._in == self._out:
            return False
        at = (self._out & (_CAPACITY - 1)) * self._size
        for word in range(self._size):
            buffer[word] = self._words[at + word]
        self._out += 1
        return True

    def commanded(self, joint: int) -> int:
        """Commanded position of a joint in steps."""
        while True:
            matches = self._joints[joint].ring.matches()
            if not self._sampler.waits():
                return self._joints[joint].position(matches)
            self.convert()  # samples first: they may be older

    def snapshot(self, buffer: "array[int]") -> None:
        """Write a sample of this moment to ``buffer``; after a motion with the time at which it ended."""
        if self._has_ended:
            for word in range(COMMANDED):
                buffer[word] = self._end[word]
        else:
            _put_ticks(buffer, max(self._clock.ticks(), 0))
        if self._override:
            self._override.put_path(buffer, 0)
        count = len(self._joints)
        for number in range(count):
            encoder = self._encoders[number]
            buffer[COMMANDED + number] = self.commanded(number)
            encoder.update()
            buffer[COMMANDED + count + number] = encoder.counts - self._joints[number].extra_counts


def _put_ticks(sample: "array[int]", ticks: int) -> None:
    """Put the time into a sample, also as the motion's own time."""
    low = ticks & 0xFFFFFFFF
    sample[TICKS_LOW] = sample[PATH_LOW] = low - (1 << 32) if low >> 31 else low
    sample[TICKS_HIGH] = sample[PATH_HIGH] = ticks >> 32
