"""The rate of a motion's own time: changes, braking, their start times, and the resulting end of the motion."""

from armtempo_shared import codes
from armtempo_shared.messages import RESUME
from micropython import const

from armtempo_board import features
from armtempo_board.errors import Refused
from armtempo_board.motion.clock import MotionClock

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from typing import Any

    from armtempo_shared.motion import MotionHead

# as in joint_drive.py; a joint gets another time law, and computes its first steps by it, within _JOINT_KITICKS
_LOOP_KITICKS = const(2048)
_JOINT_KITICKS = const(341)

_LATE_KITICKS = const(82)  # 1 ms
_PERMILLE = const(1000)


class RateControl:
    """``wanted``: the requested rate, in thousandths. ``override``: the time law (stepgen/override.py) of a motion.

    ``duration_ticks``: end of the motion unless the rate changes. ``waits``: a requested change has not
    begun. ``end_moves``: the time of the last sample has changed. ``braked``: the motion is to come to rest.
    A change begins ``margin_kiticks`` after what is computed ahead, or after what is in the rings.
    """

    def __init__(self, clock: MotionClock, joints: int) -> None:
        self._clock = clock
        self.margin_kiticks = _JOINT_KITICKS * joints
        self.override: "Any" = None
        self.wanted = self._before_pause = _PERMILLE
        self.duration_ticks = self._end_kiticks = 0
        self._can_brake = False
        self.braked = self.end_moves = self.waits = False

    def begin(self, override: "Any", motion: "MotionHead") -> None:
        """Begin with a loaded motion; ``override`` is at its time 0."""
        self.override = override
        self.wanted = self._before_pause = override.rate
        self.duration_ticks = override.end_ticks()
        self._end_kiticks = self.duration_ticks >> 10
        self._can_brake = motion.can_brake
        self.braked = self.end_moves = self.waits = False

    def brake(self) -> bool:
        """Request rest; returns False if the motion has no brake times, or it is paused."""
        if not self._can_brake or (self.stands() and self._is_steady()):
            return False
        self.braked = True
        self.wanted = 0
        if self.stands():  # it will soon
            self.waits = False
            self._end_at(self.override.steady_ticks())
        return True

    def last_until(self, kiticks: int) -> None:
        """The motion lasts until then at least, as its last steps come later than planned."""
        if kiticks > self._end_kiticks:
            self._end_at((kiticks + _LATE_KITICKS) << 10)
            self.end_moves = True

    def stands(self) -> bool:
        """Whether the motion's own time stops at the end of the last ramp."""
        return bool(self.override.rate == 0)

    if features.SPEED:

        def want(self, rate: int) -> None:
            """Request a rate, in thousandths; 0: pause, RESUME: end of the pause."""
            if self.braked:
                raise Refused(codes.BUSY)
            if not self._can_brake:
                raise Refused(codes.FIXED_SPEED)
            if rate == RESUME:
                rate = self._before_pause
            if self.override.is_too_long(self._clock.ticks(), rate):
                raise Refused(codes.TOO_LONG)
            self.wanted = rate
            self._before_pause = rate or self._before_pause

    def is_due(self) -> bool:
        """Whether the requested change can begin: the change before has ended."""
        self.waits = self.override.rate != self.wanted
        return self.waits and self._is_steady()

    def _is_steady(self) -> bool:
        return bool(self._clock.kiticks() > self.override.steady_kiticks)

    def ramp(self, now_kiticks: int, ahead_kiticks: int) -> "array[int] | None":
        """Begin the change; returns the time law for all joints, None if the motion ends before.

        ``ahead_kiticks``: time from now until the last step in the rings. If rest would be later than the end of the
        motion, there is no change.
        """
        start_ticks = (now_kiticks + max(_LOOP_KITICKS + 2 * self.margin_kiticks, ahead_kiticks)) << 10
        self.waits = False
        if start_ticks >= self.duration_ticks or (
            self.braked and self.override.ramp_end_ticks(start_ticks, 0) >= self.duration_ticks
        ):
            return None
        self.override.ramp(start_ticks, self.wanted)
        self._end_at(self.override.steady_ticks() if self.braked else self.override.end_ticks())
        law: "array[int]" = self.override.law
        return law

    def rest_kiticks(self, ahead_kiticks: int) -> int:
        """Time from now until rest after a stop, given earlier or now; 0 by freezing.

        Allocates nothing.
        """
        now = self._clock.kiticks()
        end = self._end_kiticks
        if not self.braked or self.waits:
            if not self._can_brake:
                return 0
            override = self.override
            if self.stands():
                end = override.steady_kiticks
            else:
                # as in ``ramp``, which is called once the last ramp has ended
                start = max(now, override.steady_kiticks) + max(
                    _LOOP_KITICKS + 2 * self.margin_kiticks, ahead_kiticks
                )
                end = min(override.rest_kiticks(start), end)
        return max(end - now, 0)

    def _end_at(self, ticks: int) -> None:
        self.duration_ticks = ticks
        self._end_kiticks = ticks >> 10
        self.end_moves = True
