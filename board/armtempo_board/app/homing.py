"""Homing by switches in a user's program (``cell.home``), as a host does it; loaded by the first call.

Each group of joints approaches its switches, backs off, approaches slowly, backs off into the range, is declared to be
there, and moves home. The motions assume that a joint is at their start; it is unknown again at their end, until it is
declared. A switch that trips ends the motion of all joints of the group; the others continue in another motion.
"""

from armtempo_shared.messages import NO_JOINT
from micropython import const

from armtempo_board.app.cell import CellError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Any

    Steps = dict[int, int]
    Limits = list[list[int]]

# what the record says of a joint's switch, see armtempo_shared.program; lengths are positive towards the switch
_JOINT = const(0)
_SIDE = const(1)
_TRIP = const(2)
_EDGE = const(3)
_SPAN = const(4)
_FARTHEST = const(5)
_AWAY = const(6)
_BACK = const(7)
_MOST_PRESSED = const(8)
_TOLERANCE = const(9)


def home(program: "Any", plan: "dict[str, Any]") -> None:
    """Home the joints of a ``UserProgram``; raises CellError if a switch does not do what it should."""
    for group in plan["groups"]:
        _Group(program, plan, group).home()


class _Group:
    """Joints that are homed together."""

    def __init__(self, program: "Any", plan: "dict[str, Any]", group: "list[list[int]]") -> None:
        self._program = program
        self._fast: "Limits" = plan["fast"]
        self._slow: "Limits" = plan["slow"]
        self._rows = {row[_JOINT]: row for row in group}

    def home(self) -> None:
        """Home them."""
        self._approach(self._lengths(_FARTHEST), self._fast)
        self._approach_again()
        self._leave(self._lengths(_AWAY))
        steps = self._program.steps()
        mask = 0
        for joint, row in self._rows.items():
            steps[joint] = row[_TRIP] - row[_SIDE] * row[_AWAY]
            mask |= 1 << joint
        self._program.declare(mask, steps)
        self._go_home()

    def _lengths(self, index: int) -> "Steps":
        return {joint: row[index] for joint, row in self._rows.items()}

    def _approach_again(self) -> None:
        """Back off and approach slowly; a joint whose switch trips at once started on it, and backs off further."""
        left = dict.fromkeys(self._rows, 0)
        pressed = list(self._rows)
        while pressed:
            back = {joint: self._rows[joint][_BACK] for joint in pressed}
            self._leave(back)
            moved = self._approach({joint: 2 * steps for joint, steps in back.items()}, self._slow)
            pressed = []
            for joint, steps in moved.items():
                left[joint] += back[joint] - steps
                if 2 * steps > 3 * back[joint]:
                    raise CellError(
                        "home: the switch of joint %d tripped elsewhere than before; check its wiring and that it sits "
                        "firmly" % (joint + 1)
                    )
                if 2 * steps < back[joint]:
                    pressed.append(joint)
            stuck = [joint for joint in pressed if left[joint] > self._rows[joint][_MOST_PRESSED]]
            if stuck:
                raise CellError(
                    "home: the switch of joint %s stays pressed; its level is probably inverted, or it is stuck"
                    % _numbers(stuck)
                )

    def _approach(self, lengths: "Steps", limits: "Limits") -> "Steps":
        """Move joints towards their switches until all have tripped; returns how far each has moved."""
        left = dict(lengths)
        moved = dict.fromkeys(left, 0)
        while left:
            starts, ends = {}, {}
            for joint, length in left.items():
                row = self._rows[joint]
                ends[joint] = row[_EDGE]
                starts[joint] = row[_EDGE] - row[_SIDE] * min(length, row[_SPAN])
            tripped = self._move(starts, ends, limits)
            steps = self._program.steps()
            missed = []
            stands = True
            for joint, start in starts.items():
                length = abs(steps[joint] - start)
                moved[joint] += length
                left[joint] -= length
                if left[joint] <= self._rows[joint][_TOLERANCE]:
                    missed.append(joint)
                if length > self._rows[joint][_TOLERANCE]:
                    stands = False
            if tripped in left:
                del left[tripped]
            elif missed:
                raise CellError(
                    "home: no switch of joint %s tripped on the way through its range; check its wiring, pin and level"
                    % _numbers(missed)
                )
            elif stands:
                raise CellError("home: a switch of another joint stops joint %s" % _numbers(left))
        return moved

    def _leave(self, lengths: "Steps") -> None:
        starts, ends = {}, {}
        for joint, length in lengths.items():
            row = self._rows[joint]
            starts[joint] = row[_EDGE]
            ends[joint] = row[_EDGE] - row[_SIDE] * length
        self._move(starts, ends, self._fast)

    def _go_home(self) -> None:
        steps = self._program.steps()
        home = self._program.table["postures"]["home"]
        ends = {joint: home[joint] for joint in self._rows}
        tripped = self._move({joint: steps[joint] for joint in ends}, ends, self._fast)
        if tripped != NO_JOINT:
            raise CellError("home: the switch of joint %d tripped on the way home" % (tripped + 1))

    def _move(self, starts: "Steps", ends: "Steps", limits: "Limits") -> int:
        """Move joints from where they are taken to be; returns the joint whose switch ended it, or NO_JOINT."""
        start = self._program.steps()
        for joint in range(len(start)):  # also where others are, which may be unknown
            low, high = self._program.range_steps(joint)
            start[joint] = min(max(starts.get(joint, start[joint]), low), high)
        target = list(start)
        for joint, steps in ends.items():
            target[joint] = steps
        return self._program.move_homing(start, target, limits)  # type: ignore[no-any-return]


def _numbers(joints: "Iterable[int]") -> str:
    return ", ".join([str(joint + 1) for joint in sorted(joints)])
