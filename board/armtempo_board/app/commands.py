"""Executes the commands of the message table; refusals are raised as ``Refused``.

During a motion only the commands of ``_WHILE_MOVING`` and ``Board.extra_commands`` are accepted; of these, all but
``hello``, ``stop`` and ``speed`` allocate nothing. Commands of the store and the drivers are in
``store_commands.py``; of outputs and inputs in ``output_commands.py``, loaded for arms
that have them; of sequences in ``sequence_command.py``, loaded when a sequence is started.
"""

import gc
from struct import calcsize, pack_into, unpack_from

from armtempo_shared import codes, limits
from armtempo_shared.messages import (
    NO_JOINT,
    NUMBER_AT,
    PAYLOAD_AT,
    PERMILLE,
    PROTOCOL_VERSION,
    RATES_MEASURED,
    RESUME,
    SLOWEST_PERMILLE,
)
from armtempo_shared.table import offset, row_of, rows
from micropython import const

from armtempo_board import features, step_rates
from armtempo_board.app import store_commands
from armtempo_board.buffers import u32
from armtempo_board.errors import Refused

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from armtempo_board.app.controller import Controller
    from armtempo_board.link.serial_link import SerialLink

_WHILE_MOVING = ("hello", "status", "stop", "samples", "hold", "speed")  # if the program has them
_AT_A_PRESS = (
    "put_once",
    "start",
)  # whose rows are kept, too, where memory is not short: to look one up takes 7 ms
_STORE = range(0x10, 0x20)  # numbers of the commands in store_commands.py,
_DRIVERS = const(0x29)  # and of one more
_BYTES_PER_POSITION = const(4)
_BYTES_OF_INDEX = const(4)  # of a sample
_ANSWER_AT = const(6)  # in a reply: its payload begins with the command's number
# a row of a command: its function, the formats of its fields and of its answer's fields, its tail
_HANDLER = const(0)
_FIELDS = const(1)
_ANSWER = const(2)
_TAIL = const(3)
_NUMBER, _ROW = const(0), const(1)  # of the last command
_UNKNOWN = codes.UNKNOWN_COMMAND if features.ALL else codes.NEEDS_FIRMWARE


class Commands:
    """Executes the command in ``link.reader`` and gives the reply to the link."""

    def __init__(self, controller: "Controller", link: "SerialLink") -> None:
        self.controller = controller
        self.board = controller.board
        self.greeted = False  # a host has said hello
        self.leaving = False  # a host has asked for the REPL
        self.link = link
        self._session = 0
        self._last: "Any" = (0, None)  # number and row of the last command that was looked up
        self._while_moving: "dict[int, Any]" = {}
        self._kept: "dict[int, Any]" = {}
        is_short = self.board.engine_memory.is_short
        for name, number, _, _, _ in rows("C"):
            if name in _AT_A_PRESS and not is_short:
                self._kept[number] = self._row(number)
            if name in _WHILE_MOVING and hasattr(type(self), name):
                self._while_moving[number] = self._row(number)
            if name == "hello":
                self._hello_number = number
        self._numbers = bytes([number for _, number, _, _, _ in rows("C")])
        self._ticks_at = _ANSWER_AT + offset("A", "status", "ticks")
        (_, self._ok, _, _, _), (_, self._error, self._error_fields, _, _) = rows("R")

    def act(self) -> None:
        """Execute one command."""
        number = self.link.reader.data[NUMBER_AT]
        try:
            self._dispatch(number)
        except Refused as refused:
            self._refuse(number, refused.code, refused.joint, refused.value)
        except MemoryError:
            self._refuse(number, codes.NO_MEMORY)
            raise
        except Exception:
            self._refuse(number, codes.FAILED)
            raise

    def _dispatch(self, number: int) -> None:
        row = self._while_moving.get(number) or self.board.extra_commands.get(number)
        if row is None:
            if number not in self._numbers:
                return self._refuse(number, _UNKNOWN)
            if self.controller.moving():
                return self._refuse(number, codes.BUSY if self.greeted else codes.NO_SESSION)
            row = self._row(number)
            if row[_HANDLER] is None:
                return self._refuse(number, _UNKNOWN)
        length = self.link.reader.length()
        fixed = calcsize(row[_FIELDS])
        if length < fixed or (length > fixed and not row[_TAIL]):
            return self._refuse(number, codes.MALFORMED)
        if not self.greeted and number != self._hello_number:
            return self._refuse(number, codes.NO_SESSION)
        self.link.reply[PAYLOAD_AT] = number
        self.controller.refill()
        handler = row[_HANDLER]
        size = self._store(handler, row, length) if isinstance(handler, str) else handler(self, row, length)
        if size is not None and size < 0:
            return self._refuse(number, -size)
        if self.board.arm_record_pending:
            self.controller.take_new_arm()
        self.controller.refill()
        self.link.answer(self._ok, _ANSWER_AT - PAYLOAD_AT + (size or 0))

    def _row(self, number: int) -> tuple:
        """The row of a command; the last one is kept, as an upload asks for the same again and again."""
        if number in self._kept:
            return self._kept[number]  # type: ignore[no-any-return]
        if self._last[_NUMBER] != number:
            gc.collect()  # what is kept should lie at a low address
            name, _, fields, _, tail = row_of("C", number)
            _, _, values, _, _ = row_of("A", number)
            in_store = number in _STORE or number == _DRIVERS
            handler = name if in_store else getattr(type(self), name, None)
            self._last = number, (handler, fields, values, tail)
        return self._last[_ROW]  # type: ignore[no-any-return]

    def _store(self, name: str, row: tuple, length: int) -> "int | None":
        return getattr(store_commands, name)(self, row, length)  # type: ignore[no-any-return]

    def _refuse(self, number: int, code: int, joint: int = NO_JOINT, value: int = 0) -> None:
        pack_into(self._error_fields, self.link.reply, PAYLOAD_AT, number, code, joint, value)
        self.link.answer(self._error, calcsize(self._error_fields))

    # for the functions of commands

    def fields(self, row: tuple) -> tuple:
        """The fields of the command in the reader."""
        return unpack_from(row[_FIELDS], self.link.reader.data, PAYLOAD_AT)

    def tail(self, row: tuple, length: int) -> bytes:
        """The bytes after its fields."""
        return bytes(self.link.reader.data[PAYLOAD_AT + calcsize(row[_FIELDS]) : PAYLOAD_AT + length])

    def text(self, row: tuple, length: int) -> str:
        """The tail as text; raises Refused if it is not valid UTF-8."""
        try:
            return self.tail(row, length).decode()
        except UnicodeError:
            raise Refused(codes.MALFORMED)

    def reply(self, row: tuple, *values: int) -> int:
        """Put the fields of the answer into the reply; returns their size."""
        pack_into(row[_ANSWER], self.link.reply, _ANSWER_AT, *values)
        return calcsize(row[_ANSWER])

    def reply_tail(self, size: int, tail: bytes) -> int:
        """Put the tail of the answer after fields of ``size`` bytes; returns the total size."""
        self.link.reply[_ANSWER_AT + size : _ANSWER_AT + size + len(tail)] = tail
        return size + len(tail)

    # commands by their names: the session

    def hello(self, row: tuple, length: int) -> int:
        """Begin a session; answers with the board's identity."""
        protocol, session = self.fields(row)
        if protocol != PROTOCOL_VERSION:
            raise Refused(codes.PROTOCOL, value=PROTOCOL_VERSION)
        if not self.greeted or session != self._session:
            self._begin_session(session)
        board, controller = self.board, self.controller
        controller.measure_free()
        size = self.reply(
            row,
            PROTOCOL_VERSION,
            board.joints,
            limits.MAX_ENCODERS,
            controller.state(),
            limits.TICK_HZ,
            step_rates.one,
            step_rates.together,
            controller.free_flash,
            controller.free_heap,
            board.arm_crc,
            board.program_crc,
            board.boot,
            board.engine_bytes(),
            features.BITS | (RATES_MEASURED if 0 < board.joints <= step_rates.joints else 0),
            board.arm_problem,
            board.arm_value,
            board.once.capacity,
        )
        return self.reply_tail(size, board.board_id)

    def _begin_session(self, session: int) -> None:
        self.greeted = True
        self._session = session
        self.link.forget()
        self.board.samples.skip()
        if features.SEQUENCES:
            self.board.failure_waits = True
        if features.SPEED:
            self.controller.forget_speed()
        self.board.forget_store()

    def status(self, row: tuple, length: int) -> int:
        """Answer with state and joint positions."""
        board, controller = self.board, self.controller
        reply = self.link.reply
        samples = board.samples
        pack_into(
            row[_ANSWER],
            reply,
            _ANSWER_AT,
            controller.state(),
            board.fault(),
            board.fault_joint(),
            board.known(),
            controller.run_number,
            0,
            0,
            controller.speed(),
            samples.next - samples.first,
            samples.lost,
            self.link.reader.bad,
            controller.rest_ms(),
        )
        size = calcsize(row[_ANSWER])
        return size + board.put_snapshot(reply, self._ticks_at, _ANSWER_AT + size)

    def leave(self, row: tuple, length: int) -> None:
        """Leave the program for the REPL."""
        self.leaving = True

    # motion

    def home(self, row: tuple, length: int) -> None:
        """Declare positions of joints."""
        (mask,) = self.fields(row)
        joints = self.board.joints
        self.board.check_ready()
        fixed = calcsize(row[_FIELDS])
        if length - fixed != _BYTES_PER_POSITION * joints or mask >> joints:
            raise Refused(codes.MALFORMED)
        steps = unpack_from("<%di" % joints, self.link.reader.data, PAYLOAD_AT + fixed)
        self.controller.home(mask, steps)

    def start(self, row: tuple, length: int) -> int:
        """Start a stored motion."""
        if self.board.engine_memory.is_short:
            # before objects of the command occupy the place of the motion's code
            self.controller.release_memory()
        flags, crc = self.fields(row)
        name = self.text(row, length)
        self.controller.begin(name, flags, crc)
        return self.reply(row, self.controller.run_number, self.controller.duration_ticks)

    def stop(self, row: tuple, length: int) -> int:
        """Brake, or freeze."""
        if not self.controller.moving():
            raise Refused(codes.NOT_MOVING)
        self.controller.stop(self.link.reader.data[PAYLOAD_AT])
        return 0

    if features.SPEED:

        def speed(self, row: tuple, length: int) -> None:
            """Change the speed of the running motion, or of the next run."""
            (rate,) = self.fields(row)
            if not (rate in (0, RESUME) or SLOWEST_PERMILLE <= rate <= PERMILLE):
                raise Refused(codes.MALFORMED)
            self.controller.change_speed(rate)

    if features.JOG:

        def hold(self, row: tuple, length: int) -> int:
            """Hold a held run."""
            if not self.controller.moving():
                raise Refused(codes.NOT_MOVING)
            self.controller.hold()
            return 0

    def clear(self, row: tuple, length: int) -> None:
        """Clear the pending fault."""
        self.board.clear()

    def samples(self, row: tuple, length: int) -> int:
        """Acknowledge samples, and request some again."""
        data = self.link.reader.data
        samples = self.board.samples
        acknowledged = u32(data, PAYLOAD_AT)
        wanted_at = PAYLOAD_AT + _BYTES_OF_INDEX
        samples.acknowledge(acknowledged)
        samples.send_again(acknowledged, data[wanted_at] | data[wanted_at + 1] << 8)
        pack_into(row[_ANSWER], self.link.reply, _ANSWER_AT, samples.first, samples.next - samples.first)
        return calcsize(row[_ANSWER])
