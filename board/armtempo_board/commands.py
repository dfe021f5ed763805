"""What the board does for each command of the message table; refusals are raised as ``Refused``.

While a motion runs only ``hello``, ``status``, ``samples`` and ``stop`` are taken, and the last three
allocate nothing.
"""

from struct import calcsize, pack_into, unpack_from

from armtempo_shared import codes, limits
from armtempo_shared.messages import ARM_RECORD_NAME, MAX_PAYLOAD, PROTOCOL_VERSION
from armtempo_shared.motion import Motion, MotionError
from micropython import const

from armtempo_board import ends, store
from armtempo_board.link import PAYLOAD
from armtempo_board.octets import u32
from armtempo_board.refusal import Refused

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from armtempo_board.app import App

_ANSWER = const(6)  # index in the reply frame of what follows the command's number
_HELLO = const(0x01)
_WHILE_MOVING = b"\x01\x02\x22\x30"  # hello, status, stop, samples
_TICKS = const(8)  # index of the ticks in the answer to status


class Commands:
    """Acts on the frame in ``link.reader`` and leaves the reply with the link."""

    def __init__(self, app: "App", rows: "Callable[[str], list[Any]]") -> None:
        """``rows`` of the message table."""
        self._app = app
        self._link = app.link
        self.greeted = False  # a host has said hello
        self._session = 0
        self._table: "dict[int, Any]" = {}
        answers = rows("A")
        for place, (name, number, form, _, tail) in enumerate(rows("C")):
            self._table[number] = (getattr(self, "_" + name), form, answers[place][2], tail)
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
        if self._app.moving() and number not in _WHILE_MOVING:
            return self._refuse(number, codes.BUSY)
        self._link.reply[PAYLOAD] = number
        size = row[0](row, length)
        self._link.answer(self._ok, 1 + (size or 0))

    def _refuse(self, number: int, code: int, joint: int = 255, value: int = 0) -> None:
        pack_into(self._error_form, self._link.reply, PAYLOAD, number, code, joint, value)
        self._link.answer(self._error, calcsize(self._error_form))

    def _fields(self, row: tuple) -> tuple:
        return unpack_from(row[1], self._link.reader.data, PAYLOAD)

    def _bytes(self, row: tuple, length: int) -> bytes:
        return bytes(self._link.reader.data[PAYLOAD + calcsize(row[1]) : PAYLOAD + length])

    def _text(self, row: tuple, length: int) -> str:
        try:
            return self._bytes(row, length).decode()
        except UnicodeError:
            raise Refused(codes.MALFORMED)

    def _reply(self, row: tuple, *values: int) -> int:
        pack_into(row[2], self._link.reply, _ANSWER, *values)
        return calcsize(row[2])

    def _reply_tail(self, size: int, tail: bytes) -> int:
        self._link.reply[_ANSWER + size : _ANSWER + size + len(tail)] = tail
        return size + len(tail)

    # session

    def _hello(self, row: tuple, length: int) -> int:
        protocol, session = self._fields(row)
        if protocol != PROTOCOL_VERSION:
            raise Refused(codes.PROTOCOL, value=PROTOCOL_VERSION)
        if not self.greeted or session != self._session:
            self._begin_session(session)
        app = self._app
        app.look_around()
        size = self._reply(
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
        return self._reply_tail(size, app.board_id)

    def _begin_session(self, session: int) -> None:
        self.greeted = True
        self._session = session
        self._link.forget()
        self._app.samples.skip()
        if not self._app.moving():
            self._app.store.abandon()

    def _status(self, row: tuple, length: int) -> int:
        app = self._app
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
        self._app.leave()

    # store

    def _put_begin(self, row: tuple, length: int) -> None:
        size, _ = self._fields(row)
        name = self._text(row, length)
        if name == ARM_RECORD_NAME:
            self._app.store.begin(store.ARM, size)
            return
        store.check_name(name)
        self._app.store.begin(name + store.MOTION, size)

    def _put_data(self, row: tuple, length: int) -> int:
        (offset,) = self._fields(row)
        return self._reply(row, self._app.store.write(offset, self._bytes(row, length)))

    def _put_commit(self, row: tuple, length: int) -> None:
        (crc,) = self._fields(row)
        if self._app.store.commit(crc) == store.ARM:
            self._app.configure()

    def _list(self, row: tuple, length: int) -> int:
        (index,) = self._fields(row)
        names = self._app.store.names()
        if index >= len(names):
            raise Refused(codes.NOT_FOUND)
        name = names[index]
        data = self._app.store.read(name + store.MOTION)
        try:
            motion = Motion(data)
            crc, duration, joints = u32(data, len(data) - 4), ends.duration_ticks(motion), motion.joints
        except MotionError:
            crc = duration = joints = 0
        default = name == self._app.store.default()
        size = self._reply(row, len(names), len(data), crc, duration, joints, default)
        return self._reply_tail(size, name.encode())

    def _remove(self, row: tuple, length: int) -> None:
        name = self._text(row, length)
        store.check_name(name)
        self._app.store.remove(name)

    def _rename(self, row: tuple, length: int) -> None:
        (old_length,) = self._fields(row)
        names = self._text(row, length)
        old, new = names[:old_length], names[old_length:]
        store.check_name(old)
        store.check_name(new)
        self._app.store.rename(old, new)

    def _get(self, row: tuple, length: int) -> int:
        offset, wanted = self._fields(row)
        name = self._text(row, length)
        if name == ARM_RECORD_NAME:
            file_name = store.ARM
        else:
            store.check_name(name)
            file_name = name + store.MOTION
        wanted = min(wanted, MAX_PAYLOAD - 1 - calcsize(row[2]))
        size, data = self._app.store.part(file_name, offset, wanted)
        return self._reply_tail(self._reply(row, size), data)

    def _set_default(self, row: tuple, length: int) -> None:
        name = self._text(row, length)
        if name:
            store.check_name(name)
        self._app.store.set_default(name)

    # motion

    def _home(self, row: tuple, length: int) -> None:
        (mask,) = self._fields(row)
        joints = self._app.joints
        self._app.check_ready()
        if length - calcsize(row[1]) != 4 * joints or mask >> joints:
            raise Refused(codes.MALFORMED)
        self._app.home(mask, unpack_from("<%di" % joints, self._link.reader.data, PAYLOAD + calcsize(row[1])))

    def _start(self, row: tuple, length: int) -> int:
        flags, crc = self._fields(row)
        name = self._text(row, length)
        store.check_name(name)
        self._app.begin(name, flags, crc)
        return self._reply(row, self._app.run_number, self._app.duration)

    def _stop(self, row: tuple, length: int) -> int:
        if not self._app.moving():
            raise Refused(codes.NOT_MOVING)
        self._app.stop(self._link.reader.data[PAYLOAD])
        return 0

    def _clear(self, row: tuple, length: int) -> None:
        self._app.clear()

    def _samples(self, row: tuple, length: int) -> int:
        data = self._link.reader.data
        samples = self._app.samples
        acknowledged = u32(data, PAYLOAD)
        samples.acknowledge(acknowledged)
        samples.again(acknowledged, data[PAYLOAD + 4] | data[PAYLOAD + 5] << 8)
        pack_into(row[2], self._link.reply, _ANSWER, samples.first, samples.next - samples.first)
        return calcsize(row[2])
