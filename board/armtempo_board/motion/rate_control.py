"""The rate of a motion's own time: changes and braking, when they begin, and the end that moves with them."""

from armtempo_shared import codes
from armtempo_shared.messages import RESUME
from micropython import const

from armtempo_board import features
from armtempo_board.errors import Refused
from armtempo_board.motion.clock import MotionClock
from armtempo_board.motion.joint_drive import LOOKAHEAD_KITICKS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from typing import Any

    from armtempo_shared.motion import MotionHead

_LAW_MARGIN_KITICKS = const(2048)  # 25 ms, within which all joints get another law of time
_PERMILLE = const(1000)


class RateControl:
    """``wanted``: the rate, in thousandths. ``override``: the law of time (stepgen/override.py) of a motion.

    ``duration_ticks``: when the motion ends unless the rate changes. ``waits``: a change is wanted that has not begun.
    ``end_moves``: the last sample is to be taken at another time than planned. ``braked``: it is to come to rest.
    """

    def __init__(self, clock: MotionClock) -> None:
        self._clock = clock
        self.override: "Any" = None
        self.wanted = self._before_pause = _PERMILLE
        self.duration_ticks = self._end_kiticks = 0
        self._can_brake = False
        self.braked = self.end_moves = self.waits = False

    def begin(self, override: "Any", motion: "MotionHead") -> None:
        """Of a motion that is loaded; ``override`` is at its time 0."""
        self.override = override
        self.wanted = self._before_pause = override.rate
        self.duration_ticks = override.end_ticks()
        self._end_kiticks = self.duration_ticks >> 10
        self._can_brake = motion.can_brake
        self.braked = self.end_moves = self.waits = False

    def brake(self) -> bool:
        """Want rest; False where there is no way to it, or it is paused and needs none."""
        if not self._can_brake or (self.stands() and self._is_steady()):
            return False
        self.braked = True
        self.wanted = 0
        if self.stands():  # it will soon
            self.waits = False
            self._end_at(self.override.steady_ticks())
        return True

    def stands(self) -> bool:
        """Whether its own time stands still after the ramp that began last."""
        return bool(self.override.rate == 0)

    if features.SPEED:

        def want(self, rate: int) -> None:
            """Want another rate, in thousandths; 0: pause, RESUME: as before it."""
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
        """Whether the change that is wanted can begin; else it waits until the one before has ended."""
        self.waits = self.override.rate != self.wanted
        return self.waits and self._is_steady()

    def _is_steady(self) -> bool:
        return bool(self._clock.kiticks() > self.override.steady_kiticks)

    def ramp(self, ahead_kiticks: int) -> "array[int] | None":
        """Begin the change, after what is in the rings: the law that all joints are to follow; None: it ends before.

        ``ahead_kiticks``: how far ahead steps are in them. Where it would come to rest later than it ends by itself,
        it does that.
        """
        ahead_kiticks = max(LOOKAHEAD_KITICKS + _LAW_MARGIN_KITICKS, ahead_kiticks)
        start_ticks = (self._clock.kiticks() + ahead_kiticks) << 10
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
        """How long from now it takes to come to rest after a stop: one that came before, or one now; 0 by freezing.

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
                start = now + max(LOOKAHEAD_KITICKS + _LAW_MARGIN_KITICKS, ahead_kiticks)
                end = min(override.rest_kiticks(max(start, override.steady_kiticks)), end)
        return max(end - now, 0)

    def _end_at(self, ticks: int) -> None:
        self.duration_ticks = ticks
        self._end_kiticks = ticks >> 10
        self.end_moves = True
