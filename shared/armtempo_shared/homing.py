"""The law of homing by switches, on host and board: fast to the switch, back, slowly to it again, off it.

The joints of a group move together. A switch that trips ends the motion of all of them, and the others continue in
another motion. Each motion assumes that a joint is where it starts, as nobody knows where it is.
"""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    Number = int | float
    Lengths = dict[int, Number]

JOINT, SIDE, TRIP, EDGE, SPAN, FARTHEST, AWAY, BACK, MOST_PRESSED, TOLERANCE = range(10)
"""Numbers in the row of a joint, in steps, degrees or mm: see ``armtempo_shared.program``."""
MISSED, HELD, ELSEWHERE, PRESSED = range(4)
"""What goes wrong: a switch does not trip; that of another joint stops it; it trips elsewhere than before; always."""


class Homing:
    """A group of joints, by their rows. Lengths are positive towards the switch. A subclass moves the arm."""

    def __init__(self, rows: "Iterable[Sequence[Number]]") -> None:
        self.rows = {int(row[JOINT]): row for row in rows}

    def move(self, starts: "Lengths", ends: "Lengths", is_slow: bool) -> int:
        """Move joints from where they are taken to be; returns the one whose switch ended it, or another number."""
        raise NotImplementedError

    def stands(self, joint: int) -> "Number":
        """Where a joint is after a motion."""
        raise NotImplementedError

    def failure(self, kind: int, joints: "Sequence[int]", length: "Number") -> Exception:
        """What to raise; ``kind``: MISSED and so on, ``length``: of the way to the switch."""
        raise NotImplementedError

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
            stuck = [joint for joint in pressed if left[joint] > self.rows[joint][MOST_PRESSED]]
            if stuck:
                raise self.failure(PRESSED, stuck, left[stuck[0]])

    def _approach(self, lengths: "Lengths", is_slow: bool) -> "Lengths":
        """Move joints towards their switches until all have tripped; returns how far each has moved."""
        left = dict(lengths)
        moved: "Lengths" = dict.fromkeys(left, 0)
        while left:
            starts, ends = {}, {}
            for joint, length in left.items():
                row = self.rows[joint]
                ends[joint] = row[EDGE]
                starts[joint] = row[EDGE] - row[SIDE] * min(length, row[SPAN])
            tripped = self.move(starts, ends, is_slow)
            missed = []
            is_held = True
            for joint, start in starts.items():
                length = abs(self.stands(joint) - start)
                moved[joint] += length
                left[joint] -= length
                if left[joint] <= self.rows[joint][TOLERANCE]:
                    missed.append(joint)
                if length > self.rows[joint][TOLERANCE]:
                    is_held = False
            if tripped in left:
                del left[tripped]
            elif missed:
                raise self.failure(MISSED, missed, lengths[missed[0]])
            elif is_held:
                raise self.failure(HELD, list(left), 0)
        return moved

    def _leave(self, lengths: "Lengths") -> None:
        starts, ends = {}, {}
        for joint, length in lengths.items():
            row = self.rows[joint]
            starts[joint] = row[EDGE]
            ends[joint] = row[EDGE] - row[SIDE] * length
        self.move(starts, ends, False)
