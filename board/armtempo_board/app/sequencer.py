"""Runs a sequence: executes its rows between motions, in the main loop.

``sequence_start`` has checked everything that it names.
"""

import gc
import time
from array import array

from armtempo_shared import codes, messages, sequence
from micropython import const

from armtempo_board import heap
from armtempo_board.app.sequence_command import (
    CODE,
    CYCLE,
    ENDING,
    PASSED,
    ROW,
    RUN,
    STEP,
    VALUE,
    SequenceCommand,
)
from armtempo_board.errors import Refused

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any, Protocol

    from armtempo_shared.motion import MotionHead

    from armtempo_board.app.board import Board
    from armtempo_board.storage.sequence_file import SequenceFile

    class Runner(Protocol):
        """Interface of the object that runs the motions, see ``controller.Controller``."""

        board: Board
        sequence: Any
        program: Any
        run_number: int

        def load(self, name: str, crc: "int | None" = None) -> MotionHead: ...

        def release_memory(self) -> None: ...

        def home(self, mask: int, steps: "Sequence[int]") -> None: ...

        def begin_motion(self, name: str, crc: "int | None", rate: int, flags: int = 0) -> None: ...

        def stop(self, now: int) -> None: ...

        def brake(self, now: int) -> None: ...

        def start_loaded(self, motion: MotionHead, flags: int) -> None: ...


_OP, _NUMBER, _AMOUNT, _STEP_OF_ROW = const(0), const(1), const(3), const(4)  # of a row
_MOST = const(0x3FFFFFFF)  # that a counter reaches; a larger number would take memory


class Place:
    """A place in the rows: ``next`` is the next row, within the repeats that have begun."""

    def __init__(self) -> None:
        self.next = 0
        self._first = array("i", [0] * sequence.MAX_NESTING)  # first row of each repeat that has begun
        self._left = array("i", [0] * sequence.MAX_NESTING)  # passes left, 0: for ever
        self._depth = 0

    def copy(self, other: "Place") -> None:
        """Move to the same place as ``other``."""
        self.next = other.next
        self._depth = other._depth
        for depth in range(self._depth):
            self._first[depth] = other._first[depth]
            self._left[depth] = other._left[depth]

    def advance(self, row: "tuple[int, ...]") -> None:
        """Move to the place after ``row``."""
        self.next += 1
        op = row[_OP]
        if op == sequence.REPEAT:
            self._first[self._depth] = self.next
            self._left[self._depth] = row[_AMOUNT]
            self._depth += 1
        elif op == sequence.END:  # from the first row of the repeat again, or after it
            inner = self._depth - 1
            left = self._left[inner] - 1
            if left:  # below 0: for ever
                self.next = self._first[inner]
                self._left[inner] = max(left, 0)
            else:
                self._depth = inner


class Sequencer:
    """``status`` is its state, also after its end; indices are in ``sequence_command``."""

    start_bytes = 22_000
    """Heap for the start of a motion, and for garbage while one runs (docs/memory.md)."""

    def __init__(self, controller: "Runner", record: "SequenceFile", name: bytes, rate: int) -> None:
        self._controller = controller
        self._record = record
        self._rate = rate  # rate of the motions' own time, in thousandths
        self._row: "tuple[int, ...]" = (0, 0, 0, 0, 0)  # the present row
        self._place = Place()  # after it
        self._checked = 0  # motions whose splines were checked in this run
        self.status = array("i", [sequence.RUNNING] + [0] * VALUE)
        self.stopping = False
        self._command = SequenceCommand(
            self.status, name, [record.counter(number) for number in range(record.counters)]
        )
        self.tell = self._command.tell

    def begin(self) -> None:
        """Begin with the next pass; raises Refused if the heap has no space for a motion."""
        controller = self._controller
        controller.release_memory()
        free = gc.mem_free() if hasattr(gc, "mem_free") else self.start_bytes
        if free < self.start_bytes:
            controller.sequence = None
            raise Refused(codes.NO_SEQUENCE_MEMORY, value=self.start_bytes - free)
        heap.collect_often(heap.OFTEN if controller.board.engine_memory.is_short else heap.SELDOM)
        self._command.attach(controller.board.extra_commands)

    def change_rate(self, rate: int) -> None:
        """As ``Engine.change_rate``, also for the following motions."""
        engine = self._controller.board.engine
        is_pause = rate in (0, messages.RESUME)  # or its end
        if engine.moving:
            engine.change_rate(rate if is_pause else self._share(rate))
        elif is_pause:
            raise Refused(codes.NOT_MOVING)
        if not is_pause:
            self._rate = rate

    def _share(self, rate: int) -> int:
        """The rate of the present motion, of a rate for all."""
        return rate

    def prepare(self) -> None:
        """Called during a motion; does nothing here, see ``sequence_ahead``."""

    def advance(self) -> None:
        """Called while nothing moves: end, continue to wait, or execute the next row."""
        controller = self._controller
        if controller.board.fault():
            return self._end(sequence.FAULTED, controller.board.fault())
        if self.stopping:
            return self._end(sequence.STOPPED)
        if not self._is_over():
            return None
        if self._place.next == self._record.rows:
            return self._end(sequence.FINISHED)
        try:
            return self._do() if self._checked == self._record.motions else self._check()
        except Refused as refused:
            return self._end(sequence.REFUSED, refused.code)
        except OSError:
            return self._end(sequence.REFUSED, codes.FLASH_ERROR)

    def _check(self) -> None:
        """Check the splines of a motion once, before any moves: its record (its checksum is compared each
        time) and the arm cannot change during the sequence.
        """
        record = self._record
        name, crc = record.motion(self._checked)
        try:
            engine = self._controller.board.engine
            engine.check_splines(self._controller.load(name, crc))
        except Refused:
            for self.status[ROW] in range(record.rows):
                row = record.row(self.status[ROW])
                if row[_OP] == sequence.MOVE and row[_NUMBER] == self._checked:
                    self.status[STEP] = row[_STEP_OF_ROW]
                    break
            raise
        self._checked += 1

    def _do(self) -> None:
        """Execute the next row."""
        self._row = self._record.row(self._place.next)
        self.status[STEP] = self._row[_STEP_OF_ROW]
        self.status[ROW] = self._place.next
        self.status[VALUE] = 0
        self._place.advance(self._row)
        self._since_ms = time.ticks_ms()  # start time of the row
        op, number, value, _, _ = self._row
        if op == sequence.MOVE:
            self._move(number)
        elif op == sequence.OUTPUT:
            self._controller.board.outputs.set(number, value)
        elif op in (sequence.REPEAT, sequence.END):
            self.status[CYCLE] = (self.status[CYCLE] + value) & _MOST
        elif op == sequence.COUNT:
            self.status[VALUE] = self._command.count(number)
        self.status[RUN] = self._controller.run_number
        self.status[PASSED] = (self.status[PASSED] + 1) & _MOST

    def _move(self, number: int) -> None:
        """Begin a motion."""
        name, crc = self._record.motion(number)
        engine = self._controller.board.engine
        engine.skip_check = True
        try:
            self._controller.begin_motion(name, crc, self._rate)
        finally:
            engine.skip_check = False

    def _is_over(self) -> bool:
        """Whether the present row is done; a motion is, as nothing moves."""
        op, number, value, amount, _ = self._row
        if op != sequence.WAIT and op != sequence.WAIT_INPUT:
            return True
        late = time.ticks_diff(time.ticks_ms(), self._since_ms) >= amount
        if op == sequence.WAIT:
            return late
        if self._controller.board.inputs.level(number) == value & sequence.ACTIVE:
            return True
        if not late or not amount:
            return False
        return self._time_out(value & ~sequence.ACTIVE)

    def _time_out(self, then: int) -> bool:
        if then == sequence.STOP_THEN:
            self._end(sequence.TIMED_OUT)
        elif then == sequence.FAULT_THEN:
            self._controller.board.pending = codes.INPUT_TIMEOUT  # the next pass ends it
        return then == sequence.NEXT_THEN

    def _end(self, ending: int, code: int = 0) -> None:
        self.status[ENDING] = ending
        self.status[CODE] = code
        self._controller.sequence = None
        heap.collect_often()
