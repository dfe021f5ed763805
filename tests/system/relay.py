"""A cable between host and virtual board that can be bad, cut or pulled; random held jogs over it, however ended."""

from __future__ import annotations

import os
import random
import select
import threading
import time
import tty
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import armtempo
from armtempo.basics.errors import InputError, LinkError
from armtempo.link.board_messages import Event, Sample, Status
from armtempo.link.traffic import TO_BOARD, Chunk
from armtempo.robot import jog
from armtempo.robot.board import Board
from armtempo.simulator import LaunchOptions, launch
from armtempo_shared.limits import TICK_HZ

Way = Callable[[bytes], tuple[bytes, float]]
"""Gets what is sent, gives what arrives (and a delay, not used here)."""
_LOOK_S = 0.02


class Relay:
    """Carries bytes between ``device``, a virtual board's port, and a port of its own at ``path``."""

    def __init__(self, device: str, path: Path, to_board: Way, from_board: Way) -> None:
        self.port = str(path)
        self._ways = (to_board, from_board)
        self._board = os.open(device, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._board)
        self._host = -1
        self._out = threading.Event()
        self._gone = threading.Event()
        self._lock = threading.Lock()
        self.plug()
        self._thread = threading.Thread(target=self._carry)
        self._thread.start()

    def plug(self) -> None:
        """Put the cable in: the port is there."""
        with self._lock:
            self._host, slave = os.openpty()
            tty.setraw(slave)
            os.symlink(os.ttyname(slave), self.port)
            self._slave = slave

    def unplug(self) -> None:
        """Pull the cable: the port is gone, for all that have it open as well."""
        with self._lock:
            os.unlink(self.port)
            os.close(self._slave)
            os.close(self._host)
            self._host = -1

    def _carry(self) -> None:
        while not self._gone.is_set():
            with self._lock:
                ends = [self._board] + [self._host] * (self._host >= 0)
                ready = select.select(ends, [], [], _LOOK_S)[0]
                for end in ready:
                    self._pass_on(end)

    def _pass_on(self, end: int) -> None:
        data = os.read(end, 4096)
        arrives, _ = self._ways[end == self._board](data)
        other = self._host if end == self._board else self._board
        while arrives and other >= 0:
            arrives = arrives[os.write(other, arrives) :]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        self._gone.set()
        self._thread.join()
        if self._host >= 0:
            self.unplug()
        os.close(self._board)


class ReplayTransport:
    """A transport whose board says what a recorded board said.

    The host must say the same as in the recording (same session number, see Session); LinkError if
    it says something else or the recording is at its end.
    """

    name = "replay"

    def __init__(self, chunks: Iterable[Chunk]) -> None:
        self._chunks = deque(chunks)

    def read(self, timeout_s: float) -> bytes:
        """The recorded board's next bytes, if it spoke before the host's next word."""
        if self._chunks and self._chunks[0].direction != TO_BOARD:
            return self._chunks.popleft().data
        return b""

    def write(self, data: bytes) -> None:
        """Take the host's bytes as the next recorded ones; what the board said before is dropped unread."""
        while self._chunks and self._chunks[0].direction != TO_BOARD:
            self._chunks.popleft()
        expected = self._chunks.popleft().data if self._chunks else b""
        if data != expected:
            raise LinkError(
                f"replay: the recording has {expected.hex()!r} where the host says {data.hex()!r}"
            )

    def wake(self) -> None:
        """See Transport."""

    def close(self) -> None:
        """Nothing to free."""


# random held jogs near the ends of the ranges: released, fallen silent, cut off, or held to the end


KINDS = ("release", "silence", "cut", "end")
CUT_S = 1.4
_ARM = armtempo.Arm.paper()


class Cable:
    """Carries everything, or nothing."""

    def __init__(self) -> None:
        self.cut = False

    def __call__(self, data: bytes) -> tuple[bytes, float]:
        return (b"" if self.cut else data), 0.0


@dataclass(frozen=True)
class HeldCase:
    """What is held, and how that ends."""

    kind: str
    start_deg: tuple[float, ...]
    joint: int | None
    axis: str | None
    direction: int
    speed: float
    held_s: float

    @classmethod
    def random(cls, rng: random.Random) -> HeldCase:
        """One near the end of a range."""
        start = [rng.uniform(0.0, 60.0), rng.uniform(-90.0, -40.0), rng.uniform(10.0, 60.0)]
        joint = rng.choice([0, 1, 2, None])
        direction = rng.choice([-1, 1])
        if joint is not None:
            low, high = _ARM.driven[joint].range_deg
            away_deg = 10 ** rng.uniform(-1.3, 1.4)
            start[joint] = max(low, min(high, low + away_deg if direction < 0 else high - away_deg))
        kind = rng.choices(KINDS, (5, 2, 2, 1))[0]
        axis = rng.choice("xyz") if joint is None else None
        speed = rng.choice([0.05, 0.1, 0.25, 0.25, 0.5, 1.0])
        number = None if joint is None else joint + 1
        return cls(kind, tuple(start), number, axis, direction, speed, rng.uniform(0.0, 1.0))


@dataclass(frozen=True)
class HeldEnd:
    """How it ended."""

    took_s: float
    """On the board's clock, from the moment it was released (of a jog that ended itself: 0)."""
    stated_s: float
    """Within which it was to be at rest."""
    within: bool
    """Whether every joint was within its range in every sample and at the end."""
    rests: bool
    known: bool
    """Whether the position is known."""

    @property
    def good(self) -> bool:
        """All that must hold."""
        return self.took_s <= self.stated_s and self.within and self.rests and self.known


def _seconds(since: Status | None, now: Status) -> float:
    """By the board's clock; 0 if there is no beginning."""
    return (now.ticks - since.ticks) / TICK_HZ if since else 0.0


class HeldJogs:
    """A virtual board behind a cable."""

    def __init__(self, board: Board, to_board: Cable, from_board: Cable) -> None:
        self._board = board
        self._cables = (to_board, from_board)
        self._beyond = False
        board.client.session.listen(self._heard)

    @classmethod
    @contextmanager
    def open(cls, folder: Path) -> Iterator[HeldJogs]:
        """Ready for cases."""
        to_board, from_board = Cable(), Cable()
        with (
            launch(LaunchOptions(arm=_ARM)) as virtual,
            Relay(virtual.port, folder / "port", to_board, from_board) as relay,
            armtempo.connect(relay.port, _ARM) as board,
        ):
            board.home(_ARM)
            yield cls(board, to_board, from_board)

    def run(self, case: HeldCase) -> HeldEnd | None:
        """Do it; None if there is no way to go, or the board answered too late while it was still to be held."""
        board = self._board
        board.home(_ARM, case.start_deg)
        self._beyond = False
        try:
            held = board.held_jog(case.joint, case.axis, case.direction, speed=case.speed)
        except InputError:
            return None
        told = case.kind == "release"
        let_go: Status | None = None
        with suppress(LinkError), held:
            until_s = time.monotonic() + (60.0 if case.kind == "end" else case.held_s)
            while held.hold(0.02) and time.monotonic() < until_s:
                pass
            let_go = board.status()
            if let_go.moving:
                self._let_go(case.kind, held)
        self._cut(False)
        stated_s = jog.rest_s(held.motion, stopped=told)
        while (end := board.status()).moving and _seconds(let_go, end) <= stated_s:
            time.sleep(0.01)  # a busy machine's board may be late, by its own clock it is not
        self._look(end.positions.commanded_steps)
        if let_go is None and not self._beyond:
            return None
        took_s = _seconds(let_go, end)
        return HeldEnd(took_s, stated_s, not self._beyond, end.state == "idle", end.known == 0b111)

    def _let_go(self, kind: str, held: jog.HeldJog) -> None:
        if kind == "silence":
            while self._board.status().moving:
                time.sleep(0.05)
        elif kind == "cut":
            self._cut(True)
            timer = threading.Timer(CUT_S, self._cut, (False,))
            timer.start()
            try:
                while held.hold(0.05):
                    pass
            finally:
                timer.join()

    def _cut(self, cut: bool) -> None:
        for cable in self._cables:
            cable.cut = cut

    def _heard(self, event: Event) -> None:
        if isinstance(event, Sample):
            self._look(event.positions.commanded_steps)

    def _look(self, steps: tuple[int, ...]) -> None:
        for joint, count in zip(_ARM.driven, steps, strict=True):
            low, high = joint.range_deg
            if not low - 1e-9 <= count / joint.steps_per_deg <= high + 1e-9:
                self._beyond = True
