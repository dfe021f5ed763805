"""The law of time as one joint follows it (time_law.py); imported before a motion, and forgotten after it."""

from armtempo_board.stepgen import interval_steps, time_law
from armtempo_board.stepgen.time_law import (
    AFTER,
    BEFORE,
    END_HIGH,
    GIVEN_WORDS,
    MOTION_HIGH,
    PERMILLE,
    REAL_END_HIGH,
    REAL_HIGH,
    REAL_START_HIGH,
    START_HIGH,
)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array


class JointLaw:
    """``words``: memory of ``time_law.LAW_WORDS``."""

    def __init__(self, words: "memoryview[int]") -> None:
        self._words = words

    def take(self, law: "array[int]", high: int) -> int:
        """Follow a law; the rest as ``count_from``."""
        for word in range(GIVEN_WORDS):
            self._words[word] = law[word]
        return self.count_from(high)

    def count_from(self, high: int) -> int:
        """Let the motion's times count from ``high``; returns what the real times then count from.

        In 4096 ticks, + bezier.BIAS. That is near the real time of ``high``, and not later.
        """
        law = self._words
        if high < law[START_HIGH]:
            real = law[REAL_START_HIGH] - _stretched(law[START_HIGH] + 1 - high, law[BEFORE]) - 1
        elif high < law[END_HIGH] or law[AFTER] == 0:
            real = law[REAL_START_HIGH] + high - law[START_HIGH] - 1
        else:
            real = law[REAL_END_HIGH] + _stretched(high - law[END_HIGH], law[AFTER]) - 1
        law[MOTION_HIGH] = high
        law[REAL_HIGH] = real
        return int(real)

    def motion_high(self) -> int:
        """What the motion's times count from."""
        return int(self._words[MOTION_HIGH])

    def start_high(self) -> int:
        """Where in real time the ramp begins."""
        return int(self._words[REAL_START_HIGH])

    def is_past(self, high: int) -> bool:
        """Whether a time of the motion lies behind a ramp's end, at which it stands still."""
        return bool(self._words[AFTER] == 0 and high > self._words[END_HIGH])

    def to_real_time(self, solver: "memoryview[int]", place: int, scale: int) -> bool:
        """Move the time of a node (see ``time_law.to_real_time``); False: it never comes."""
        return bool(time_law.to_real_time(self._words, solver, place, scale))

    def scale_slope(self, solver: "memoryview[int]", place: int) -> None:
        """Move the slope of a node (see ``time_law.scale_slope``)."""
        time_law.scale_slope(solver, place)

    def queue_steps(self, solver: "memoryview[int]", queue: "memoryview[int]", nodes: int) -> None:
        """Queue the steps of a subinterval (see ``interval_steps.queue_steps``)."""
        interval_steps.queue_steps(solver, queue, nodes, self._words)


def _stretched(time: int, rate: int) -> int:
    """How long a time of the motion takes at a constant rate, in thousandths; 0 at rest. Small integers."""
    if rate == 0:
        return 0
    whole = time // rate
    return PERMILLE * whole + PERMILLE * (time - whole * rate) // rate
