"""The protocol's commands as methods: one method for each command of the message table."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import dataclass

from armtempo_shared import wire
from armtempo_shared.messages import MAX_COMMAND, MAX_PAYLOAD, PERMILLE, PROGRAM, SEQUENCE, START_HELD

from armtempo.basics.errors import BoardError, LinkError, NoAnswerError, OtherBoardError
from armtempo.basics.progress import Progress
from armtempo.link import board_messages
from armtempo.link.refusal import refusal
from armtempo.link.session import ANSWER_TIMEOUT_S, Session

FLASH_TIMEOUT_S = 30.0
"""Time-out of commands for which the board erases flash or checks a motion before it answers."""
HELLO_TIMEOUT_S = 1.2
"""Time-out of ``hello``; together with the diagnosis of a port without a board it stays under 2 s."""
SMALLEST_PIECE = 16
LARGEST_PIECE = MAX_COMMAND - 4
PIECE_TIMEOUT_S = 0.5

_CTRL_C = 3
_GREETINGS = 8
"""Number of a session's first frames that can be ``hello``."""


@dataclass(frozen=True)
class KeptSamples:
    """The board's answer to ``samples``: the samples that it still has."""

    first: int
    """Index of the oldest one."""
    count: int


def harmless_number() -> int:
    """A random session number (32 bits) whose ``hello`` frames hold no byte 3 in number or checksum.

    MicroPython takes byte 3 for Ctrl-C and would interrupt boot.py on a board that is just starting.
    """
    entry = wire.COMMAND["hello"]
    while True:
        number = secrets.randbits(32)
        payload = wire.encode(entry, (wire.PROTOCOL_VERSION, number))
        frames = [wire.frame(sequence, entry[1], payload) for sequence in range(1, _GREETINGS)]
        if not any(_CTRL_C in frame for frame in frames if frame[3] != _CTRL_C):
            return number


class Client:
    """The host's end of the protocol, one method per command.

    Every method raises BoardError if the board refuses, LinkError if the connection is lost.
    """

    def __init__(self, session: Session, session_number: int | None = None) -> None:
        self.session = session
        self._number = harmless_number() if session_number is None else session_number
        self._piece = LARGEST_PIECE
        self._info: board_messages.Hello | None = None
        self.rate = PERMILLE
        """Speed at which motions are started, in thousandths of the planned one."""

    @property
    def info(self) -> board_messages.Hello:
        """The board's answer to ``hello``; raises LinkError before it."""
        if self._info is None:
            raise LinkError("no hello has been exchanged yet", "call hello() first")
        return self._info

    def hello(self) -> board_messages.Hello:
        """Begin a session; raises NoAnswerError if no armtempo board answers within HELLO_TIMEOUT_S."""
        values, board_id = self.session.command(
            "hello",
            (wire.PROTOCOL_VERSION, self._number),
            silence_timeout_s=HELLO_TIMEOUT_S,
            answer_timeout_s=HELLO_TIMEOUT_S,
        )
        fields = [*values, board_id]
        fields[3] = board_messages.state_name(values[3])
        self._info = board_messages.Hello(*fields)
        self.session.greeted(self._greet_again)
        return self._info

    def need(self, feature: str, what: str) -> None:
        """Raise BoardError, naming ``what``, if the board's program lacks one of ``messages.FEATURES``."""
        if not self.info.can(feature):
            raise refusal(what, wire.ERROR_CODES["needs_firmware"])

    def _greet_again(self) -> None:
        before = self._info
        now = self.hello()
        if before is None or (now.board_id, now.boot) == (before.board_id, before.boot):
            return
        self._info = before
        where = self.session.transport.name
        if now.board_id != before.board_id:
            raise OtherBoardError(
                f"another board is on {where} now ({now.board_id}, before {before.board_id})",
                "plug in the right board, or run the command again for this one",
            )
        raise OtherBoardError(
            f"the board on {where} has restarted: positions are unknown",
            "move the arm to its home posture and run 'armtempo home'",
        )

    def status(self) -> board_messages.Status:
        """The board's state, and the positions of the joints."""
        values, tail = self.session.command("status")
        fields = [board_messages.state_name(values[0]), *values[1:], board_messages.positions(tail)]
        return board_messages.Status(*fields)

    def upload(self, name: str, data: bytes, progress: Progress | None = None) -> None:
        """Store a record under a name; the board keeps the old one until the new one is complete."""
        crc = wire.record_crc(data)
        self.session.command("put_begin", (len(data), crc), name, silence_timeout_s=FLASH_TIMEOUT_S)
        self._put("put_data", data, (), progress)
        self.session.command(
            "put_commit", (crc,), silence_timeout_s=FLASH_TIMEOUT_S, answer_timeout_s=FLASH_TIMEOUT_S
        )

    def put_once(self, data: bytes) -> int:
        """Put the record of a motion that is run once into the board's memory: nothing is stored.

        It is started as ``ONCE_NAME``, with the checksum that this returns, and replaced by the next one. The board
        refuses one that is larger than ``info.once_bytes``.
        """
        self._put("put_once", data, (len(data),))
        return wire.record_crc(data)

    def _put(
        self, command: str, data: bytes, more: tuple[int, ...], progress: Progress | None = None
    ) -> None:
        """Send a record in pieces; ``more``: values of each beside its offset."""
        offset = 0
        while offset < len(data):
            offset = self._put_piece(command, data, offset, more)
            if progress is not None:
                progress(offset, len(data))

    def _put_piece(self, command: str, data: bytes, offset: int, more: tuple[int, ...]) -> int:
        """Send the next piece; its size is halved after a loss, and doubled again after a success."""
        repeats = self.session.repeats
        try:
            values, _ = self.session.command(
                command,
                (offset, *more),
                data[offset : offset + self._piece],
                answer_timeout_s=self._piece_timeout_s(),
            )
        except NoAnswerError:
            if self._piece == SMALLEST_PIECE:
                raise
            self._piece = max(SMALLEST_PIECE, self._piece // 2)
            return offset
        if self.session.repeats == repeats:
            self._piece = min(LARGEST_PIECE, 2 * self._piece)
        return int(values[0])

    def _piece_timeout_s(self) -> float:
        return ANSWER_TIMEOUT_S if self._piece == SMALLEST_PIECE else PIECE_TIMEOUT_S

    def stored(self) -> list[board_messages.StoredMotion]:
        """All stored motions."""
        found: list[board_messages.StoredMotion] = []
        count = 1
        while len(found) < count:
            entry, count = self._listed(len(found))
            if entry is None:
                break
            found.append(entry)
        return found

    def find(self, name: str) -> board_messages.StoredMotion | None:
        """The stored motion of this name, or None; by halving, as the board's names are sorted."""
        low, behind = 0, 1
        while low < behind:
            middle = (low + behind) // 2
            entry, count = self._listed(middle)
            if entry is None or entry.name == name:
                return entry
            if middle == 0:  # the first, which says how many there are
                behind = count
            low, behind = (middle + 1, behind) if entry.name < name else (low, middle)
        return None

    def _listed(self, index: int) -> tuple[board_messages.StoredMotion | None, int]:
        """The stored motion of a number, from 0, by names, None if there is none; and how many there are."""
        try:
            (count, size, crc, duration, joints, default, kind), name = self.session.command("list", (index,))
        except BoardError as error:
            if error.code == wire.ERROR_CODES["not_found"]:
                return None, 0
            raise
        if not name:
            return None, 0
        found = board_messages.StoredMotion(
            name, size, crc, duration, joints, bool(default), kind == SEQUENCE, kind == PROGRAM
        )
        return found, count

    def fetch(self, name: str) -> bytes:
        """A stored record, read back."""
        data = b""
        piece: bytes
        while True:
            (size,), piece = self.session.command("get", (len(data), MAX_PAYLOAD - 64), name)
            data += piece
            if len(data) >= size or not piece:
                return data

    def remove(self, name: str) -> None:
        """Remove a stored motion."""
        self.session.command("remove", (), name, silence_timeout_s=FLASH_TIMEOUT_S)

    def rename(self, old: str, new: str) -> None:
        """Rename a stored motion."""
        self.session.command("rename", (len(old.encode()),), old + new, silence_timeout_s=FLASH_TIMEOUT_S)

    def set_default(self, name: str) -> None:
        """Set the motion or sequence that the board's button starts; "" for none."""
        self.session.command("set_default", (), name, silence_timeout_s=FLASH_TIMEOUT_S)

    def sequence(self) -> board_messages.SequenceState:
        """State of the running sequence, or of the last one since the board's start."""
        if not self.info.can("sequences"):
            return board_messages.SequenceState("none", 0, 0, 0, 0, "")
        try:
            (ending, code, step, row, cycle), name = self.session.command("sequence")
        except BoardError as error:
            if error.code != wire.ERROR_CODES["unknown_command"]:
                raise
            return board_messages.SequenceState("none", 0, 0, 0, 0, "")
        return board_messages.SequenceState(board_messages.ending_name(ending), code, step, row, cycle, name)

    def counters(self) -> dict[str, int]:
        """Counters of the running or the last sequence since the board's start, by name."""
        found: dict[str, int] = {}
        try:
            while True:
                (count, value), name = self.session.command("counter", (len(found),))
                if len(found) >= count:
                    return found
                found[name] = value
        except BoardError as error:
            if error.code != wire.ERROR_CODES["unknown_command"]:
                raise
            return found

    def home(self, steps: Sequence[int | None]) -> None:
        """Declare the positions of the joints, in steps; None leaves a joint unchanged."""
        mask = sum(1 << joint for joint, value in enumerate(steps) if value is not None)
        tail = b"".join((value or 0).to_bytes(4, "little", signed=True) for value in steps)
        self.session.command("home", (mask,), tail)

    def start(self, name: str, crc: int, flags: int = 0) -> int:
        """Start a motion at ``rate``, stored or put by ``put_once``, or a sequence or program.

        ``crc`` is the record's own checksum, ``flags`` of START_HOMING and START_HELD. Returns the number of the run,
        which its samples and events carry; for a sequence or program that of the run before its first.
        """
        if flags & START_HELD:
            self.need("jog", "moving by hand")
        if self.rate != PERMILLE:
            self.need("speed", "another speed than planned")
            self.session.command("speed", (self.rate,))
        (run, _), _ = self.session.command(
            "start", (flags, crc), name, silence_timeout_s=FLASH_TIMEOUT_S, answer_timeout_s=FLASH_TIMEOUT_S
        )
        return int(run)

    def stop(self, now: bool = False) -> None:
        """Brake along the path, or freeze."""
        self.session.command("stop", (int(now),))

    def speed(self, rate: int) -> None:
        """Set the running motion's speed to ``rate`` thousandths of the planned one; 0: pause, RESUME: end of
        the pause."""
        if rate == PERMILLE and not self.info.can("speed"):
            return
        self.need("speed", "another speed than planned")
        self.session.command("speed", (rate,))

    def hold(self, answer_timeout_s: float = ANSWER_TIMEOUT_S) -> None:
        """Hold a motion that was started with START_HELD; raises BoardError ``not_moving`` if it has ended."""
        self.session.command("hold", silence_timeout_s=answer_timeout_s, answer_timeout_s=answer_timeout_s)

    def drivers(self, on: bool) -> None:
        """Switch the motors' current; off: all positions are unknown, only the encoders measure."""
        self.session.command("drivers", (int(on),))

    def clear(self) -> None:
        """Clear a fault."""
        self.session.command("clear")

    def set_output(self, number: int, value: int) -> None:
        """Set an output of the arm record (from 0) to a value of 0 to 65535, also while something moves."""
        self.need("outputs", "outputs")
        try:
            self.session.command("output", (number, value))
        except BoardError as error:
            if error.code != wire.ERROR_CODES["unknown_command"]:
                raise
            raise BoardError(
                "the arm that the board is set up for has no outputs",
                "write a table [output.NAME] in its file, then run 'armtempo configure'",
                error.code,
            ) from None

    def levels(self) -> board_messages.Levels:
        """The debounced levels of the inputs, and the values of the outputs; empty for an arm without either,
        as its board does not know this command."""
        if not self.info.can("outputs"):
            return board_messages.Levels(0, ())
        try:
            (inputs,), tail = self.session.command("inputs")
        except BoardError as error:
            if error.code != wire.ERROR_CODES["unknown_command"]:
                raise
            return board_messages.Levels(0, ())
        return board_messages.levels(inputs, tail)

    def leave(self) -> None:
        """End the board program; the port becomes MicroPython's REPL."""
        self.session.command("leave")

    def samples(self, acknowledged: int, wanted: int = 0) -> KeptSamples:
        """Acknowledge all samples before ``acknowledged``, and request ``wanted`` samples from there on again.

        The samples arrive as events.
        """
        (first, count), _ = self.session.command("samples", (acknowledged, wanted))
        return KeptSamples(first, count)
