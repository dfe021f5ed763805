"""One motion at a time: from its splines to the pins, and back to samples.

``load`` checks a motion and fills the rings. ``start`` starts the counters. ``service`` computes steps for
the interrupt that fills the rings; call it every few milliseconds until ``moving`` is False. Then ``fault``
has the reason of the end. After any stop ``commanded`` is exact for every joint whose bit in ``known`` is
set:

=====================  =============================================================
end, brake, freeze     known: each pulse that has begun is finished, and all are counted
limit switch           the same
underrun               the same: the ring stops, no wrong step is made
E-stop                 known, but unknown if the arm record releases the drivers
following error        unknown for the joint that was lost
wrong steps            unknown for the joint that made others than its record has
DIR reversed late      unknown for all joints
exception in service   unknown for all joints
=====================  =============================================================
"""

import gc
import time

from armtempo_shared import codes
from armtempo_shared.limits import LONGEST_RUN_TICKS
from armtempo_shared.messages import NO_JOINT
from micropython import const

from armtempo_board import features
from armtempo_board.errors import Refused
from armtempo_board.hardware import isr
from armtempo_board.motion import endpoints, motion_check
from armtempo_board.stepgen.override import Override

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from typing import Any

    from armtempo_shared.motion import MotionHead

    from armtempo_board.motion.engine_parts import EngineParts

_LEAD_TICKS = const(1680000)
"""Time from the start of the counters to time 0: 20 ms, in which drivers switch on,"""
_SHORT_LEAD_TICKS = const(168000)
"""and 2 ms if they are on, in which DIR settles."""

_PREFILLS = const(32)
_ROUNDS = const(8)  # rounds of filling the queues before other work
_PERMILLE = const(1000)
_KITICKS_PER_32_MS = const(2625)
_MOST_KITICKS = const(5_000_000)  # a minute
_ALL_JOINTS = const(0xFF)
# work besides the filling of queues: one of these in each call of ``service``
_POLL_SWITCHES = const(0)
_CHECK_FOLLOWING = const(1)
_CHECK_INTERRUPT = const(2)


class Engine:
    """Drives an arm with the given ``parts``. At first nothing moves, and drivers are off."""

    def __init__(self, parts: "EngineParts") -> None:
        self.feeder = parts.feeder
        self.block = parts.block
        self.drives = parts.drives
        self.clock = parts.clock
        self.rates = parts.rates
        self.inputs = parts.inputs
        self.limits = parts.limits
        self._sampler = parts.sampler
        self._encoders = parts.encoders
        self._readings = parts.readings
        self._following = parts.following
        self._pulse_us = parts.pulse_us
        self._is_short = parts.is_short
        self.moving = False
        self.fault = 0
        self.fault_joint = NO_JOINT
        self.known = 0
        self._watched_joint = self._background_task = 0
        self._homing = 0  # one bit per joint whose switches end a homing motion
        self._in_service = False  # service() or refill() is running, or did not reach its end
        if features.BACKLASH:
            self.withdrawn = 0  # joints whose position only homing has assumed: their steps count on
        self.skip_check = False  # the next motion was already checked, and nothing has changed since

    # between motions

    def home(self, mask: int, steps: "list[int]") -> None:
        """Set the positions of the joints in ``mask`` to ``steps`` (an entry for every joint)."""
        counted = self.known
        if features.BACKLASH:
            counted |= self.withdrawn
            self.withdrawn &= ~mask
        for number, joint in enumerate(self.drives):
            if mask >> number & 1:
                joint.declare(steps[number], counted >> number & 1)
                self._encoders[number].declare(self._following[number].expected(steps[number]))
        self.known |= mask

    def drivers(self, on: int) -> None:
        """Switch the drivers on or off; off, the arm can be moved by hand, and only the encoders follow it."""
        self.inputs.enable(on != 0)
        if not on:
            self.known = 0
            if features.BACKLASH:
                self.withdrawn = 0

    def clear(self) -> bool:
        """Clear the fault, unless its cause persists; returns whether it is cleared."""
        if self.moving or self.inputs.estop_active():
            return False
        self.block[isr.FAULT] = 0
        self.fault = 0
        self.fault_joint = NO_JOINT
        return True

    def _watch_idle(self) -> None:
        """While nothing moves: read the encoders and the E-stop."""
        for encoder in self._encoders:
            encoder.update()
        if self.inputs.estop_active():
            self.inputs.trip_estop()
        self._note_trip()
        if self.block[isr.FAULT] and not self.fault:
            self._take_fault()

    def _note_trip(self) -> None:
        """Note a switch that may have tripped, and that an E-stop released the drivers."""
        if self.inputs.note_trip() and self.inputs.releases:
            self.known = 0
            if features.BACKLASH:
                self.withdrawn = 0

    def _take_fault(self) -> None:
        self.fault = self.block[isr.FAULT]
        self.fault_joint = self.block[isr.FAULT_JOINT]

    # before a motion

    def load(
        self,
        motion: "MotionHead",
        rate: int = _PERMILLE,
        ready: "Any" = None,
        homing: int = 0,
        seeks: bool = False,
    ) -> None:
        """Check a motion and fill the rings; raises Refused.

        ``rate``: of the motion's own time, in thousandths. ``ready``: the ``NextMotion`` that has loaded it.
        ``homing``: one bit per joint whose switches end a homing motion, without a fault; those of others
        are not watched, but if it ``seeks``. ``fault_joint`` then has the joint.
        """
        if self.moving:
            raise Refused(codes.BUSY)
        self.inputs.thaw()  # before the check: a switch that trips from here on is detected now or freezes the motion
        self._watch_idle()
        if self.fault:
            raise Refused(codes.FAULT_PENDING, self.fault_joint, self.fault)
        moving = _ALL_JOINTS if ready or self.skip_check else self.check_splines(motion)
        override = ready.override if ready else self._override(rate, motion)
        self.rates.begin(override, motion)
        self.clock.set(-self._lead_ticks())
        self.inputs.enable(True)
        self._sampler.plan(self.rates.duration_ticks)
        self._readings.begin(override)
        for number, joint in enumerate(self.drives):
            if ready:
                ready.hand_over(number, joint)
            else:
                joint.load(motion, number, moving >> number & 1)
                if rate != _PERMILLE:
                    joint.follow(override.law, False)
            now_kiticks = self.clock.kiticks()
            for _ in range(_PREFILLS):
                joint.refill(now_kiticks)
        self._homing = homing
        self.fault_joint = NO_JOINT
        self.inputs.watch(homing or _ALL_JOINTS)
        if homing:
            self.inputs.watch_others(homing if seeks else 0)

    def _lead_ticks(self) -> int:
        if not self.inputs.enabled():
            return _LEAD_TICKS
        return max(_SHORT_LEAD_TICKS, max([joint.gap_ticks for joint in self.drives]))

    def _override(self, rate: int, motion: "MotionHead") -> "Any":
        """Check where the motion starts and how long it takes; returns its time law."""
        self._check_start(motion)
        if self._is_short:
            gc.collect()
        override = Override()
        override.begin(rate, motion, endpoints.duration_ticks(motion))
        if override.end_ticks() > LONGEST_RUN_TICKS:
            raise Refused(codes.TOO_LONG)
        return override

    def check_splines(self, motion: "MotionHead") -> int:
        """Check the splines of a motion; raises Refused. Returns one bit per joint that does not stand."""
        joint = self.drives[0]  # any one, as the gap is the same for all; it walks through the motion
        return motion_check.check(motion, self.limits, joint.gap_ticks, joint.generator.subintervals)

    def _check_start(self, motion: "MotionHead") -> None:
        """Raise Refused if the motion does not start where the joints are."""
        for number, joint in enumerate(self.drives):
            if not self.known >> number & 1:
                raise Refused(codes.UNHOMED, number)
            off = endpoints.start_offset(motion, number, joint.position(joint.ring.matches()))
            if off:
                raise Refused(codes.WRONG_START, number, off)

    def start(self) -> None:
        """Start the counters."""
        self.moving = True
        if not self.clock.start():
            self._fail(codes.START_FAILED, NO_JOINT)

    # while it moves

    def service(self) -> None:
        """Fill the queues, convert samples, check for faults. After an exception in it the position is unknown."""
        self._in_service = True
        self._service()
        self._in_service = False

    def refill(self) -> None:
        """Only fill the queues; called during other work, as full queues last a few milliseconds."""
        if self.moving and not self.block[isr.FROZEN]:
            self._in_service = True
            self._refill_queues()
            self._in_service = False

    def _service(self) -> None:
        if not self.moving:
            self._watch_idle()
            return
        if self.block[isr.FROZEN]:
            self._stopped()
            return
        if not self._refill_queues():
            return
        if self.rates.waits:
            self._change_rate()
        self._background_task = self._background_task + 1 if self._background_task < _CHECK_INTERRUPT else 0
        if self._background_task == _POLL_SWITCHES:
            self.inputs.poll()
            if self._homing:
                self.inputs.poll_home(self._homing)
        elif self._background_task == _CHECK_FOLLOWING:
            self._check_following()
        elif self._sampler.overdue(self._watched_joint):
            self.block[isr.REVERSAL_LATE] = 1
        if self.block[isr.REVERSAL_LATE]:
            self._fail(codes.INTERNAL, NO_JOINT)
        elif self._has_ended() and self.moving:  # not if an encoder has just ended it
            self._check_end()
            self._finish(self.rates.duration_ticks)

    def _refill_queues(self, at_most_kiticks: "int | None" = None) -> bool:
        """Fill all queues; returns False if that ended the motion.

        ``at_most_kiticks``: once, and as if it were not later than that.
        """
        now_kiticks = self.clock.kiticks()
        if at_most_kiticks is not None:
            now_kiticks = min(now_kiticks, at_most_kiticks)
        self._readings.convert()
        rates = self.rates
        if rates.end_moves and self._sampler.quiet():
            self._sampler.end_at(rates.duration_ticks)
            rates.end_moves = False
        joints = self.drives
        for _ in range(_ROUNDS):
            can_queue_more = False
            for joint in joints:
                fault = joint.refill(now_kiticks)
                if fault:
                    self._fail(fault, joints.index(joint))
                    return False
                if joint.can_queue_more:
                    can_queue_more = True
            if not can_queue_more or at_most_kiticks is not None:
                break
            now_kiticks = self.clock.kiticks()
        return True

    def _has_ended(self) -> bool:
        if not self._sampler.done():
            return False
        for joint in self.drives:
            if not joint.ended:
                if self.rates.duration_ticks == LONGEST_RUN_TICKS:  # the pause has lasted too long
                    self.freeze()
                return False
        return True

    def _check_end(self, at_rest: bool = False) -> None:
        """At the end of a motion: set a fault if a joint has not made the steps of its record.

        ``at_rest``: it ends in a pause.
        """
        for number, joint in enumerate(self.drives):
            if joint.is_astray(at_rest):
                self.known &= ~(1 << number)
                isr.set_fault(self.block, codes.WRONG_STEPS, number)
                self._take_fault()

    def _check_following(self) -> None:
        """Compare one joint with its encoder; the next call checks the next joint."""
        number = self._watched_joint
        self._watched_joint = (number + 1) % len(self.drives)
        joint = self.drives[number]
        if not self._following[number].limit:
            return
        matches = joint.ring.matches()
        if self._sampler.waits():  # a sample may be older than these matches, and must be converted first
            return
        encoder = self._encoders[number]
        encoder.update()
        if self._following[number].is_exceeded(joint.position(matches), encoder.counts - joint.extra_counts):
            self.known &= ~(1 << number)
            self._fail(codes.FOLLOWING, number)

    def freeze(self) -> None:
        """Stop all outputs now; not a fault."""
        self.inputs.freeze()
        if self._in_service:
            self._in_service = False
            self.known = 0
        if self.moving:
            self._stopped()

    def brake(self) -> None:
        """Brake to rest along the path; freeze if the motion's record has no brake times, or in a pause.

        Acceleration and jerk stay within 1.25 times the arm's limits. Braking begins after what is queued, 33 ms from
        now with one joint, 75 ms with six, and after a change of rate in progress. If the motion would end earlier
        than the brake, it simply ends.
        """
        rates = self.rates
        if not self.moving or rates.braked:
            return
        if not rates.brake():
            if rates.stands():
                self._check_end(True)
            self.freeze()
        elif rates.stands():
            for joint in self.drives:
                joint.finish()
        else:
            self._change_rate()

    def rest_ms(self) -> int:
        """Milliseconds until rest after ``brake``, called earlier or now; 0: at once."""
        return (
            min(self.rates.rest_kiticks(self._ahead_kiticks()), _MOST_KITICKS) * 32 // _KITICKS_PER_32_MS + 1
        )

    def _ahead_kiticks(self) -> int:
        """Time until the last step in the rings; allocates nothing."""
        ahead_kiticks = 0
        for joint in self.drives:
            ahead_kiticks = max(joint.ahead_kiticks(), ahead_kiticks)
        return ahead_kiticks

    if features.SPEED:

        def change_rate(self, rate: int) -> None:
            """Change the rate of the motion's own time, in thousandths; 0: pause, RESUME: end of the pause.

            The record has the length of each change; acceleration and jerk are as in ``brake``. It begins as
            braking does. Requests during a change wait for its end; only the last one counts.
            """
            if not self.moving:
                raise Refused(codes.NOT_MOVING)
            self.rates.want(rate)
            self._change_rate()

    def _change_rate(self) -> None:
        """Begin the ramp to the requested rate, unless the last ramp has not ended."""
        rates = self.rates
        if not rates.is_due():
            return
        now_kiticks = self.clock.kiticks()
        self._readings.convert()  # by the time law at their times
        law = rates.ramp(now_kiticks, self._ahead_kiticks())
        if law is None:
            return
        for joint in self.drives:
            joint.follow(law, rates.braked)
            # None beyond the beginning of the ramp, as some joints follow the law before
            if not self._refill_queues(now_kiticks + rates.margin_kiticks):
                break

    def _fail(self, code: int, joint: int) -> None:
        self.inputs.freeze()
        self._note_trip()
        isr.set_fault(self.block, code, joint)
        self._stopped()

    # after it

    def _stopped(self) -> None:
        """After a freeze: wait for the end of started pulses, then count."""
        time.sleep_us(self._pulse_us)
        self.clock.stop()
        end_ticks = max(self.clock.ticks(), 0)
        self.clock.kiticks()
        self._readings.convert()
        for joint in self.drives:
            joint.settle()
        self._sampler.take_now()
        self._readings.convert()
        if self.block[isr.REVERSAL_LATE]:
            self.known = 0
        self.inputs.watch(0)  # a bouncing switch is noted once
        self._note_trip()
        if self.block[isr.FAULT] == codes.LIMIT_SWITCH and self._homing:
            self.block[isr.FAULT] = 0
            self.fault_joint = self.block[isr.FAULT_JOINT]
        if self.block[isr.FAULT]:
            self._take_fault()
        self._finish(end_ticks)

    def _finish(self, end_ticks: int) -> None:
        self.clock.stop()
        self._readings.end(end_ticks)
        self.rates.override = None
        for joint in self.drives:
            joint.empty()
            joint.generator.close()
        self.inputs.watch(0)
        self.moving = False

    def close(self) -> None:
        """Release the hardware, the engine's memory and the motion's file; the engine is not used after it."""
        self.freeze()
        for joint in self.drives:
            joint.close()
        self.feeder.disconnect()
        self.inputs.close()

    # state

    def commanded(self, joint: int) -> int:
        """Commanded position of a joint in steps."""
        return self._readings.commanded(joint)

    def next_sample(self, buffer: "array[int]") -> bool:
        """Copy the oldest sample to ``buffer`` (words as in ``buffers.py``); returns False if there is none."""
        return self._readings.next(buffer)

    def snapshot(self, buffer: "array[int]") -> None:
        """Write the present state as a sample to ``buffer``; after a motion, with the time of its end."""
        self._readings.snapshot(buffer)
