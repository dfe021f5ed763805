"""Following one run: its samples in order, each once, the missing ones asked for again, to its end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from armtempo.errors import LinkError
from armtempo.link.board import Board
from armtempo.link.messages import Done, Event, Fault, Notice, Sample, Stand

ACKNOWLEDGE_S = 0.25
"""Acknowledging this often also tells the board that the host is still there."""
CHECK_S = 0.5
"""Nothing heard for so long: ask what the board is doing."""
GAP_S = 0.05
"""So long may a missing sample be on its way before it is asked for."""
RESEND = 16
"""So many samples are asked for at once."""
FUTILE = 40
"""What has not moved on after so many questions (motion clock, resent samples) never will."""


@dataclass(frozen=True)
class RunEnd:
    """How a run ended."""

    fault: int
    """0, or a code of ``wire.ERRORS``."""
    fault_joint: int
    ticks: int
    """The motion clock at the end."""
    stand: Stand
    received: int
    """Samples that arrived."""
    lost: tuple[tuple[int, int], ...]
    """Samples that never will: (first index, number) of each gap."""
    notices: tuple[str, ...] = ()
    """What the board had to say: the traceback of a failure in its program, for one."""

    @property
    def samples_lost(self) -> int:
        """How many samples never arrived."""
        return sum(count for _, count in self.lost)


class Follower:
    """Receives the samples of run number ``run``; ``end`` is set when all is in."""

    def __init__(self, board: Board, run: int) -> None:
        self.end: RunEnd | None = None
        self._board = board
        self._run = run
        self._held: dict[int, Sample] = {}
        self._next = 0  # index of the sample that comes next
        self._oldest = 0  # the board keeps none before this one
        self._total = 0  # samples taken so far, as far as the board has told
        self._received = 0
        self._lost: list[tuple[int, int]] = []
        self._last: Done | Fault | None = None
        self._notices: list[str] = []
        self._asked_s = board.session.clock()
        self._progress = (-1, 0)  # what should move on (motion clock, sample number); how often it did not

    def samples(self, between: Callable[[], None] = lambda: None) -> Iterator[Sample]:
        """The samples in order until the run has ended and all that can be had has arrived.

        ``between`` is called between two messages; it may tell the board to stop. Raises LinkError where
        the connection breaks; a later call goes on from there.
        """
        while self._last is None:
            between()
            event = self._board.session.poll(CHECK_S)
            if event is None:
                self._ask_status()
            else:
                self._take(event)
            yield from self._ready()
            self._keep_up()
        yield from self._collect_rest()
        self.end = self._run_end(self._last)

    def _take(self, event: Event) -> None:
        if isinstance(event, Sample) and event.run == self._run:
            if event.index >= self._next:
                self._held[event.index] = event
        elif isinstance(event, Done | Fault) and event.run == self._run:
            self._last = event
        elif isinstance(event, Notice):
            self._notices.append(event.text)

    def _ready(self) -> Iterator[Sample]:
        while True:
            if self._next in self._held:
                self._received += 1
                yield self._held.pop(self._next)
            elif self._next < self._oldest:
                self._count_lost()
            else:
                return
            self._next += 1

    def _count_lost(self) -> None:
        first, count = self._lost[-1] if self._lost else (0, 0)
        if first + count == self._next and count:
            self._lost[-1] = (first, count + 1)
        else:
            self._lost.append((self._next, 1))

    def _keep_up(self) -> None:
        """Acknowledge now and then; soon, and with a request, where a sample is missing."""
        waited_s = self._board.session.clock() - self._asked_s
        if waited_s >= (GAP_S if self._held else ACKNOWLEDGE_S):
            self._request(min(self._held) - self._next if self._held else 0)

    def _request(self, missing: int) -> None:
        first, count = self._board.samples(self._next, min(missing, RESEND))
        self._asked_s = self._board.session.clock()
        events = self._board.session.events
        while events:  # they came before the answer, and may be what the board has let go since
            self._take(events.popleft())
        self._oldest = max(self._oldest, first)
        self._total = first + count

    def _collect_rest(self) -> Iterator[Sample]:
        """What is still missing after the end: asked for until all that the board took is here or lost."""
        self._request(0)
        while True:
            while (event := self._board.session.poll(0.0)) is not None:
                self._take(event)
            yield from self._ready()
            if self._stuck(self._next):
                self._oldest = self._total
            elif self._next < self._total:
                self._request(RESEND)
            else:
                self._request(0)  # the last acknowledgement
                return

    def _ask_status(self) -> None:
        status = self._board.status()
        self._asked_s = self._board.session.clock()
        if status.run == self._run and not status.moving:
            if status.state == "fault":
                self._last = Fault(status.run, status.fault, status.fault_joint, status.ticks, status.stand)
            else:
                self._last = Done(status.run, status.ticks, 0, status.samples_lost, status.stand)
        elif self._stuck(status.ticks):
            raise LinkError("the board says that it moves, but its motion clock stands still; reset it")

    def _stuck(self, value: int) -> bool:
        """Whether ``value``, which should move on, has been the same FUTILE times."""
        before, times = self._progress
        self._progress = (value, times + 1 if value == before else 0)
        return self._progress[1] >= FUTILE

    def _run_end(self, last: Done | Fault) -> RunEnd:
        fault, joint = (last.code, last.joint) if isinstance(last, Fault) else (0, 255)
        lost, notices = tuple(self._lost), tuple(self._notices)
        return RunEnd(fault, joint, last.ticks, last.stand, self._received, lost, notices)
