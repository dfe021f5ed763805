"""Samples of the current or last run, kept in one fixed buffer until the host has them.

A slot holds what the ``sample`` event carries behind run and index: ticks (8 bytes), flags (1), then
commanded steps and encoder counts of each joint (4 and 4).
"""

from micropython import const

from armtempo_board.buffers import copy, places, spread

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array

_FLAGS = const(8)  # index of the flags in a slot
_HEAD = const(9)  # ticks, flags


class Samples:
    """First in, first out; the oldest gives way where the memory ends, and is counted in ``lost``."""

    def __init__(self, joints: int, memory: int) -> None:
        """``memory``: bytes to keep samples in."""
        self.size = _HEAD + 8 * joints
        self._joints = joints
        self._places = memory // self.size
        self._buffer = bytearray(self._places * self.size)
        self.clear()

    def clear(self) -> None:
        """A new run begins."""
        self.first = 0  # index of the oldest sample kept
        self.next = 0  # index of the next sample
        self.sent = 0  # samples before this one have been sent at least once
        self.lost = 0
        self._again = 0  # the next one to be sent again,
        self._again_end = 0  # up to here

    def add(self, raw: "array[int]", flags: int) -> None:
        """Keep one: ``raw`` as the engine fills it; ``flags`` of the sample event."""
        if self.next - self.first == self._places:
            self.first += 1
            self.lost += 1
            self.sent = max(self.sent, self.first)
        at = self.next % self._places * self.size
        spread(self._buffer, raw, places(at, at + _HEAD), self._joints)
        self._buffer[at + _FLAGS] = flags
        self.next += 1

    def acknowledge(self, index: int) -> None:
        """All before ``index`` have arrived; what was never sent cannot have."""
        self.first = max(self.first, min(index, self.sent))

    def skip(self) -> None:
        """A new host: it asks for what it wants of the older ones."""
        self.sent = self.next
        self._again = self._again_end = 0

    def again(self, index: int, count: int) -> None:
        """Send up to ``count`` from ``index`` on again."""
        self._again = max(index, self.first)
        self._again_end = min(index + count, self.sent)

    def waiting(self) -> int:
        """Index of the next sample to send, or -1."""
        self._again = max(self._again, self.first)
        if self._again < self._again_end:
            return self._again
        return self.sent if self.sent < self.next else -1

    def take(self, index: int, target: bytearray, at: int) -> None:
        """Copy the sample ``waiting`` named to target[at:]; it counts as sent."""
        copy(target, self._buffer, places(at, index % self._places * self.size), self.size)
        if index == self.sent:
            self.sent += 1
        else:
            self._again = index + 1
