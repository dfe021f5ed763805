"""Samples since the last start, of a motion or of a sequence with all its motions, kept until the host has them.

A slot has the lowest byte of the run's number, then what the ``sample`` event carries after run and index: ticks and
path (8 bytes each), flags (1), commanded steps and encoder counts of each joint (4 and 4).
"""

from micropython import const

from armtempo_board.buffers import copy, pack_offsets, sample_to_wire

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array

_BYTES_PER_JOINT = const(8)
_RUN_BYTES = const(1)
_RUN_MASK = const(0xFF)  # far more runs than have samples in the buffer at once


class SampleBuffer:
    """A FIFO; if it is full the oldest sample is dropped, and counted in ``lost`` unless it was sent: then the host
    may have it."""

    def __init__(self, memory: int, flags_at: int) -> None:
        """``memory``: bytes to keep samples in; ``flags_at``: bytes of a sample before its flags."""
        self.flags_at = flags_at
        self._buffer = bytearray(memory)
        self.configure(0)

    def configure(self, joints: int) -> None:
        """Use samples of ``joints`` joints from now on."""
        self.size = self.flags_at + 1 + _BYTES_PER_JOINT * joints  # in the event
        self._slot = _RUN_BYTES + self.size
        self._joints = joints
        self._capacity = len(self._buffer) // self._slot
        self.clear()

    def clear(self) -> None:
        """A motion or a sequence begins."""
        self.first = 0  # index of the oldest sample kept
        self.next = 0  # index of the next sample
        self.sent = 0  # samples before this one have been sent at least once
        self.lost = 0
        self._again = 0  # the next one to be sent again,
        self._again_end = 0  # up to here

    def add(self, raw: "array[int]", run: int, flags: int) -> None:
        """Store a sample of a run: ``raw`` as filled by the engine; ``flags`` of the sample event."""
        if self.next - self.first == self._capacity:
            self.lost += self.first == self.sent
            self.first += 1
            self.sent = max(self.sent, self.first)
        at = self.next % self._capacity * self._slot
        self._buffer[at] = run & _RUN_MASK
        at += _RUN_BYTES
        flags_at = at + self.flags_at
        sample_to_wire(self._buffer, raw, pack_offsets(at, flags_at + 1), self._joints)
        self._buffer[flags_at] = flags
        self.next += 1

    def acknowledge(self, index: int) -> None:
        """Drop all samples before ``index``, if they were sent."""
        self.first = max(self.first, min(index, self.sent))

    def skip(self) -> None:
        """For a new host: do not send older samples unless it requests them."""
        self.sent = self.next
        self._again = self._again_end = 0

    def send_again(self, index: int, count: int) -> None:
        """Send up to ``count`` from ``index`` on again."""
        self._again = max(index, self.first)
        self._again_end = min(index + count, self.sent)

    def waiting(self) -> int:
        """Index of the next sample to send, or -1."""
        self._again = max(self._again, self.first)
        if self._again < self._again_end:
            return self._again
        return self.sent if self.sent < self.next else -1

    def take(self, index: int, target: bytearray, at: int, latest: int) -> int:
        """Copy the sample ``index`` (from ``waiting``) to target[at:]; it counts as sent.

        Returns the number of its run; ``latest``: that of the latest run.
        """
        slot_at = index % self._capacity * self._slot
        copy(target, self._buffer, pack_offsets(at, slot_at + _RUN_BYTES), self.size)
        if index == self.sent:
            self.sent += 1
        else:
            self._again = index + 1
        return latest - (latest - self._buffer[slot_at] & _RUN_MASK)
