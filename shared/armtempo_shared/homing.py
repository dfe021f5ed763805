"""The law of homing by switches, on host and board: fast to the switch, back, slowly to it again, off it.

The joints of a group move together. A switch that trips ends the motion of all of them, and the others continue in
another motion. Each motion assumes that a joint is where it starts, as nobody knows where it is.
"""

from armtempo_shared.messages import NO_JOINT, OTHER_SWITCH

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    Number = int | float
    Lengths = dict[int, Number]

JOINT, SIDE, TRIP, EDGE, SPAN, FARTHEST, AWAY, BACK, MOST_PRESSED, TOLERANCE = range(10)
"""Numbers in the row of a joint, in steps, degrees or mm: see ``armtempo_shared.program``."""
MISSED, HELD, ELSEWHERE, PRESSED, SWAPPED, ON_THE_WAY = range(6)
"""What goes wrong: a switch does not trip; that of another joint stops it; it trips elsewhere than before; always; that
of another joint, or of the other end, trips in its place; one trips on the way to the home posture."""
_WORDS = {
    MISSED: (
        "no limit switch tripped within %(length).0f %(unit)s, its range and a margin",
        "check its wiring, its pin, its level ('active') and at which end it is in the arm file, its motor's "
        "direction, and where the joint stands",
    ),
    HELD: ("a switch of another joint stops it", "check the wiring of the switches"),
    ELSEWHERE: (
        "its limit switch tripped %(length).2f %(unit)s after it had been left by %(back)g",
        "check its wiring and that it sits firmly",
    ),
    PRESSED: (
        "its limit switch is still pressed %(length).0f %(unit)s away from where it tripped",
        "its level ('active' in the arm file) is probably inverted; or it is stuck, wired to another pin, or another "
        "joint stands on a switch at the same input",
    ),
    SWAPPED: (
        "%(other)s tripped in the place of its limit switch",
        "check which switch is on which input in the arm file, and its motor's direction",
    ),
    ON_THE_WAY: (
        "a switch tripped on the way to its home posture",
        "check the home position and the switches in the arm file",
    ),
}


class Homing:
    """A group of joints, by their rows; lengths are positive towards the switch. A subclass moves the arm.

    ``names``: name and unit of each joint of the arm; ``per_unit``: how many of the rows' lengths are one of those.
    """

    def __init__(
        self,
        rows: "Iterable[Sequence[Number]]",
        names: "Sequence[Sequence[str]]",
        per_unit: "Sequence[Number]",
    ) -> None:
        self.rows = {int(row[JOINT]): row for row in rows}
        self._names = names
        self._per_unit = per_unit

    def move(self, starts: "Lengths", ends: "Lengths", is_slow: bool, seeks: bool = False) -> int:
        """Move joints from where they are taken to be; returns the one whose switch ended it, or another number.

        ``seeks``: switches that the joints do not move to end it too, if they were not pressed at its start: returns
        their joint and ``OTHER_SWITCH``.
        """
        raise NotImplementedError

    def stands(self, joint: int) -> "Number":
        """Where a joint is after a motion."""
        raise NotImplementedError

    def error(self, problem: str, hint: str) -> Exception:
        """What to raise: what is wrong, and what to do."""
        raise NotImplementedError

    def failure(
        self, kind: int, joints: "Sequence[int]", length: "Number" = 0, other: int = NO_JOINT
    ) -> Exception:
        """What to raise; ``kind``: MISSED and so on, ``length``: of the way to the switch; ``other``: as from
        ``move``."""
        problem, hint = _WORDS[kind]
        first = joints[0]
        switch = other & ~OTHER_SWITCH
        found = {
            "length": length / self._per_unit[first],
            "back": self.rows[first][BACK] / self._per_unit[first],
            "unit": self._names[first][1],
            "other": "the switch of its other end",
        }
        if other != NO_JOINT and switch not in joints:
            found["other"] = "the switch of %s" % self._names[switch][0]
        names = ", ".join([self._names[joint][0] for joint in joints])
        return self.error("%s: %s" % (names, problem % found), hint)

    def seen(self, lengths: "Lengths") -> None:
        """The switches were found, so far from the start."""

    def find(self) -> None:
        """Find the switches; afterwards each joint is AWAY from where its switch trips, within its range."""
        self.seen(self._approach(self._lengths(FARTHEST), False))
        self._approach_again()
        self._leave(self._lengths(AWAY))

    def _lengths(self, index: int) -> "Lengths":
        return {joint: row[index] for joint, row in self.rows.items()}

    def _approach_again(self) -> None:
        """Back off and approach slowly; a joint whose switch trips at once started on it, and backs off further."""
        left: "Lengths" = dict.fromkeys(self.rows, 0)
        pressed = list(self.rows)
        while pressed:
            back = {joint: self.rows[joint][BACK] for joint in pressed}
            self._leave(back)
            moved = self._approach({joint: 2 * length for joint, length in back.items()}, True)
            pressed = []
            for joint, length in moved.items():
                left[joint] += back[joint] - length
                if 2 * length > 3 * back[joint]:
                    raise self.failure(ELSEWHERE, [joint], length)
                if 2 * length < back[joint]:
                    pressed.append(joint)
            stuck = [
                joint
                for joint in pressed
                if left[joint] + self.rows[joint][TOLERANCE] >= self.rows[joint][MOST_PRESSED]
            ]
            if stuck:
                raise self.failure(PRESSED, stuck, left[stuck[0]])

    def _approach(self, lengths: "Lengths", is_slow: bool) -> "Lengths":
        """Move joints towards their switches until all have tripped; returns how far each has moved."""
        left = dict(lengths)
        moved: "Lengths" = dict.fromkeys(left, 0)
        seeks = not is_slow
        suspect = NO_JOINT
        while left:
            starts, ends = {}, {}
            for joint, length in left.items():
                row = self.rows[joint]
                ends[joint] = row[EDGE]
                starts[joint] = row[EDGE] - row[SIDE] * min(length, row[SPAN])
            tripped = self.move(starts, ends, is_slow, seeks)
            missed = []
            is_held = True
            is_back = False
            for joint, start in starts.items():
                length = abs(self.stands(joint) - start)
                moved[joint] += length
                left[joint] -= length
                if left[joint] <= self.rows[joint][TOLERANCE]:
                    missed.append(joint)
                if length > self.rows[joint][TOLERANCE]:
                    is_held = False
                if 4 * abs(length - self.rows[joint][BACK]) < self.rows[joint][BACK]:
                    is_back = True
            if tripped in left:
                del left[tripped]
                if left and seeks:  # is it that of another one, which presses it?
                    suspect = tripped | OTHER_SWITCH
                    self._step_back(left, moved)
            elif tripped != NO_JOINT and tripped & OTHER_SWITCH:
                if tripped == suspect and is_back:  # where it was left: it is no disturbance
                    raise self.failure(SWAPPED, list(left), 0, tripped)
                seeks = suspect == NO_JOINT
                suspect = tripped
                has_come = [joint for joint in left if moved[joint] > self.rows[joint][BACK]]
                if self._step_back(left, moved) == tripped & ~OTHER_SWITCH and has_come:
                    raise self.failure(SWAPPED, list(left), 0, tripped)  # it does not let the joint go back
            elif missed:
                raise self.failure(MISSED, missed, lengths[missed[0]])
            elif is_held:
                raise self.failure(HELD, list(left))
        return moved

    def _step_back(self, left: "Lengths", moved: "Lengths") -> int:
        """On the way to the switches, move back a little; returns as ``move``."""
        ended = self._leave({joint: self.rows[joint][BACK] for joint in left})
        for joint in left:
            length = abs(self.stands(joint) - self.rows[joint][EDGE])
            left[joint] += length
            moved[joint] -= length
        return ended

    def _leave(self, lengths: "Lengths") -> int:
        starts, ends = {}, {}
        for joint, length in lengths.items():
            row = self.rows[joint]
            starts[joint] = row[EDGE]
            ends[joint] = row[EDGE] - row[SIDE] * length
        return self.move(starts, ends, False)
