"""A sequence that prepares its next motion during the running one, to start it without delay.

Used if the heap has space when the sequence begins; otherwise the next motion is opened and loaded between two
motions. Not part of the program in files, which has no space for sequences.
"""

import gc
from array import array

from armtempo_shared import sequence
from armtempo_shared.engine_memory import ahead_bytes
from armtempo_shared.limits import MOST_STEPS
from armtempo_shared.motion import MotionError
from micropython import const

from armtempo_board.app.sequencer import Place, Sequencer
from armtempo_board.errors import Refused
from armtempo_board.motion import endpoints
from armtempo_board.motion.next_motion import NextMotion
from armtempo_board.storage import store

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Generator, Iterator
    from typing import Any

    from armtempo_shared.motion import MotionHead

_OP, _NUMBER = const(0), const(1)  # of a row
_NONE = const(-1)
_BESIDE_BYTES = const(10_000)
"""Free heap needed: 2 200 bytes for the motions' other needs, the rest for garbage between two collections."""


class AheadSequencer(Sequencer):
    """See ``Sequencer`` for its arguments."""

    _prepared: "NextMotion | None" = None  # None: the heap has no space
    _is_full = False  # the heap has no more space
    _work: "Iterator[None] | None" = None  # remaining work for the next motion
    _prepared_index = _running_index = _NONE  # the prepared motion, and the motion that was begun last
    _at_rate = 0  # rate for which it is prepared

    def begin(self) -> None:
        """As ``Sequencer.begin``; decides whether motions are prepared."""
        super().begin()
        controller = self._controller
        joints = controller.board.joints
        gc.collect()
        if hasattr(gc, "mem_free") and gc.mem_free() < _BESIDE_BYTES + ahead_bytes(joints):
            return
        try:
            ends = array("i", [MOST_STEPS] * (self._record.motions * joints))
            self._prepared = NextMotion(controller.board.engine)
            self._ends = ends  # observed end of each motion, steps; MOST_STEPS: not yet
        except MemoryError:  # the heap has no such block
            self._prepared = None

    def prepare(self) -> None:
        """Called during a motion: continue preparing the next one, if there is time."""
        self._replan_if_rate_changed()
        if self._work and self._prepared and not self.stopping and self._prepared.has_time():
            self._do_slice()
            self._controller.board.engine.refill()

    def advance(self) -> None:
        """See ``Sequencer``; also prepares during a wait."""
        super().advance()
        self._replan_if_rate_changed()
        if self._work and not self._controller.board.engine.moving:
            self._do_slice()

    def _do_slice(self) -> None:
        """Do a slice of the work. After a refusal the preparation ends; the motion is then opened between the
        motions."""
        work: "Any" = self._work
        try:
            next(work)
        except StopIteration:
            self._work = None
        except (Refused, MotionError, OSError):
            self._drop()
        except MemoryError:
            self._drop()
            self._is_full = True

    def _replan_if_rate_changed(self, number: int = _NONE) -> None:
        """Plan again if the rate has changed; ``number`` as in ``_plan``."""
        if self._running_index != _NONE and self._at_rate != self._rate:
            self._plan(number)

    def _plan(self, number: int = _NONE) -> None:
        """Prepare the motion ``number``; _NONE: the next one in the sequence."""
        place = Place()
        place.copy(self._place)  # now: the work may begin when it has gone on
        self._prepared_index = _NONE
        self._at_rate = self._rate
        self._work = self._pieces(place, number) if self._prepared and not self._is_full else None

    def _drop(self) -> None:
        """Drop the prepared motion."""
        self._work = None
        self._prepared_index = _NONE
        if self._prepared:
            self._prepared.close()

    def _pieces(self, place: Place, number: int) -> "Iterator[None]":
        """See ``NextMotion.pieces``; ``number`` as in ``_plan``."""
        if number == _NONE:
            number = yield from self._search(place)
        if number != _NONE and self._prepared:
            yield from self._prepared.pieces(self._rate, lambda: self._open(number), self._stands_at)
            self._prepared_index = number

    def _search(self, place: Place) -> "Generator[None, None, int]":
        """Find the next motion, without executing the rows before it; _NONE: none, or too far away."""
        record = self._record
        for _ in range(sequence.MAX_ROWS):
            yield
            if place.next == record.rows:
                break
            row = record.row(place.next)
            if row[_OP] == sequence.MOVE:
                return row[_NUMBER]
            place.advance(row)
        return _NONE

    def _open(self, number: int) -> "MotionHead":
        board = self._controller.board
        name, crc = self._record.motion(number)
        return board.checked(store.Store(board.root, recover=False).motion(name), crc)

    def _stands_at(self, motion: "MotionHead", joint: int) -> int:
        """Position of a joint before the motion, in steps."""
        engine = self._controller.board.engine
        if not engine.moving:
            return int(engine.commanded(joint))
        end = self._ends[self._running_index * self._controller.board.joints + joint]
        return endpoints.start_offset(motion, joint, 0) if end == MOST_STEPS else end

    def _move(self, number: int) -> None:
        """Begin a motion; uses the prepared one if it is the right one."""
        self._note_end()
        self._replan_if_rate_changed(number)
        while self._work:  # nothing moves now
            self._do_slice()
        self._running_index = number
        if self._prepared and self._prepared_index == number and self._prepared.starts_from_here():
            motion = self._prepared.motion
            self._controller.board.engine.load(motion, self._rate, self._prepared)
            self._controller.start_loaded(motion, 0)
            self._drop()
        else:
            self._drop()
            super()._move(number)
        self._plan()

    def _note_end(self) -> None:
        """Note the end position of the last motion: a posture between two steps can end at either."""
        if self._running_index != _NONE and self._prepared:
            joints = self._controller.board.joints
            for joint in range(joints):
                self._ends[self._running_index * joints + joint] = self._controller.board.engine.commanded(
                    joint
                )

    def _end(self, ending: int, code: int = 0) -> None:
        self._drop()
        if self._prepared:
            self._prepared.give_back()
            self._prepared = None
        super()._end(ending, code)
