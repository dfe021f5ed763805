"""What the board does for each command of the message table; refusals are raised as ``Refused``.

While a motion runs only ``hello``, ``status``, ``samples`` and ``stop`` are taken, and the last three
allocate nothing. The commands about the store are in ``storing.py``, which is imported when one comes.
"""

from struct import calcsize, pack_into, unpack_from

from armtempo_shared import codes, limits
from armtempo_shared.messages import PROTOCOL_VERSION
from micropython import const

from armtempo_board.buffers import u32
from armtempo_board.errors import Refused
from armtempo_board.link.serial_link import PAYLOAD

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from armtempo_board.app.app import App

_ANSWER = const(6)  # index in the reply frame of what follows the command's number
_HELLO = const(0x01)
_WHILE_MOVING = b"\x01\x02\x22\x30"  # hello, status, stop, samples
_TICKS = const(8)  # index of the ticks in the answer to status


class Commands:
    """Acts on the frame in ``link.reader`` and leaves the reply with the link."""

    def __init__(self, app: "App", rows: "Callable[[str], list[Any]]") -> None:
        """``rows`` of the message table."""
        self.app = app
        self._link = app.link
        self.greeted = False  # a host has said hello
        self._session = 0
        self._table: "dict[int, Any]" = {}
        answers = rows("A")
        kept: "dict[str, str]" = {}  # one string for all that are equal, for the sake of the heap
        for place, (name, number, form, _, tail) in enumerate(rows("C")):
            answer = answers[place][2]
            handler = getattr(self, "_" + name, name)
            self._table[number] = (
                handler,
                kept.setdefault(form, form),
                kept.setdefault(answer, answer),
                tail,
            )
        ok, error = rows("R")
        self._ok = ok[1]
        self._error = error[1]
        self._error_form = error[2]

    def act(self) -> None:
        """Act on one command."""
        number = self._link.reader.data[4]
        try:
            self._dispatch(number)
        except Refused as refused:
            self._refuse(number, refused.code, refused.joint, refused.value)

    def _dispatch(self, number: int) -> None:
        row = self._table.get(number)
        if row is None:
            return self._refuse(number, codes.UNKNOWN_COMMAND)
        length = self._link.reader.length()
        fixed = calcsize(row[1])
        if length < fixed or (length > fixed and not row[3]):
            return self._refuse(number, codes.MALFORMED)
        if not self.greeted and number != _HELLO:
            return self._refuse(number, codes.NO_SESSION)
        if self.app.moving() and number not in _WHILE_MOVING:
            return self._refuse(number, codes.BUSY)
        self._link.reply[PAYLOAD] = number
        self.app.refill()
        size = self._store(row, length) if isinstance(row[0], str) else row[0](row, length)
        self.app.refill()
        self._link.answer(self._ok, 1 + (size or 0))

    def _store(self, row: tuple, length: int) -> "int | None":
        from armtempo_board.app import store_commands  # here, so that it can be forgotten

        handler: "Callable[[Commands, Any, int], int | None]" = getattr(store_commands, row[0])
        return handler(self, row, length)

    def _refuse(self, number: int, code: int, joint: int = 255, value: int = 0) -> None:
        pack_into(self._error_form, self._link.reply, PAYLOAD, number, code, joint, value)
        self._link.answer(self._error, calcsize(self._error_form))

    # for those who act on a command

    def fields(self, row: tuple) -> tuple:
        """The fields of the command that stands in the reader."""
        return unpack_from(row[1], self._link.reader.data, PAYLOAD)

    def tail(self, row: tuple, length: int) -> bytes:
        """What comes behind its fields."""
        return bytes(self._link.reader.data[PAYLOAD + calcsize(row[1]) : PAYLOAD + length])

    def text(self, row: tuple, length: int) -> str:
        """The same as text; refuses what is none."""
        try:
            return self.tail(row, length).decode()
        except UnicodeError:
            raise Refused(codes.MALFORMED)

    def reply(self, row: tuple, *values: int) -> int:
        """Put the fields of the answer into the reply; their size."""
        pack_into(row[2], self._link.reply, _ANSWER, *values)
        return calcsize(row[2])

    def reply_tail(self, size: int, tail: bytes) -> int:
        """Put the tail of the answer behind fields of ``size`` bytes; the size of all."""
        self._link.reply[_ANSWER + size : _ANSWER + size + len(tail)] = tail
        return size + len(tail)

    # session

    def _hello(self, row: tuple, length: int) -> int:
        protocol, session = self.fields(row)
        if protocol != PROTOCOL_VERSION:
            raise Refused(codes.PROTOCOL, value=PROTOCOL_VERSION)
        if not self.greeted or session != self._session:
            self._begin_session(session)
        app = self.app
        app.look_around()
        size = self.reply(
            row,
            PROTOCOL_VERSION,
            app.joints,
            limits.MAX_ENCODERS,
            app.state(),
            limits.TICK_HZ,
            limits.MAX_STEP_RATE,
            limits.MAX_STEP_RATE_SUM,
            app.free_flash,
            app.free_heap,
            app.arm_crc,
            app.program_crc,
            app.boot,
        )
        return self.reply_tail(size, app.board_id)

    def _begin_session(self, session: int) -> None:
        self.greeted = True
        self._session = session
        self._link.forget()
        self.app.samples.skip()
        self.app.forget_store()

    def _status(self, row: tuple, length: int) -> int:
        app = self.app
        reply = self._link.reply
        samples = app.samples
        pack_into(
            row[2],
            reply,
            _ANSWER,
            app.state(),
            app.fault(),
            app.fault_joint(),
            app.known(),
            app.run_number,
            0,
            samples.next - samples.first,
            samples.lost,
            self._link.reader.bad,
        )
        size = calcsize(row[2])
        return size + app.stand(reply, _ANSWER + _TICKS, _ANSWER + size)

    def _leave(self, row: tuple, length: int) -> None:
        self.app.leave()

    # motion

    def _home(self, row: tuple, length: int) -> None:
        (mask,) = self.fields(row)
        joints = self.app.joints
        self.app.check_ready()
        if length - calcsize(row[1]) != 4 * joints or mask >> joints:
            raise Refused(codes.MALFORMED)
        self.app.home(mask, unpack_from("<%di" % joints, self._link.reader.data, PAYLOAD + calcsize(row[1])))

    def _start(self, row: tuple, length: int) -> int:
        flags, crc = self.fields(row)
        name = self.text(row, length)
        self.app.begin(name, flags, crc)
        return self.reply(row, self.app.run_number, self.app.duration)

    def _stop(self, row: tuple, length: int) -> int:
        if not self.app.moving():
            raise Refused(codes.NOT_MOVING)
        self.app.stop(self._link.reader.data[PAYLOAD])
        return 0

    def _clear(self, row: tuple, length: int) -> None:
        self.app.clear()

    def _samples(self, row: tuple, length: int) -> int:
        data = self._link.reader.data
        samples = self.app.samples
        acknowledged = u32(data, PAYLOAD)
        samples.acknowledge(acknowledged)
        samples.again(acknowledged, data[PAYLOAD + 4] | data[PAYLOAD + 5] << 8)
        pack_into(row[2], self._link.reply, _ANSWER, samples.first, samples.next - samples.first)
        return calcsize(row[2])
