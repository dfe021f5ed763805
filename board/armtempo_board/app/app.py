"""The main loop of the board program: serial link, commands, controller, events.

::

    link ─▶ commands ─▶ controller ─▶ store, engine
    link ◀─ events ◀─── controller ◀─ samples

An exception freezes the engine and becomes a fault, which is pending until the host clears it.
"""

import io
import sys
import time

from armtempo_shared import codes
from armtempo_shared.messages import MAX_PAYLOAD
from micropython import const

from armtempo_board import features
from armtempo_board.app.board import Board
from armtempo_board.app.commands import Commands
from armtempo_board.app.controller import Controller
from armtempo_board.app.events import Events
from armtempo_board.link.serial_link import SerialLink

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

_EXTRA_SERVICES_PER_PASS = const(3)  # calls of the engine, during a motion
_SPARE_BYTES = const(512)  # reserved for reporting an exception: a traceback, and its end for the host
_MOST_FAILURES = const(10)  # consecutive failing passes of the loop after which the program ends
if features.SEQUENCES:
    _OF_PROGRAMS = (
        "armtempo_board.app.program_start",
        "armtempo_board.app.user_program",
        "armtempo_board.app.cell",
        "armtempo_board.app.pallet",
        "armtempo_board.app.homing",
        "armtempo_shared.homing",
        "armtempo_shared.rest_to_rest",
        "armtempo_shared.shapes",
    )


class App:
    """The parts of the program; ``stream``: the serial port, ``root``: the folder of the store.

    ``fault``: code of a fault that is pending from the start, 0 for none.
    """

    def __init__(self, stream: object, root: str, program_crc: int = 0, fault: int = 0) -> None:
        self.link = SerialLink(stream)
        self.controller = Controller(Board(root, program_crc, fault))
        self.commands = Commands(self.controller, self.link)
        self.events = Events(self.controller, self.link)
        self.passes = self._failed = 0  # number of passes, and number of the last one that failed
        self._failures = 0
        self._spare: "bytearray | None" = bytearray(_SPARE_BYTES)
        self.controller.configure()

    def enter(self) -> None:
        """The program starts, or continues after it was left for the prompt."""
        self.commands.leaving = False
        self.commands.greeted = False
        self.link.forget()

    if features.SEQUENCES:
        runs_program = False
        """A user's program executes: it is at fault if the heap or the stack is full."""

        def execute_program(self, run_once: "Callable[[], None]") -> None:
            """Execute the user's program that was started, if one was; ``run_once``: one pass of the loop."""
            program, self.controller.program = self.controller.program, None
            if program:
                try:
                    program.execute(self, run_once)
                finally:
                    _forget_programs()

    def leave_requested(self) -> int:
        """Whether a host has asked for the REPL, and the reply was sent."""
        return self.commands.leaving and self.link.idle()

    def run_once(self) -> None:
        """One pass of the loop; an exception in it becomes a fault."""
        self.passes = (self.passes + 1) & 0xFFFF
        try:
            self._run_once()
        except Exception as error:
            self.fail(error)

    def _run_once(self) -> None:
        controller = self.controller
        link = self.link
        if link.poll():
            controller.refill()
            self.commands.act()
        board = controller.board
        if board.engine:
            controller.service(time.ticks_diff(time.ticks_ms(), link.heard_ms))
            self.events.note_fault(board.fault())
        if self.commands.greeted and self.events.push():
            controller.refill()
        link.flush()
        if link.escape:
            self._escape()
        for _ in range(_EXTRA_SERVICES_PER_PASS):
            if controller.moving():
                board.engine.service()

    def _escape(self) -> None:
        self.link.escape = False
        if not self.controller.moving():
            self.link.forget()
            self.commands.leaving = True

    def fail(self, error: "BaseException") -> None:
        """Freeze and note the fault.

        Raises the error again after too many consecutive failures, and if it is a user's program that has filled the
        heap, or the stack by recursion (RuntimeError): the program gets it, in its call of the cell.
        """
        if features.SEQUENCES and self.runs_program and isinstance(error, (MemoryError, RuntimeError)):
            raise error
        again = (self.passes - self._failed) & 0xFFFF <= 1
        self._failures = self._failures + 1 if again else 1
        self._failed = self.passes
        self.controller.fail()
        self.events.note_fault(codes.INTERNAL)
        self._spare = None
        try:
            self.events.note(_traceback(error))
            self._spare = bytearray(_SPARE_BYTES)
        except MemoryError:
            self.events.note_bytes(b"MemoryError, and no memory left to say where")
        if self._failures >= _MOST_FAILURES:
            raise error


if features.SEQUENCES:

    def _forget_programs() -> None:
        """Give back the memory of the modules that only programs need; the next one imports them again."""
        for name in _OF_PROGRAMS:
            if name in sys.modules:
                del sys.modules[name]
                package, _, last = name.rpartition(".")
                delattr(sys.modules[package], last)


def _traceback(error: "BaseException") -> str:
    """The end of the traceback, which has the exception."""
    text = io.StringIO()
    sys.print_exception(error, text)
    text.seek(max(0, text.tell() - MAX_PAYLOAD))
    return str(text.read())
