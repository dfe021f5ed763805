"""Runs a user's program: it is executed by the main loop, which goes on from within its calls (``cell.py``).

It has the place of a sequence in the controller: the same commands stop it, change its speed and ask for its state;
nothing else is started while it runs.
"""

import gc
import io
import os
import sys
import time

from armtempo_shared import codes, messages, program, sequence
from armtempo_shared.rest_to_rest import Move, TooLongError
from armtempo_shared.sequence import MAX_COUNTERS
from micropython import const

import armtempo_board
from armtempo_board import step_rates
from armtempo_board.app.cell import TOO_MANY_COUNTERS, Cell, CellError, Ended
from armtempo_board.app.sequence_command import STEP
from armtempo_board.app.sequencer import Sequencer
from armtempo_board.code_names import name_of
from armtempo_board.errors import Refused

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from armtempo_board.app.sequencer import Runner
    from armtempo_board.storage.program_file import ProgramFile

_PERCENT = const(100)
_MOST_SKIPPED = const(16)
_SAY_MS = const(500)  # longest wait until a host has taken the text before,
_ALONE_MS = const(20)  # and if none was heard so long
_LONGEST_ROW = const(120)  # of a traceback,
_MOST_ROWS = const(8)  # of which the host is told the end


class UserProgram(Sequencer):
    """See ``Sequencer``; ``record``: the program's."""

    start_bytes = 8_000
    """Less: its own garbage is collected while a motion runs, too."""

    def __init__(self, controller: "Runner", record: "ProgramFile", name: bytes, rate: int) -> None:
        self.table = record.table()
        counters: "Any" = _Counters(self.table["counters"])
        super().__init__(controller, counters, name + program.SUFFIX.encode(), rate)
        self._source = record.source()
        self._file = record
        self._app: "Any" = None
        self._run_once: "Callable[[], None]" = self.prepare
        self._served_ms: "Any" = 0
        self._skipped = 0
        self._writes = False  # it has opened a file for writing
        self._percent = _PERCENT  # of the speed, in the present motion

    def begin(self) -> None:
        """Let the main loop execute it."""
        super().begin()
        self._controller.program = self

    advance = Sequencer.prepare  # it goes on by itself

    def execute(self, app: "Any", run_once: "Callable[[], None]") -> None:
        """Execute it to its end. ``run_once``: one pass of the main loop."""
        self._app = app
        self._run_once = run_once
        board = self._controller.board
        try:
            try:
                self._execute()
            except (Ended, SystemExit):
                pass
            except BaseException as error:
                self._fail(error)
            gc.collect()
            while board.engine.moving:
                run_once()
        finally:
            ending = sequence.STOPPED if self.stopping else sequence.FINISHED
            self._end(sequence.FAULTED if board.fault() else ending, board.fault())
            self.stopping = True  # what is left of it, such as a timer's callback, moves nothing any more

    def _execute(self) -> None:
        cell = Cell(self.table, self)
        names = {
            "__name__": "__main__",
            "print": self._print,
            "open": cell.opened,
            program.MARK: cell.at,
            program.EACH: cell.each,
            program.STILL: cell.still,
            program.FREE: cell.free,
        }
        source, self._source = self._source, ""
        code = compile(source, self.table["file"], "exec")
        del source
        gc.collect()
        before = list(sys.modules)
        armtempo_board.cell = cell
        self._app.runs_program = True
        try:
            exec(code, names)
        finally:
            self._app.runs_program = False
            cell.close_files()
            del armtempo_board.cell
            _forget_modules(before)

    def _fail(self, error: "BaseException") -> None:
        """Brake, set a fault, and tell the traceback of the program's own lines."""
        controller = self._controller
        if not controller.board.fault():
            controller.board.pending = codes.PROGRAM_FAILED
        if controller.board.engine.moving:
            controller.stop(0)
        gc.collect()  # what the program held
        try:
            text, line = _traceback(error, self.table["file"])
            self.status[STEP] = line or self.status[STEP]
        except Exception:  # memory is short, or what it printed is no text
            text = "%s in line %d" % (type(error).__name__, self.status[STEP])
        self._is_said()
        self._app.events.note_failure(text)

    def _print(self, *values: object, sep: str = " ", end: str = "\n", file: object = None) -> None:
        self.serve()
        self.say(sep.join([str(value) for value in values]))

    # what the cell works with, see ``cell.Work``

    def check(self) -> None:
        """Raise Ended after a stop or a fault."""
        if self.stopping or self._controller.board.fault():
            raise Ended

    def serve(self) -> None:
        """A pass of the loop."""
        self._run_once()
        self._skipped = 0
        self._served_ms = time.ticks_ms()
        self.check()

    def serve_if_due(self) -> None:
        """A pass, unless the last one was in this millisecond; but often enough if no time passes."""
        self._skipped += 1
        if self._skipped < _MOST_SKIPPED and time.ticks_ms() == self._served_ms:
            return
        self.serve()

    def note_line(self, line: int) -> None:
        """For 'status'."""
        self.status[STEP] = line

    def ticks_ms(self) -> "Any":
        """Of the board."""
        return time.ticks_ms()

    def passed_ms(self, begin_ms: "Any") -> int:
        """Also if ``ticks_ms`` began again meanwhile."""
        return int(time.ticks_diff(time.ticks_ms(), begin_ms))

    def moving(self) -> bool:
        """Whether a motion runs."""
        return bool(self._controller.board.engine.moving)

    def begin_motion(self, name: str, percent: int) -> None:
        """Start a stored motion."""
        self._begin(name, self.table["motions"].get(name), percent, "run(%r)" % name)

    def begin_move(self, target: "Sequence[int]", percent: int) -> None:
        """Start a move that the board makes."""
        board = self._controller.board
        for joint, steps in enumerate(target):
            row = board.engine.limits[joint]
            if not row["min_steps"] <= steps <= row["max_steps"]:
                raise CellError("goto: joint %d would leave its range" % (joint + 1))
        self._make_move(self.steps(), target, self.table["limits"], percent, "goto")

    def _make_move(
        self,
        start: "Sequence[int]",
        target: "Sequence[int]",
        limits: "Sequence[Sequence[int]]",
        percent: int,
        what: str,
        flags: int = 0,
    ) -> None:
        """Start a move; ``flags``: as for ``Controller.begin``, ``what``: the call, for errors."""
        board = self._controller.board
        most = [(min(speed, step_rates.one), acceleration, jerk) for speed, acceleration, jerk in limits]
        try:
            move = Move(start, target, most, step_rates.together, percent)
        except TooLongError:
            raise CellError("%s: it would take longer than the board can make a move" % what) from None
        at = 0
        try:
            for piece in move.pieces(board.arm_crc):
                at = board.once.put(at, move.size, piece)
        except Refused as refused:
            raise _cell_error(what, refused) from None
        del move
        self._begin(messages.ONCE_NAME, None, _PERCENT, what, flags)

    def _begin(self, name: str, crc: "int | None", percent: int, what: str, flags: int = 0) -> None:
        if self._writes:
            os.sync()  # otherwise MicroPython writes its cache later, while the arm moves
        try:
            self._percent = percent
            self._controller.begin_motion(name, crc, self._share(self._rate), flags)
        except Refused as refused:
            raise _cell_error(what, refused) from None

    def home(self, plan: "dict[str, Any]") -> None:
        """Home the arm."""
        from armtempo_board.app import homing  # here, as most programs are started on an arm that is homed

        homing.home(self, plan)

    def move_homing(
        self,
        start: "Sequence[int]",
        target: "Sequence[int]",
        limits: "Sequence[Sequence[int]]",
        seeks: bool,
    ) -> int:
        """Make a move of homing from where the joints are taken to be; returns as ``Homing.move``."""
        flags = messages.START_HOMING | messages.START_SEEKS * seeks
        self._make_move(start, target, limits, _PERCENT, "home", flags)
        moves = True
        while moves:
            moves = self.moving()
            self.serve()  # once more at rest: joints that were taken to be somewhere are unknown again
        return self._controller.board.fault_joint()

    def declare(self, mask: int, steps: "Sequence[int]") -> None:
        """The joints in ``mask`` are at these steps."""
        try:
            self._controller.home(mask, steps)
        except Refused as refused:
            raise _cell_error("home", refused) from None

    def range_steps(self, joint: int) -> "tuple[int, int]":
        """The ends of a joint's range."""
        row = self._controller.board.engine.limits[joint]
        return row["min_steps"], row["max_steps"]

    def _share(self, rate: int) -> int:
        return max(rate * self._percent // _PERCENT, messages.SLOWEST_PERMILLE)

    def brake(self) -> None:
        """Brake the motion."""
        self._controller.brake(0)

    def steps(self) -> "list[int]":
        """The joints' commanded steps."""
        board = self._controller.board
        return [board.engine.commanded(joint) for joint in range(board.joints)]

    def set_output(self, number: int, value: int) -> None:
        """Set an output."""
        self._controller.board.outputs.set(number, value)

    def level(self, number: int) -> int:
        """Of an input."""
        return int(self._controller.board.inputs.level(number))

    def place(self, number: int) -> "Sequence[int]":
        """Steps above a place of a pallet, and at it."""
        return self._file.place(number, self._controller.board.joints)

    def taken(self, pallet: "tuple[Any, ...]") -> int:
        """Of a pallet."""
        return int(self._controller.board.taken.get(pallet, 0))

    def note_taken(self, pallet: "tuple[Any, ...]", taken: int) -> None:
        """Keep it until another arm is taken, or the power fails."""
        self._controller.board.taken[pallet] = taken

    def count(self, name: str) -> int:
        """Increment a counter."""
        number = self._command.named(name.encode(), MAX_COUNTERS)
        if number < 0:
            raise CellError(TOO_MANY_COUNTERS)
        return self._command.count(number)

    def say(self, text: str) -> None:
        """Each line as a notice, which is lost if no host takes the one before, or none has said hello."""
        app = self._app
        for line in text.split("\n"):
            length = messages.MAX_PAYLOAD // (1 if len(line.encode()) == len(line) else 4)
            for at in range(0, len(line), length):
                if not self._is_said():
                    return
                self.check()
                app.events.note(line[at : at + length])
                if not app.commands.greeted:
                    self._run_once()  # at the REPL ``replay`` shows it; the next host does not get it
                    app.events.notice = b""

    def will_write(self) -> None:
        """The flash must be at rest when a motion starts."""
        self._writes = True

    def _is_said(self) -> bool:
        """Wait until the text before was sent; returns whether it was."""
        app = self._app
        begin_ms = time.ticks_ms()
        while app.events.notice and app.commands.greeted:
            now_ms = time.ticks_ms()
            most_ms = _SAY_MS if time.ticks_diff(now_ms, app.link.heard_ms) < _SAY_MS else _ALONE_MS
            if time.ticks_diff(now_ms, begin_ms) > most_ms:
                return False
            self._run_once()
        return True


class _Counters:
    """The counters of a program as those of a sequence's record."""

    def __init__(self, names: "list[str]") -> None:
        self.counters = len(names)
        self._names = names

    def counter(self, number: int) -> bytes:
        """Name of a counter."""
        return self._names[number].encode()


def _forget_modules(but: "list[str]") -> None:
    """Let the next program have its own modules: with its cell, and without tasks of this one (``asyncio``)."""
    for name in list(sys.modules):
        if name not in but and not name.startswith("armtempo"):
            del sys.modules[name]


def _cell_error(what: str, refused: Refused) -> CellError:
    """With the name of the code, joint and value."""
    joint = "" if refused.joint == messages.NO_JOINT else ", joint %d" % (refused.joint + 1)
    value = ", %d" % refused.value if refused.value else ""
    return CellError("%s is refused: %s%s%s" % (what, name_of(refused.code), joint, value))


def _traceback(error: "BaseException", file: str) -> "tuple[str, int]":
    """The last lines of a traceback that are in the program's file, and the error; the last line's number, or 0."""
    text = io.StringIO()
    sys.print_exception(error, text)
    text.seek(0)
    place = '  File "%s", line ' % file
    found = []
    line = 0
    for row in text:  # after endless recursion they are many, and memory is short
        row = row.rstrip("\n")
        if row.startswith(place):
            line = int(row[len(place) :].split(",")[0])
        elif row.startswith((" ", "Traceback")) or not row:
            continue
        found.append(row[:_LONGEST_ROW])  # what the host is told is cut at its begin
        if len(found) > _MOST_ROWS:
            found.pop(0)
    return "\n".join(found), line
