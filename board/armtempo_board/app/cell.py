"""The interface of a user's program: ``from armtempo_board import cell``.

Names are those of the arm file. What the calls do is done by a ``Work``: the board (``user_program.py``), or a test's
(``armtempo.testing``).
"""

from armtempo_shared.limits import MAX_NAME
from armtempo_shared.sequence import MAX_COUNTERS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import Any, Protocol

    from armtempo_board.app.pallet import Pallet, Place

    class Work(Protocol):
        """What a cell does its work with."""

        def check(self) -> None:
            """Raise Ended if the program was stopped, or a fault is pending."""

        def serve(self) -> None:
            """One pass of the board's loop, then ``check``."""

        def serve_if_due(self) -> None:
            """The same, if the last pass is a millisecond ago."""

        def note_line(self, line: int) -> None:
            """The program is at this line."""

        def ticks_ms(self) -> "Any":
            """The time in ms; after days it begins again."""

        def passed_ms(self, begin_ms: "Any") -> int:
            """Since a time of ``ticks_ms``."""

        def moving(self) -> bool:
            """Whether a motion runs."""

        def begin_motion(self, name: str, percent: int) -> None:
            """Start a stored motion; raises CellError."""

        def begin_move(self, target: "Sequence[int]", percent: int) -> None:
            """Start a move to a position in steps; raises CellError."""

        def brake(self) -> None:
            """Brake the motion."""

        def home(self, plan: "dict[str, Any]") -> None:
            """Home the arm by its switches; ``plan``: as the record has it. Raises CellError."""

        def steps(self) -> "list[int]":
            """Position of the joints."""

        def set_output(self, number: int, value: int) -> None:
            """Set an output, 0 to 65535."""

        def level(self, number: int) -> int:
            """Whether an input is active."""

        def place(self, number: int) -> "Sequence[int]":
            """The steps of each joint above a place of a pallet, then those at it."""

        def taken(self, pallet: "tuple[Any, ...]") -> int:
            """Number of places taken of a pallet, by its name and shape."""

        def note_taken(self, pallet: "tuple[Any, ...]", taken: int) -> None:
            """Keep this number for this program and later ones."""

        def count(self, name: str) -> int:
            """Increment a counter; returns its value."""

        def say(self, text: str) -> None:
            """Show a text to the host."""

        def will_write(self) -> None:
            """The program writes to the flash: nothing of it may be left to write when a motion starts."""


TOO_MANY_COUNTERS = "more than %d counters" % MAX_COUNTERS
NO_LINE = (
    "goto: the board moves all joints together; plan a motion with a straight line of the tool, and run it"
)
_FULL = 65535  # value of an output at the upper end of its range
_LONGEST_S = 3600.0
_LEAST_PERCENT = 1
_PERCENT = 100
_NOTHING = "nothing"
_NO_POSTURES = (set, dict, bytes)  # as they have no order, or no angles
_NAMED = ("pallets", "tools")  # the host sends those that it finds in the text


class CellError(Exception):
    """What a program asked for is not possible; nothing was done."""


class Ended(BaseException):
    """The program was stopped, or a fault is pending: it ends."""


class Cell:
    """The cell of a program; ``table``: that of its record (``armtempo_shared.program``)."""

    Error = CellError

    def __init__(self, table: "dict[str, Any]", work: "Work") -> None:
        self._table = table
        self._work = work
        self.tool_name = ""
        self._pallets: "dict[str, Pallet]" = {}
        self._files: "list[tuple[str, Any]]" = []  # that it has opened for writing

    # moving

    def home(self) -> None:
        """Home all joints by their switches, in the order of the arm file, and move to the home posture."""
        plan = self._table.get("homing")
        if not plan:
            raise CellError("the program's text has no call of home")
        self._rest()
        self._check_files()
        self._work.home(plan)

    def goto(
        self,
        posture: "str | Place | Sequence[float]",
        speed: float = 1.0,
        wait: bool = True,
        line: bool = False,
    ) -> None:
        """Move to a posture, all joints together; ``speed``: 0.01 to 1.

        ``posture``: a name, the joints' angles in degrees, or a place of a pallet.

        A sliding joint is given in mm. ``wait`` False: return at once, while the arm moves. ``line``: False, as only a
        planned motion moves the tool along a line.
        """
        if line:
            raise CellError(NO_LINE)
        target = self._target(posture)
        percent = _percent(speed)
        self._rest()
        if target != self._work.steps():
            self._check_files()
            self._work.begin_move(target, percent)
        if wait:
            self._rest()

    def run(self, motion: str, speed: float = 1.0) -> None:
        """Run a stored motion to its end; the arm must be at its start."""
        self.start(motion, speed)
        self._rest()

    def start(self, motion: str, speed: float = 1.0) -> None:
        """Start a stored motion; ``wait()`` waits for its end."""
        _check_name("motion", motion)
        percent = _percent(speed)
        self._rest()
        self._check_files()
        self._work.begin_motion(motion, percent)

    def moving(self) -> bool:
        """Whether the arm moves."""
        self._work.serve()
        return self._work.moving()

    def brake(self) -> None:
        """Brake the motion along its path; ``wait()`` waits for rest, and ``goto`` moves on from there."""
        self._work.check()
        if self._work.moving():
            self._work.brake()

    def posture(self) -> "list[float]":
        """The joints' angles in degrees, positions of sliding ones in mm, as commanded."""
        return [steps / per_deg for steps, per_deg in zip(self._work.steps(), self._table["per_deg"])]

    # places and tools

    def pallet(self, name: str) -> "Pallet":
        """A pallet of the arm file; it goes on where the last program left it, unless that was full."""
        _check_name("pallet", name)
        if name not in self._pallets:
            shape = self._found("pallets", "pallet", name)
            from armtempo_board.app.pallet import Pallet  # here, as most programs have none

            self._pallets[name] = Pallet(self, self._work, name, shape)
        return self._pallets[name]

    def tool(self, name: str) -> None:
        """Say which tool of the arm file is on the arm, "nothing": none, as at first.

        Postures given as tool poses, and places, are then of its point.
        """
        if name == _NOTHING:
            self.tool_name = ""
            return
        self._found("tools", "tool", name)
        self.tool_name = name

    # outputs and inputs

    def set(self, output: str, value: "str | float", wait_s: float = 0.0) -> None:
        """Set an output to a state of the arm file, or a number in its unit, and wait so long."""
        number, low, high, states = self._found("outputs", "output", output)
        if isinstance(value, str):
            if value not in states:
                raise CellError("output %r has no state %r; it has %s" % (output, value, _names(states)))
            raw = states[value]
        else:
            if not _is_within(low, value, high):
                raise CellError("output %r: %r is not within %r to %r" % (output, value, low, high))
            raw = int((value - low) / (high - low) * _FULL + 0.5)
        wait_ms = _ms(wait_s)
        self._work.check()
        self._work.set_output(number, raw)
        if wait_ms:
            self._sleep(wait_ms)

    def active(self, input: str) -> bool:
        """Whether an input is active, debounced."""
        number = self._found("inputs", "input", input)
        self._work.serve()
        return bool(self._work.level(number))

    def wait(self, input: str = "", active: bool = True, timeout_s: float = 0.0) -> bool:
        """Wait until an input is active (or not), without a name until the arm is at rest.

        Returns False if that takes longer than ``timeout_s``; 0: no limit.
        """
        work = self._work
        number = -1 if input == "" else self._found("inputs", "input", input)
        limit_ms = _ms(timeout_s)
        begin_ms = work.ticks_ms()
        while True:
            work.serve()
            if not work.moving() if number < 0 else bool(work.level(number)) == bool(active):
                return True
            if limit_ms and work.passed_ms(begin_ms) >= limit_ms:
                return False

    # the rest

    def sleep(self, time_s: float) -> None:
        """Wait; the arm may move meanwhile."""
        self._sleep(_ms(time_s))

    def _sleep(self, limit_ms: int) -> None:
        work = self._work
        begin_ms = work.ticks_ms()
        work.serve()
        while work.passed_ms(begin_ms) < limit_ms:
            work.serve()

    def count(self, name: str) -> int:
        """Increment a counter, which 'armtempo status' shows; returns its value."""
        self._work.check()
        _check_name("counter", name)
        if not 0 < len(name.encode()) <= MAX_NAME:
            raise CellError("count: the name %r has not 1 to %d bytes" % (name, MAX_NAME))
        return self._work.count(name)

    def say(self, *values: object) -> None:
        """Show values to the host, as ``print`` does in a program."""
        self._work.serve()
        self._work.say(" ".join([str(value) for value in values]))

    async def serve(self) -> None:
        """A task for a program with ``asyncio``: the board's work between the other tasks."""
        import asyncio

        while True:
            self._work.serve()
            await asyncio.sleep(0)

    # what the marked source calls, see armtempo_shared.program

    def at(self, line: int, value: "Any" = None) -> "Any":
        """The program is at this line: in a call of ``value``, the cell, which is returned; or at a loop's head."""
        self._work.note_line(line)
        if value is None:
            self._work.serve_if_due()
            return True
        return value

    def each(self, line: int, values: "Iterable[Any]") -> "Iterable[Any]":
        """The values, one by one: the program is at this line before each."""
        for value in values:
            self.at(line)
            yield value

    def still(self, line: int, call: str, value: "Any") -> "Any":
        """The program is at this line, in a ``call`` of ``value`` that writes to the flash: Error while it moves."""
        self._work.note_line(line)
        self._check_still(call)
        return value

    def free(self, line: int, value: "Any") -> "Any":
        """The program is at this line, where it takes a pin or timer: Error if that is the arm's."""
        self._work.note_line(line)
        name = value.name() if hasattr(value, "name") else value
        if isinstance(name, str):
            name = name.lstrip("P")
        if name in self._table.get("taken", ()):  # absent in a record of an older host
            raise CellError("%s %s is taken by the arm" % ("pin" if isinstance(name, str) else "timer", name))
        return value

    # in the place of ``open``

    def opened(self, path: str, mode: str = "r", **more: "Any") -> "Any":
        """A file; for writing only at rest, as the chip stands still while its flash is written."""
        if not mode.strip("rbt"):
            return open(path, mode, **more)
        self._check_still("open: %r" % path)
        file = open(path, mode, **more)  # noqa: SIM115  the program closes it
        self._files.append((path, file))
        return file

    def close_files(self) -> None:
        """Close what the program has left open."""
        for _, file in self._files:
            file.close()

    def _check_still(self, what: str) -> None:
        if self._work.moving():
            raise CellError(
                "%s: the flash cannot be written while the arm moves; cell.wait() waits for rest" % what
            )
        self._work.will_write()

    def _check_files(self) -> None:
        """Raise Error if a file is open for writing, as what is in it would be written while the arm moves."""
        self._files = [(path, file) for path, file in self._files if _is_open(file)]
        for path, _ in self._files:
            raise CellError("%r is still open for writing: close it before the arm moves" % path)

    def _rest(self) -> None:
        """Wait for the end of a motion."""
        self._work.serve()
        while self._work.moving():
            self._work.serve()

    def _target(self, posture: "str | Place | Sequence[float]") -> "list[int]":
        found: "list[int]"
        if isinstance(posture, str):
            tool = self.tool_name
            if tool and posture in self._table["tools"][tool]:
                found = self._table["tools"][tool][posture]
                if not found:
                    raise CellError("posture %r cannot be reached with tool %r" % (posture, tool))
                return found
            found = self._found("postures", "posture", posture)
            return found
        if hasattr(posture, "steps"):  # a place
            found = posture.steps
            return found
        per_deg = self._table["per_deg"]
        try:
            if not isinstance(posture, _NO_POSTURES) and len(posture) == len(per_deg):
                return [_rounded(angle * scale) for angle, scale in zip(posture, per_deg)]
            given = repr(posture) if isinstance(posture, _NO_POSTURES) else str(len(posture))
        except (TypeError, ValueError, OverflowError):
            given = repr(posture)
        raise CellError("a posture has %d angles, not %s" % (len(per_deg), given))

    def _found(self, kind: str, word: str, name: str) -> "Any":
        _check_name(word, name)
        found = self._table[kind]
        if name not in found:
            has = "the program's text" if kind in _NAMED else "the arm"
            raise CellError("%s has no %s %r; it has %s" % (has, word, name, _names(found)))
        return found[name]


def _is_open(file: "Any") -> bool:
    try:
        file.flush()
    except (OSError, ValueError):
        return False
    return True


def _check_name(word: str, name: "Any") -> None:
    if not isinstance(name, str):
        raise CellError("the name of the %s is a text, not %r" % (word, name))


def _names(found: "Iterable[str]") -> str:
    return ", ".join(sorted(found)) or "none"


def _rounded(value: float) -> int:
    return int(value + 0.5) if value >= 0 else -int(0.5 - value)


def _is_within(low: float, value: "Any", high: float) -> bool:
    """Whether a value is a number in a range."""
    try:
        return bool(low <= value <= high)
    except TypeError:
        return False


def _percent(speed: float) -> int:
    percent = int(speed * _PERCENT + 0.5) if _is_within(0, speed, 2) else 0
    if not _LEAST_PERCENT <= percent <= _PERCENT:
        raise CellError("speed = %r is not within 0.01 to 1" % (speed,))
    return percent


def _ms(time_s: float) -> int:
    if not _is_within(0, time_s, _LONGEST_S):
        raise CellError("%r s is not within 0 to %d" % (time_s, _LONGEST_S))
    return int(time_s * 1000 + 0.5)
