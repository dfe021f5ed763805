"""Homing by switches in a user's program (``cell.home``), as a host does it; loaded by the first call.

The law is that of ``armtempo_shared.homing``. Each group of joints is declared to be where it is then, and moves home.
The motions assume that a joint is at their start; it is unknown again at their end, until it is declared.
"""

from armtempo_shared.homing import AWAY, ON_THE_WAY, SIDE, TRIP, Homing
from armtempo_shared.messages import NO_JOINT

from armtempo_board.app.cell import CellError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    Steps = dict[int, Any]


def home(program: "Any", plan: "dict[str, Any]") -> None:
    """Home the joints of a ``UserProgram``; raises CellError if a switch does not do what it should."""
    for group in plan["groups"]:
        _Group(program, plan, group).home()


class _Group(Homing):
    """Joints that are homed together; lengths are in steps."""

    def __init__(self, program: "Any", plan: "dict[str, Any]", group: "list[list[int]]") -> None:
        super().__init__(group, plan["names"], program.table["per_deg"])
        self._program = program
        self._limits = plan["fast"], plan["slow"]

    def home(self) -> None:
        """Home them."""
        self.find()
        steps = self._program.steps()
        mask = 0
        for joint, row in self.rows.items():
            steps[joint] = row[TRIP] - row[SIDE] * row[AWAY]
            mask |= 1 << joint
        self._program.declare(mask, steps)
        self._go_home()

    def error(self, problem: str, hint: str) -> CellError:
        """For the program."""
        return CellError("home: %s; %s" % (problem, hint))

    def stands(self, joint: int) -> int:
        """In steps."""
        return int(self._program.steps()[joint])

    def _go_home(self) -> None:
        steps = self._program.steps()
        home = self._program.table["postures"]["home"]
        ends = {joint: home[joint] for joint in self.rows}
        tripped = self.move({joint: steps[joint] for joint in ends}, ends, False)
        if tripped != NO_JOINT:
            raise self.failure(ON_THE_WAY, [tripped])

    def move(self, starts: "Steps", ends: "Steps", is_slow: bool, seeks: bool = False) -> int:
        """See ``Homing``; NO_JOINT if no switch ended it."""
        start = self._program.steps()
        for joint in range(len(start)):  # also where others are, which may be unknown
            low, high = self._program.range_steps(joint)
            start[joint] = min(max(starts.get(joint, start[joint]), low), high)
        target = list(start)
        for joint, steps in ends.items():
            target[joint] = steps
        return self._program.move_homing(start, target, self._limits[is_slow], seeks)  # type: ignore[no-any-return]
