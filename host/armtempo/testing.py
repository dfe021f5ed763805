"""Tests of programs for the board without a board: a cell whose motions take no time.

::

    from armtempo import testing

    def test_places_what_comes():
        run = testing.run("pick.py", "my_arm.toml", inputs={"part": True}, moves=10)
        assert run.counters["parts"] == 2
        assert ("set", "gripper", "closed") in run.calls

Names, ranges and values are checked by the code that checks them on the board (``armtempo_board.app.cell``).
"""

from __future__ import annotations

import builtins
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import armtempo_board
import numpy as np
from armtempo_board.app.cell import TOO_MANY_COUNTERS, Cell, CellError, Ended
from armtempo_board.app.pallet import Place
from armtempo_shared.program import EACH, FREE, MARK, STILL
from armtempo_shared.rest_to_rest import PERCENT
from armtempo_shared.sequence import MAX_COUNTERS

from armtempo.basics.errors import InputError
from armtempo.encoding import encode, encoded_program, made_with
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.model.user_program import UserProgram

LONGEST_S = 3600.0
"""A program is stopped after this time of its own."""
_AT_START_STEPS = 1

Level = bool | Callable[["ProgramRun"], bool]
"""Of an input: always, or at each look."""


@dataclass
class ProgramRun:
    """What a program did."""

    calls: list[tuple[Any, ...]] = field(default_factory=list)
    """("home",), ("goto", name or angles), ("run", motion), ("set", output, value), ("tool", name), in order; ``start``
    counts as "run", and a place of a pallet has the name "row 1, column 1, layer 1 of pallet 'tray'"."""
    said: list[str] = field(default_factory=list)
    """What it printed, line by line."""
    counters: dict[str, int] = field(default_factory=dict)
    outputs: dict[str, float] = field(default_factory=dict)
    """The last values, in the unit of each; at first the safe ones."""
    taken: dict[str, int] = field(default_factory=dict)
    """Number of places taken of pallets that are not full, for the next program."""
    posture_deg: tuple[float, ...] = ()
    """Where the arm is."""
    time_s: float = 0.0
    """What its waits and motions took."""
    stopped: bool = False
    """Whether it was stopped, by ``moves`` or after ``LONGEST_S``; else it came to its end."""

    @property
    def moves(self) -> int:
        """Number of motions and moves."""
        return sum(call[0] in ("goto", "run") for call in self.calls)


def run(
    program: Path | str,
    arm: Arm | Path | str,
    inputs: Mapping[str, Level] | None = None,
    *,
    moves: int = 0,
    motion_s: float = 0.0,
    taken: Mapping[str, int] | None = None,
) -> ProgramRun:
    """Run a program from the home posture, and return what it did; what it raises passes through.

    ``inputs``: levels by name, False for others. ``moves``: stop it instead of one more motion; 0: never.
    ``motion_s``: time that each motion takes. ``taken``: places that a program before has taken of pallets, by name.
    A motion that it runs is a planned file NAME.json beside it. Raises InputError as ``UserProgram.load``, and for
    an input that the arm does not have.
    """
    arm = Arm.of(arm)
    found = UserProgram.load(program, arm)
    for name in inputs or {}:
        arm.input(name)
    places = encoded_program.places_of(arm, found)
    table = encoded_program.table(arm, found, places)
    rows = encoded_program.rows(arm, places)
    work = _Work(found, arm, inputs or {}, _Ends(moves, motion_s), rows)
    work.run.taken.update(taken or {})
    cell = _Recorded(table, work)
    names = {
        "__name__": "__main__",
        "print": work.print,
        "open": cell.opened,
        MARK: cell.at,
        EACH: cell.each,
        STILL: cell.still,
        FREE: cell.free,
    }
    before = vars(armtempo_board).get("cell")
    armtempo_board.cell = cell
    try:
        exec(compile(found.marked, str(found.path), "exec"), names)
    except Ended:
        work.run.stopped = True
    except SystemExit:
        pass
    finally:
        cell.close_files()
        armtempo_board.cell = before  # type: ignore[assignment]
    return work.run


@dataclass(frozen=True)
class _Ends:
    moves: int
    motion_s: float


class _Recorded(Cell):
    """Notes what is called."""

    def __init__(self, table: dict[str, Any], work: _Work) -> None:
        super().__init__(table, work)
        self._run = work.run

    def goto(
        self,
        posture: str | Place | Sequence[float],
        speed: float = 1.0,
        wait: bool = True,
        line: bool = False,
    ) -> None:
        super().goto(posture, speed, wait, line)
        where = posture.name if isinstance(posture, Place) else posture
        self._run.calls.append(("goto", where if isinstance(where, str) else tuple(where)))

    def home(self) -> None:
        super().home()
        self._run.calls.append(("home",))

    def tool(self, name: str) -> None:
        super().tool(name)
        self._run.calls.append(("tool", name))

    def start(self, motion: str, speed: float = 1.0) -> None:
        super().start(motion, speed)
        self._run.calls.append(("run", motion))

    def set(self, output: str, value: str | float, wait_s: float = 0.0) -> None:
        super().set(output, value, wait_s)
        self._run.calls.append(("set", output, value))


class _Work:
    """Does what a cell asks for; see ``armtempo_board.app.cell.Work``."""

    def __init__(
        self,
        program: UserProgram,
        arm: Arm,
        inputs: Mapping[str, Level],
        ends: _Ends,
        places: list[list[int]],
    ) -> None:
        self.run = ProgramRun(outputs={output.name: output.safe for output in arm.outputs})
        self._program = program
        self._arm = arm
        self._inputs = [inputs.get(entry.name, False) for entry in arm.inputs]
        self._ends = ends
        self._places = places
        self._now_ms = 0
        self._rests_ms = 0
        self._steps = arm.transmission.whole_steps(arm.home_deg)
        self._limits = [(row["min_steps"], row["max_steps"]) for row in encode.motor_rows(arm)]
        self.run.posture_deg = tuple(float(angle) for angle in arm.home_deg)

    def check(self) -> None:
        if self.run.time_s > LONGEST_S:
            raise Ended

    def serve(self) -> None:
        self._now_ms += 1
        self.run.time_s = self._now_ms / 1000
        self.check()

    serve_if_due = serve

    def note_line(self, line: int) -> None:
        """Nothing to do."""

    def ticks_ms(self) -> int:
        return self._now_ms

    def passed_ms(self, begin_ms: int) -> int:
        return self._now_ms - begin_ms

    def moving(self) -> bool:
        return self._now_ms < self._rests_ms

    def begin_motion(self, name: str, percent: int) -> None:
        file = self._program.motion_file(name)
        if not file.is_file():
            raise InputError(f"no motion {name!r}: {file} does not exist", "plan it")
        plan = Plan.load_motion(file)
        made_with.check_plan(file, plan, self._arm)
        motion = plan.trajectory
        start = self._arm.transmission.whole_steps(motion(0.0))
        off = np.abs(np.subtract(start, self._steps))
        if off.max() > _AT_START_STEPS:
            raise CellError(f"run({name!r}) is refused: wrong_start, joint {off.argmax() + 1}")
        self._move(self._arm.transmission.whole_steps(motion(motion.duration_s)), percent)

    def begin_move(self, target: Sequence[int], percent: int) -> None:
        for joint, (steps, (low, high)) in enumerate(zip(target, self._limits, strict=True), 1):
            if not low <= steps <= high:
                raise CellError(f"goto: joint {joint} would leave its range")
        self._move(list(target), percent)

    def home(self, plan: dict[str, Any]) -> None:
        self._move(self._arm.transmission.whole_steps(self._arm.home_deg), PERCENT)

    def _move(self, target: list[int], percent: int) -> None:
        if self._ends.moves and self.run.moves >= self._ends.moves:
            raise Ended
        self._steps = target
        self._rests_ms = self._now_ms + round(1000 * self._ends.motion_s * 100 / percent)
        self.run.posture_deg = tuple(self._arm.transmission.angles_of_steps(target).tolist())

    def brake(self) -> None:
        self._rests_ms = self._now_ms

    def steps(self) -> list[int]:
        return list(self._steps)

    def set_output(self, number: int, value: int) -> None:
        output = self._arm.outputs[number]
        self.run.outputs[output.name] = output.value(value)

    def level(self, number: int) -> int:
        level = self._inputs[number]
        return int(level(self.run) if callable(level) else level)

    def place(self, number: int) -> list[int]:
        return self._places[number]

    def taken(self, pallet: tuple[Any, ...]) -> int:
        return self.run.taken.get(pallet[0], 0)

    def note_taken(self, pallet: tuple[Any, ...], taken: int) -> None:
        self.run.taken[pallet[0]] = taken

    def count(self, name: str) -> int:
        if len({*self.run.counters, *self._program.counters, name}) > MAX_COUNTERS:
            raise CellError(TOO_MANY_COUNTERS)
        self.run.counters[name] = self.run.counters.get(name, 0) + 1
        return self.run.counters[name]

    def say(self, text: str) -> None:
        self.run.said += filter(None, text.split("\n"))

    def will_write(self) -> None:
        """Nothing to do."""

    def print(self, *values: object, sep: str = " ", end: str = "\n", file: object = None) -> None:
        """As on the board; also where pytest shows it."""
        self.say(sep.join(map(str, values)))
        builtins.print(*values, sep=sep, end=end)
