"""Receiving the samples of what was started: in order, each once, missing ones requested again, to its end."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

from armtempo_shared.limits import SAMPLE_TICKS, TICK_HZ

from armtempo.basics.errors import LinkError, OtherBoardError
from armtempo.link.board_messages import (
    Done,
    Event,
    Fault,
    Notice,
    Positions,
    RowBegun,
    Sample,
    SequenceState,
)
from armtempo.link.client import Client

ACKNOWLEDGE_S = 0.25
"""Interval of acknowledgements; they also show the board that the host is alive."""
CHECK_S = 0.5
"""During a motion the board is asked for its status after this time without an event."""
LOOK_S = 0.1
"""Interval at which it is asked for the state of a sequence or program."""
GAP_S = 0.05
"""A missing sample is requested again after this time."""
RESEND = 16
"""Number of samples requested at once."""
MOST_REPEATS = 40
"""Requests without progress (of motion clock or resent samples) after which no more progress is expected."""


_LATE_TICKS = TICK_HZ // 1000
"""Most ticks from the time of a sample to its reading."""
SequenceWatcher = Callable[[SequenceState], object]
"""Called with the state of a sequence or program at each change."""
Followed = Sample | RowBegun | Notice
"""What a follower passes on."""


class Gap(NamedTuple):
    """A range of samples that never arrived, counted from the start, in a sequence through all its motions."""

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


def number_in_run(sample: Sample) -> int:
    """Number of a sample in its run by its time, from 0: one every SAMPLE_TICKS, and one at the end."""
    return -(-max(sample.ticks - _LATE_TICKS, 0) // SAMPLE_TICKS)


class _Progress:
    """Notices that a value which should increase does not."""

    def __init__(self) -> None:
        self._last, self._times = -1, 0

    def stuck(self, value: int) -> bool:
        """Whether it has been the same MOST_REPEATS times."""
        self._times = self._times + 1 if value == self._last else 0
        self._last = value
        return self._times >= MOST_REPEATS


class Follower(ABC):
    """Receives the samples and other events of what was started.

    Its subclasses say when it has ended: a motion by an event, a sequence by its state.
    """

    settle_s = 0.0
    """Events other than samples may come for this time after the end."""

    def __init__(self, client: Client) -> None:
        self.ended = False
        """Whether it has ended and every sample has arrived or is lost."""
        self.heard_s = client.session.clock()
        """When the board has said something new."""
        self._client = client
        self._held: dict[int, Sample] = {}
        self._others: deque[RowBegun | Notice] = deque()
        self._next = 0  # index of the next sample
        self._oldest = 0  # the board has no samples before this one
        self._total = 0  # number of samples that the board took, by its last answer
        self._received = 0
        self._lost: list[Gap] = []
        self._asked_s = self.heard_s
        self._resent = _Progress()

    @property
    def lost(self) -> tuple[Gap, ...]:
        """Samples that are lost, so far."""
        return tuple(self._lost)

    def events(self, between: Callable[[], None] = lambda: None) -> Iterator[Followed]:
        """The samples in order, and other events when they arrive, until the end and all samples.

        ``between`` is called between two messages; it may tell the board to stop. Raises LinkError if the
        connection breaks; a later call continues from there.
        """
        while not self._at_end():
            between()
            wait_s = self._wait_s()
            event = self._client.session.poll(wait_s) if wait_s > 0 else None
            if event is None:
                between()  # a stop request ends the wait
                self._look()
                self.heard_s = self._client.session.clock()
            else:
                self._take(event)
            yield from self._ready()
            self._keep_up()
        yield from self._collect_rest()
        self.ended = True

    @abstractmethod
    def _at_end(self) -> bool:
        """Whether it is known that nothing moves any more."""

    @abstractmethod
    def _wait_s(self) -> float:
        """How long an event may take until ``_look``."""

    @abstractmethod
    def _look(self) -> None:
        """Ask the board."""

    @abstractmethod
    def _is_mine(self, sample: Sample) -> bool:
        """Whether it is of what is followed."""

    def _take(self, event: Event) -> None:
        self.heard_s = self._client.session.clock()
        if isinstance(event, Sample):
            if event.index >= self._next and self._is_mine(event):
                self._held[event.index] = event
        elif isinstance(event, RowBegun | Notice):
            self._others.append(event)

    def _ready(self) -> Iterator[Followed]:
        while self._others:  # a row before the samples of its motion
            yield self._others.popleft()
        while True:
            sample = self._held.pop(self._next, None)
            if sample is not None:
                self._received += 1
            elif self._next < self._oldest:
                self._count_lost()
            else:
                return
            self._next += 1  # now: whoever takes it may fail, and come back for the next one
            if sample is not None:
                yield sample

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

    def _collect_rest(self) -> Iterator[Followed]:
        """After the end: request missing samples until each has arrived or is lost."""
        settled_s = self._client.session.clock() + self.settle_s
        self._request(0)
        while True:
            while (
                event := self._client.session.poll(max(0.0, settled_s - self._client.session.clock()))
            ) is not None:
                self._take(event)
            yield from self._ready()
            if self._resent.stuck(self._next):
                self._oldest = self._total
            elif self._next < self._total:
                self._request(RESEND)
            else:
                self._request(0)  # the last acknowledgement
                return


class MotionFollower(Follower):
    """Follows the motion of run number ``run``."""

    def __init__(self, client: Client, run: int) -> None:
        super().__init__(client)
        self._run = run
        self._last: Done | Fault | None = None
        self._notices: list[str] = []
        self._clock = _Progress()

    @property
    def end(self) -> RunEnd:
        """How the run ended; raises LinkError before its end."""
        if not self.ended or self._last is None:
            raise LinkError("the run has not ended yet", "read all samples first")
        last = self._last
        fault, joint = (last.code, last.joint) if isinstance(last, Fault) else (0, 255)
        notices = tuple(self._notices)
        return RunEnd(
            fault, joint, last.ticks, last.path_ticks, last.positions, self._received, self.lost, notices
        )

    def samples(self, between: Callable[[], None] = lambda: None) -> Iterator[Sample]:
        """The samples alone, see ``events``."""
        return (event for event in self.events(between) if isinstance(event, Sample))

    def _at_end(self) -> bool:
        return self._last is not None

    def _wait_s(self) -> float:
        return CHECK_S

    def _is_mine(self, sample: Sample) -> bool:
        return sample.run == self._run

    def _take(self, event: Event) -> None:
        super()._take(event)
        if isinstance(event, Done | Fault) and event.run == self._run:
            self._last = event
        elif isinstance(event, Notice):
            self._notices.append(event.text)

    def _look(self) -> None:
        status = self._client.status()
        self._asked_s = self._client.session.clock()
        if status.run == self._run and not status.moving:
            if status.state == "fault":
                self._last = status.as_fault()
            else:
                self._last = Done(
                    status.run, status.ticks, status.path_ticks, 0, status.samples_lost, status.positions
                )
        elif self._clock.stuck(status.ticks):
            raise LinkError(
                "the board says that it moves, but its motion clock does not advance",
                "press its reset button, then 'armtempo home'",
            )


class SequenceFollower(Follower):
    """Follows a sequence or program by its name in the board's state, whose motions have runs after number ``before``.

    Its samples have the numbers that they have in their motion's run.
    """

    settle_s = LOOK_S

    def __init__(self, client: Client, name: str, before: int, watcher: SequenceWatcher) -> None:
        super().__init__(client)
        self._name = name
        self._before = self._run = before
        self._first = 0  # index of the first sample of ``_run``
        self._watcher = watcher
        self._state: SequenceState | None = None
        self._looked_s = -LOOK_S

    @property
    def end(self) -> SequenceState:
        """How it ended; raises LinkError before its end."""
        if not self.ended or self._state is None:
            raise LinkError("the sequence has not ended yet", "read all samples first")
        return self._state

    def _at_end(self) -> bool:
        return self._state is not None and self._state.ending != "running"

    def _wait_s(self) -> float:
        return self._looked_s + LOOK_S - self._client.session.clock()

    def _is_mine(self, sample: Sample) -> bool:
        return sample.run > self._before

    def _ready(self) -> Iterator[Followed]:
        for event in super()._ready():
            if isinstance(event, Sample):
                if event.run != self._run:
                    self._run, self._first = event.run, event.index - number_in_run(event)
                event = replace(event, index=event.index - self._first)
            yield event

    def _look(self) -> None:
        state = self._client.sequence()
        self._looked_s = self._client.session.clock()
        if state.name != self._name or state.ending == "none":
            last = f"; last known state: {where(self._state)}" if self._state else ""
            raise OtherBoardError(
                f"the board has restarted during the run: positions are unknown{last}",
                "move the arm to its home posture and run 'armtempo home'",
            )
        if state != self._state:
            self._state = state
            self._watcher(state)


def where(state: SequenceState) -> str:
    """Describe step and cycle."""
    from armtempo.model.steps import position  # here, because moves have no steps

    return f"in {position(state.step, state.cycle)}"
