"""The board's events: samples, then the end of the run or its fault; notices."""

from struct import calcsize, pack_into

from armtempo_shared.messages import MAX_PAYLOAD
from armtempo_shared.table import offset, rows
from micropython import const

from armtempo_board import features

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_board.app.controller import Controller
    from armtempo_board.link.serial_link import SerialLink

_BYTES_PER_JOINT = const(8)


class Events:
    """Gives pending events to the link when it has space."""

    def __init__(self, controller: "Controller", link: "SerialLink") -> None:
        self._controller = controller
        self._board = controller.board
        self._link = link
        found = {name: (number, layout) for name, number, layout, _, _ in rows("E")}
        self._sample, layout = found["sample"]
        self._slot_at = offset("E", "sample", "ticks")  # of a sample in the buffer
        self._before_slot = layout[: layout.index("Q")]  # run and index
        self._done = found["done"] + (offset("E", "done", "ticks"),)
        self._fault = found["fault"] + (offset("E", "fault", "ticks"),)
        self._notice_number, _ = found["notice"]
        self._noted = 0  # the last noted fault
        self._fault_waits = False
        self.notice = b""  # a text that is still to be sent

    def note_fault(self, code: int) -> None:
        """Called every pass with the pending fault (0: none), which is sent once."""
        if code != self._noted:
            self._noted = code
            self._fault_waits = code != 0

    def note(self, text: str) -> None:
        """Keep the end of a text, which has the error, for the host; drops others until it is sent."""
        self.note_bytes(text.encode()[-MAX_PAYLOAD:])

    def note_bytes(self, text: bytes) -> None:
        """As ``note``, for at most MAX_PAYLOAD bytes; allocates nothing."""
        if not self.notice:
            self.notice = text

    if features.SEQUENCES:

        def note_failure(self, text: str) -> None:
            """Keep the end of a program's failure, for this host and for later ones until the fault is cleared."""
            self._board.failure = text.encode()[-MAX_PAYLOAD:]
            self._board.failure_waits = True

        def take_failure(self) -> None:
            """Make it the notice that is to be sent, unless this host was told."""
            if self._board.failure_waits and not self.notice:
                self._board.failure_waits = False
                self.notice = self._board.failure

    def push(self) -> bool:
        """Give pending events to the link, at most one sample; returns whether there was a sample."""
        if self._controller.sequence:
            self._controller.sequence.tell(self._link)
        if self._push_sample():
            return True
        if self._board.samples.waiting() < 0:
            self._push_end()
        self._push_notice()
        return False

    def _push_sample(self) -> bool:
        samples = self._board.samples
        index = samples.waiting()
        size = self._slot_at + samples.size
        link = self._link
        if index < 0 or not link.has_space(size):
            return False
        at = link.payload()
        run = samples.take(index, link.out, at + self._slot_at, self._controller.run_number)
        pack_into(self._before_slot, link.out, at, run, index)
        link.event(self._sample, size)
        return True

    def _push_end(self) -> None:
        controller = self._controller
        if controller.done and self._has_space(self._done):
            controller.done = False
            samples = self._board.samples
            self._put(self._done, controller.run_number, 0, 0, samples.next, samples.lost)
        if self._fault_waits and self._has_space(self._fault):
            self._fault_waits = False
            self._put(
                self._fault, controller.run_number, self._board.fault(), self._board.fault_joint(), 0, 0
            )

    def _has_space(self, event: "tuple[int, str, int]") -> int:
        _, layout, _ = event
        return self._link.has_space(calcsize(layout) + _BYTES_PER_JOINT * self._board.joints)

    def _put(self, event: "tuple[int, str, int]", *values: int) -> None:
        """Put an event; ``values``: its fields, with 0 for the two times, which are filled in here, as the
        joints are."""
        number, layout, ticks_at = event
        link = self._link
        at = link.payload()
        pack_into(layout, link.out, at, *values)
        size = calcsize(layout)
        size += self._board.put_snapshot(link.out, at + ticks_at, at + size)
        link.event(number, size)

    def _push_notice(self) -> None:
        link = self._link
        if features.SEQUENCES:
            self.take_failure()
        if self.notice and link.has_space(len(self.notice)):
            at = link.payload()
            link.out[at : at + len(self.notice)] = self.notice
            link.event(self._notice_number, len(self.notice))
            self.notice = b""
