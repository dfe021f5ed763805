"""A board in the same process: the real link, store and commands of the board program, a stand-in engine.

Host and board share one clock that only waiting moves on, so time-outs cost no time.
"""

from __future__ import annotations

import random
import sys
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import patch

from armtempo.basics.errors import LinkError
from armtempo.encoding.encoded_plan import MotionKey
from armtempo.link import Client, greet
from armtempo.link.board_messages import Sample
from armtempo.link.follow import MotionFollower, RunEnd
from armtempo.link.session import Session
from armtempo.robot import running
from armtempo.robot.stop_request import StopRequest
from armtempo_shared import motion, wire

from tests.board.scripts.rigs import stand_in

SHIMS = Path(__file__).parents[1] / "host" / "armtempo" / "simulator" / "cpython"
FAULTS = ("lose", "double", "flip", "delay", "cut")
_DELAY_S = 0.03
_SAMPLE_S = 0.1
_TURNS = 3
_IMPORTED_LATER = (
    "armtempo_board.heap",
    "armtempo_board.motion.arm_check",
    "armtempo_board.motion.endpoints",
    "armtempo_board.storage.motion_file",
    "armtempo_board.storage.store",
    "armtempo_board.app.memory_shares",
    "armtempo_board.app.arm_setup",
    "armtempo_board.app.store_commands",
    "armtempo_board.app.sequence_start",
    "armtempo_board.storage.sequence_file",
)
_FOR_LATER = (*_IMPORTED_LATER, "gc", "os")
"""What the program finds where it imports later, as it did at first."""
_USB_BUFFER = 1024
_STEP_S = 0.01


@contextmanager
def board_modules() -> Iterator[None]:
    """Within it the board program imports stand-ins for hardware and engine; nothing of it stays."""
    with patch.dict(sys.modules), patch.object(sys, "path", [str(SHIMS), *sys.path]):
        for name in [name for name in sys.modules if name.split(".")[0] == "armtempo_board"]:
            del sys.modules[name]  # a package that stays would have modules of before as its attributes
        stand_in.install()
        yield


@contextmanager
def _importable(modules: dict[str, ModuleType]) -> Iterator[None]:
    """Within it the program finds these where it imports them; quicker than ``patch.dict``, for each turn does it."""
    held = {name: sys.modules[name] for name in modules if name in sys.modules}
    size = len(sys.modules)
    sys.modules.update(modules)
    try:
        yield
    finally:
        for name in [*islice(reversed(sys.modules), len(sys.modules) - size)]:  # the latest are the last
            del sys.modules[name]
        sys.modules.update(held)


class Noise:
    """Damages a stream of bytes: each with probability ``rate`` by one of ``kinds``."""

    def __init__(self, seed: str, rate: float, kinds: tuple[str, ...] = FAULTS) -> None:
        self._random = random.Random(seed)
        self._rate = rate
        self._kinds = kinds
        self._cut = 0
        self.hits = 0

    def __call__(self, data: bytes) -> tuple[bytes, float]:
        """What arrives, and by how many seconds late."""
        result = bytearray()
        delay_s = 0.0
        for byte in data:
            if self._cut:
                self._cut -= 1
                continue
            kind = self._random.choice(self._kinds) if self._random.random() < self._rate else ""
            self.hits += bool(kind)
            if kind == "cut":
                self._cut = self._random.randrange(1, 40)
            elif kind == "delay":
                delay_s = _DELAY_S
            elif kind == "flip":
                byte ^= 1 << self._random.randrange(8)
            result += bytes((byte,)) * {"lose": 0, "cut": 0, "double": 2}.get(kind, 1)
        return bytes(result), delay_s


def clean(data: bytes) -> tuple[bytes, float]:
    """No damage."""
    return data, 0.0


class Pipe:
    """A transport whose other end is a board program; ``run_samples`` is the length of every motion."""

    name = "pipe"

    def __init__(self, root: Path, to_board: Any = clean, from_board: Any = clean) -> None:
        self._root = root
        self._ways = (to_board, from_board)
        self._queues: tuple[deque[tuple[float, bytes]], ...] = (deque(), deque())
        self._sample_s = 0.0
        self._plugged_s = 0.0
        self._silent_s = 0.0
        self.told: list[str] = []
        """What the session told its user."""
        self.round_trips = 0
        self.bytes_sent = 0
        self.run_samples = 70
        self.start_board()

    def disturb(self, to_board: Any, from_board: Any) -> None:
        """Change the line's quality from here on."""
        self._ways = (to_board, from_board)

    def start_board(self) -> None:
        """Power up: a new program on the same flash."""
        with board_modules():
            # the program imports these when it needs them
            from armtempo_board.app import arm_setup, sequence_start, store_commands  # noqa: F401
            from armtempo_board.app.app import App
            from armtempo_board.motion import arm_check  # noqa: F401
            from armtempo_board.storage import sequence_file, store  # noqa: F401

            self._later = {name: sys.modules[name] for name in _FOR_LATER}
            self.port = stand_in.Port()
            self.app: Any = App(self.port, str(self._root))

    def clock(self) -> float:
        """Seconds."""
        return stand_in.Clock.now_ms / 1000.0

    def write(self, data: bytes) -> None:
        """See Transport."""
        self._check()
        self.round_trips += 1
        self.bytes_sent += len(data)
        self._send(0, data)

    def read(self, timeout_s: float) -> bytes:
        """See Transport."""
        self._check()
        end_s = self.clock() + timeout_s
        while True:
            self._turn()
            data = self._arrived(1)
            if data or self.clock() >= end_s:
                return data
            self.wait(_STEP_S)

    def wake(self) -> None:
        """See Transport."""

    def close(self) -> None:
        """See Transport."""

    def wait(self, seconds: float) -> None:
        """Let time pass on the board without the host."""
        stand_in.Clock.now_ms += max(1, round(1000 * seconds))
        self._turn()

    def reopen(self) -> Pipe:
        """The port opened again; LinkError while the cable is out."""
        self._check()
        return self

    def wait_away(self, seconds: float, buffer: int = _USB_BUFFER) -> None:
        """Let time pass while the host reads nothing: the port takes no more than its buffer's bytes."""
        self.port.space = buffer
        for _ in range(round(seconds / _SAMPLE_S)):
            self.wait(_SAMPLE_S)
        self.port.space = 1 << 30

    def connected(self) -> bool:
        """Whether the cable is in."""
        return self.clock() >= self._plugged_s

    def unplug_for(self, seconds: float) -> None:
        """Pull the cable and put it back in later."""
        self._plugged_s = self.clock() + seconds

    def silence_for(self, seconds: float) -> None:
        """The port is there, but nothing comes through."""
        self._silent_s = self.clock() + seconds

    def swap_board(self, board_id: bytes) -> None:
        """Another board at the same port, which some host has greeted before."""
        self.start_board()
        self.app.controller.board.board_id = board_id
        self.app.commands.greeted = True

    def _check(self) -> None:
        if not self.connected():
            raise LinkError("the connection to pipe broke: unplugged")

    def _send(self, way: int, data: bytes) -> None:
        if self.connected() and self.clock() >= self._silent_s:
            arrives, delay_s = self._ways[way](data)
            self._queues[way].append((self.clock() + delay_s, arrives))

    def _arrived(self, way: int) -> bytes:
        data = b""
        while self._queues[way] and self._queues[way][0][0] <= self.clock():
            data += self._queues[way].popleft()[1]
        return data

    def _turn(self) -> None:
        self._move()
        self.port.inbox.extend(self._arrived(0))
        turns = _TURNS
        with _importable(self._later):
            while turns:
                self.app.run_once()
                turns = _TURNS if self.port.inbox or self.port.outbox else turns - 1
                if self.port.outbox:
                    self._send(1, bytes(self.port.outbox))
                    self.port.outbox = bytearray()

    def _move(self) -> None:
        engine = self.app.controller.board.engine
        if engine is None or not engine.moving:
            self._sample_s = self.clock()
        elif self.clock() >= self._sample_s + _SAMPLE_S:
            self._sample_s += _SAMPLE_S
            engine.advance(1)
            if engine.ticks >= 8_400_000 * (self.run_samples - 1):
                engine.finish()


def connect(pipe: Pipe) -> Client:
    """A greeted board."""
    return greet(Session(pipe, pipe.clock, reopen=pipe.reopen, tell=pipe.told.append, sleep=pipe.wait), 1)


ARM = stand_in.arm(3)


def random_motion(numbers: random.Random, segments: int = 6, joints: int = 3) -> bytes:
    """A motion record for ``ARM``; its numbers mean nothing."""
    points = [[numbers.randrange(2**40) for _ in range(segments + 5)] for _ in range(joints)]
    return motion.pack(5, points, points, 1, motion.no_ramps(), wire.record_crc(ARM))


def ready(pipe: Pipe) -> tuple[Client, bytes]:
    """A board with arm, motion ``feed`` and known positions."""
    board = connect(pipe)
    board.upload(wire.ARM_RECORD_NAME, ARM)
    data = random_motion(random.Random(5))
    board.upload("feed", data)
    board.home([0, 0, 0])
    return board, data


def started(pipe: Pipe) -> MotionFollower:
    """A run of ``feed`` that has just begun on a board made ready for it."""
    board, data = ready(pipe)
    run = board.start("feed", wire.record_crc(data))
    return MotionFollower(board, run)


def replay(
    board: Client, key: MotionKey, stop: StopRequest, take: Callable[[Sample], object] = lambda _: None
) -> RunEnd:
    """Start a motion and follow it to its end; ``take`` gets its samples."""
    with running.attended(board, stop):
        follower = MotionFollower(board, board.start(key.name, key.crc))
        running.follow(board, stop, follower, lambda event: isinstance(event, Sample) and take(event))
    return follower.end


def follow(follower: MotionFollower) -> tuple[list[Sample], RunEnd]:
    """All samples of the run, and how it ended."""
    samples = list(follower.samples())
    assert follower.ended
    return samples, follower.end
