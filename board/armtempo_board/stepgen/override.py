"""Feed override: the rate at which the motion's own time runs, and ramps from one rate to another; for each joint too.

The same law serves a slower run, a change of speed, a pause and braking (stepgen/time_law.py). Rates are in
thousandths. Numbers of ``Override`` may be large integers: it is called when a motion is loaded or a rate is asked
for.
"""

from array import array

from armtempo_shared.limits import LONGEST_RUN_TICKS
from armtempo_shared.motion import EVEN_RAMP, RAMP_WAYS
from micropython import const

from armtempo_board import features
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
    from typing import Any

# as in motion.py of armtempo_shared: an entry for a ramp
_RAMP_LENGTH = const(2047)
_RAMP_SHAPE_BIT = const(11)


class Override:
    """``law`` is what the joints follow; ``rate`` that after its ramp, steady from ``steady_kiticks`` on."""

    def __init__(self) -> None:
        self.law = array("i", bytes(4 * time_law.LAW_WORDS))
        self.begin(PERMILLE, None, 0)

    def begin(self, rate: int, motion: "Any", duration_ticks: int) -> None:
        """Stand at time 0 of a motion, a ``MotionHead``, which says how long its ramps are."""
        self._motion = motion
        self._duration_ticks = duration_ticks
        self._duration_kiticks = (duration_ticks >> 10) + 1
        self._motion_ticks = self._real_ticks = 0  # at the end of the last ramp
        self._motion_kiticks = self._real_kiticks = 0
        self.rate = rate
        time_law.set_length(self.law, 0)
        time_law.set_ramp(self.law, EVEN_RAMP, rate, rate)
        self._set(time_law.START_HIGH)
        self._set(time_law.END_HIGH)
        self.steady_kiticks = -1 << 20

    def ramp_end_ticks(self, from_ticks: int, rate: int) -> int:
        """Real time at which a ramp to another rate would end that begins at a real time, after the last ramp."""
        thousands = self._thousands(from_ticks)
        length, _ = self._ramp(self._motion_ticks + self.rate * thousands, rate)
        return self._real_ticks + PERMILLE * thousands + length

    def rest_kiticks(self, from_kiticks: int) -> int:
        """Real time, in Ki ticks, at which a ramp to rest would end that begins at a real time; allocates nothing."""
        since = max(from_kiticks - self._real_kiticks, 0)
        at = self._motion_kiticks + since // PERMILLE * self.rate + since % PERMILLE * self.rate // PERMILLE
        motion = self._motion
        units: int = motion.ramp(at, self._duration_kiticks, True) & _RAMP_LENGTH
        # RAMP_GRID_TICKS are 1000 << 6
        grid: int = ((units << motion.ramp_bits - 6) + PERMILLE - 1) // PERMILLE
        return self._real_kiticks + since + (125 * grid >> 1)

    def _thousands(self, from_ticks: int) -> int:
        """Thousands of ticks from the last ramp's end, rounded up."""
        return max(-(-(from_ticks - self._real_ticks) // PERMILLE), 0)

    def _ramp(self, at_ticks: int, rate: int) -> "tuple[int, int]":
        """Length, rounded up to the grid, and shape of a ramp that begins at a time of the motion."""
        grid = time_law.RAMP_GRID_TICKS
        motion = self._motion
        entry: int = motion.ramp(at_ticks >> 10, self._duration_kiticks, rate == 0)
        return -(-((entry & _RAMP_LENGTH) << motion.ramp_bits) // grid) * grid, entry >> _RAMP_SHAPE_BIT

    def ramp(self, from_ticks: int, rate: int) -> None:
        """Go to another rate, from a real time on that is after the last ramp."""
        thousands = self._thousands(from_ticks)
        self._real_ticks += PERMILLE * thousands
        self._motion_ticks += self.rate * thousands
        length, shape = self._ramp(self._motion_ticks, rate)
        time_law.set_length(self.law, length)
        time_law.set_ramp(self.law, shape, self.rate, rate)
        self._set(time_law.START_HIGH)
        self._real_ticks += length
        way = 64 * min(self.rate, rate) + abs(rate - self.rate) * RAMP_WAYS[shape]
        self._motion_ticks += way * (length // time_law.RAMP_GRID_TICKS)
        self._set(time_law.END_HIGH)
        self._motion_kiticks = self._motion_ticks >> 10
        self._real_kiticks = self._real_ticks >> 10
        self.rate = rate
        self.steady_kiticks = (self._real_ticks >> 10) + 1

    def _set(self, end: int) -> None:
        """Put one end of the ramp, where motion and real time are now, into the law."""
        time_law.set_times(self.law, end, self._motion_ticks)
        time_law.set_times(self.law, end + time_law.REAL_START_HIGH - time_law.START_HIGH, self._real_ticks)

    def put_path(self, sample: "array[int]", at: int) -> None:
        """Put the motion's own time into a sample that begins at word ``at`` (buffers.py)."""
        time_law.to_motion_time(self.law, sample, at)

    def end_ticks(self) -> int:
        """Real time at which the motion ends: of the ramp's end, if it ends within; LONGEST_RUN_TICKS: never."""
        left = max(self._duration_ticks - self._motion_ticks, 0)
        if left and not self.rate:
            return LONGEST_RUN_TICKS
        return self._real_ticks + (-(-left * PERMILLE // self.rate) if left else 0)

    def steady_ticks(self) -> int:
        """Real time at which the last ramp ends."""
        return self._real_ticks

    if features.SPEED:

        def is_too_long(self, from_ticks: int, rate: int) -> bool:
            """Whether at a rate, taken up at about a real time, the run could last longer than LONGEST_RUN_TICKS."""
            left = max(self._duration_ticks - self._motion_ticks, 0)
            latest = max(from_ticks, self._real_ticks) + 2 * time_law.LONGEST_RAMP_TICKS
            return rate > 0 and latest + left * PERMILLE // rate > LONGEST_RUN_TICKS


class JointLaw:
    """The law as one joint follows it. ``words``: memory of ``time_law.LAW_WORDS``."""

    def __init__(self, words: "memoryview[int]") -> None:
        self._words = words
        # compiled functions that only a motion needs: a method around each would cost more than its call
        self.to_real_time = time_law.to_real_time
        self.scale_slope = time_law.scale_slope
        self.begin = interval_steps.begin
        self.queue_steps = interval_steps.queue_steps

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
        elif high < law[END_HIGH] or not law[AFTER]:
            real = law[REAL_START_HIGH] + high - law[START_HIGH] - 1
        else:
            real = law[REAL_END_HIGH] + _stretched(high - law[END_HIGH], law[AFTER]) - 1
        law[MOTION_HIGH] = high
        law[REAL_HIGH] = real
        return real

    def is_past(self, high: int) -> bool:
        """Whether a time of the motion is after a ramp's end, at which it stands still."""
        return not self._words[AFTER] and high > self._words[END_HIGH]


def _stretched(time: int, rate: int) -> int:
    """How long a time of the motion takes at a constant rate, in thousandths; 0 at rest. Small integers."""
    if not rate:
        return 0
    whole = time // rate
    return PERMILLE * whole + PERMILLE * (time - whole * rate) // rate
