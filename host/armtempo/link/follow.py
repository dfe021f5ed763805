"""Receiving the samples of a run: in order, each once, missing ones requested again, to its end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

from armtempo.basics.errors import LinkError
from armtempo.link.board_messages import Done, Event, Fault, Notice, Positions, Sample
from armtempo.link.client import Client

ACKNOWLEDGE_S = 0.25
"""Interval of acknowledgements; they also show the board that the host is alive."""
CHECK_S = 0.5
"""The board is asked for its status after this time without an event."""
GAP_S = 0.05
"""A missing sample is requested again after this time."""
RESEND = 16
"""Number of samples requested at once."""
MOST_REPEATS = 40
"""Requests without progress (of motion clock or resent samples) after which no more progress is expected."""


class Gap(NamedTuple):
    """A range of samples that never arrived."""

    first: int
    """Index of the first one."""
    number: int
    """Number of samples."""


@dataclass(frozen=True)
class RunEnd:
    """How a run ended."""

    fault: int
    """0, or a code of ``wire.ERRORS``."""
    fault_joint: int
    ticks: int
    """The motion clock at the end."""
    path_ticks: int
    """The motion's own time at the end."""
    positions: Positions
    received: int
    """Number of samples that arrived."""
    lost: tuple[Gap, ...]
    """Samples that are lost."""
    notices: tuple[str, ...] = ()
    """Texts from the board, such as the traceback of an exception in its program."""

    @property
    def samples_lost(self) -> int:
        """Number of lost samples."""
        return sum(gap.number for gap in self.lost)


class Follower:
    """Receives the samples of run number ``run``."""

    def __init__(self, client: Client, run: int) -> None:
        self._end: RunEnd | None = None
        self._client = client
        self._run = run
        self._held: dict[int, Sample] = {}
        self._next = 0  # index of the next sample
        self._oldest = 0  # the board has no samples before this one
        self._total = 0  # number of samples that the board took, by its last answer
        self._received = 0
        self._lost: list[Gap] = []
        self._last: Done | Fault | None = None
        self._notices: list[str] = []
        self._asked_s = client.session.clock()
        # Last value that should increase (motion clock, sample index), and how often it did not
        self._progress = (
            -1,
            0,
        )

    @property
    def ended(self) -> bool:
        """Whether the run has ended and every sample has arrived or is lost."""
        return self._end is not None

    @property
    def end(self) -> RunEnd:
        """How the run ended; raises LinkError before its end."""
        if self._end is None:
            raise LinkError("the run has not ended yet", "read all samples first")
        return self._end

    def samples(self, between: Callable[[], None] = lambda: None) -> Iterator[Sample]:
        """The samples in order, until the run has ended and each has arrived or is lost.

        ``between`` is called between two messages; it may tell the board to stop. Raises LinkError if the
        connection breaks; a later call continues from there.
        """
        while self._last is None:
            between()
            event = self._client.session.poll(CHECK_S)
            if event is None:
                between()  # a stop request ends the wait
                self._ask_status()
            else:
                self._take(event)
            yield from self._ready()
            self._keep_up()
        yield from self._collect_rest()
        self._end = self._run_end(self._last)

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
        last = self._lost[-1] if self._lost else None
        if last is not None and last.first + last.number == self._next:
            self._lost[-1] = Gap(last.first, last.number + 1)
        else:
            self._lost.append(Gap(self._next, 1))

    def _keep_up(self) -> None:
        """Acknowledge at intervals; sooner, and with a request, if a sample is missing."""
        waited_s = self._client.session.clock() - self._asked_s
        if waited_s >= (GAP_S if self._held else ACKNOWLEDGE_S):
            self._request(min(self._held) - self._next if self._held else 0)

    def _request(self, missing: int) -> None:
        kept = self._client.samples(self._next, min(missing, RESEND))
        self._asked_s = self._client.session.clock()
        events = self._client.session.events
        while events:  # received before the answer; the board may have dropped them since
            self._take(events.popleft())
        self._oldest = max(self._oldest, kept.first)
        self._total = kept.first + kept.count

    def _collect_rest(self) -> Iterator[Sample]:
        """After the end: request missing samples until each has arrived or is lost."""
        self._request(0)
        while True:
            while (event := self._client.session.poll(0.0)) is not None:
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
        status = self._client.status()
        self._asked_s = self._client.session.clock()
        if status.run == self._run and not status.moving:
            if status.state == "fault":
                self._last = status.as_fault()
            else:
                self._last = Done(
                    status.run, status.ticks, status.path_ticks, 0, status.samples_lost, status.positions
                )
        elif self._stuck(status.ticks):
            raise LinkError(
                "the board says that it moves, but its motion clock does not advance",
                "press its reset button, then 'armtempo home'",
            )

    def _stuck(self, value: int) -> bool:
        """Whether ``value``, which should increase, has been the same MOST_REPEATS times."""
        before, times = self._progress
        self._progress = (value, times + 1 if value == before else 0)
        return self._progress[1] >= MOST_REPEATS

    def _run_end(self, last: Done | Fault) -> RunEnd:
        fault, joint = (last.code, last.joint) if isinstance(last, Fault) else (0, 255)
        lost, notices = tuple(self._lost), tuple(self._notices)
        return RunEnd(
            fault, joint, last.ticks, last.path_ticks, last.positions, self._received, lost, notices
        )
