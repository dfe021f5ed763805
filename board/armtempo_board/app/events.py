"""What the board tells unasked: samples, then the end of the run or its fault; notices."""

from struct import calcsize, pack_into

from armtempo_shared.messages import MAX_PAYLOAD
from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from armtempo_board.app.app import App

_SAMPLE_HEAD = "<II"  # run and index; the rest of the fields stands in the slot
_SAMPLE_HEAD_SIZE = const(8)
_DONE_TICKS = const(4)  # index of the ticks in done
_FAULT_TICKS = const(6)  # and in fault


class Events:
    """Pushes what is waiting as the link takes it."""

    def __init__(self, app: "App", rows: "Callable[[str], list[Any]]") -> None:
        """``rows`` of the message table."""
        self._app = app
        events = rows("E")
        self._numbers = bytes([row[1] for row in events])  # sample, done, fault, notice
        self._forms = (events[1][2], events[2][2])  # of done and fault
        self._noted = 0  # the fault that was told last
        self._notice = b""
        self.clear()

    def clear(self) -> None:
        """A new run begins."""
        self._done = False
        self._fault = False

    def note_done(self) -> None:
        """The run has ended without a fault."""
        self._done = True

    def note_fault(self, code: int) -> None:
        """Called every turn with the pending fault (0: none); tells each once."""
        if code != self._noted:
            self._noted = code
            self._fault = code != 0

    def note(self, text: str) -> None:
        """Keep words for the host; the last ones, which say what is wrong, where more come than go."""
        if not self._notice:
            self._notice = text.encode()[-MAX_PAYLOAD:]

    def push(self) -> bool:
        """Hand the link what is waiting and has room, one sample at most; whether there was one."""
        if self._push_sample():
            return True
        if self._app.samples.waiting() < 0:
            self._push_end()
        self._push_notice()
        return False

    def _push_sample(self) -> bool:
        samples = self._app.samples
        index = samples.waiting()
        if index < 0 or not self._app.link.room(_SAMPLE_HEAD_SIZE + samples.size):
            return False
        link = self._app.link
        at = link.payload()
        pack_into(_SAMPLE_HEAD, link.out, at, self._app.run_number, index)
        samples.take(index, link.out, at + _SAMPLE_HEAD_SIZE)
        link.event(self._numbers[0], _SAMPLE_HEAD_SIZE + samples.size)
        return True

    def _push_end(self) -> None:
        if self._done and self._room(0):
            self._done = False
            samples = self._app.samples
            self._put(0, _DONE_TICKS, self._app.run_number, 0, samples.next, samples.lost)
        if self._fault and self._room(1):
            self._fault = False
            app = self._app
            self._put(1, _FAULT_TICKS, app.run_number, app.fault(), app.fault_joint(), 0)

    def _room(self, kind: int) -> int:
        return self._app.link.room(calcsize(self._forms[kind]) + 8 * self._app.joints)

    def _put(self, kind: int, ticks: int, *values: int) -> None:
        link = self._app.link
        at = link.payload()
        pack_into(self._forms[kind], link.out, at, *values)
        size = calcsize(self._forms[kind])
        size += self._app.stand(link.out, at + ticks, at + size)
        link.event(self._numbers[1 + kind], size)

    def _push_notice(self) -> None:
        link = self._app.link
        if self._notice and link.room(len(self._notice)):
            at = link.payload()
            link.out[at : at + len(self._notice)] = self._notice
            link.event(self._numbers[3], len(self._notice))
            self._notice = b""
