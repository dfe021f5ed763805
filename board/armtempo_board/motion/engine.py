"""One motion at a time: from its splines to the pins, and back to samples.

``load`` checks a motion and fills the rings. ``start`` lets the counters run. ``service`` keeps steps ready for the
interrupt that fills the rings; call it every few milliseconds until ``moving`` is False. Then ``fault`` says why the
motion ended. After any stop ``commanded`` is exact for every joint whose bit in ``known`` is set:

=====================  =============================================================
end, brake, freeze     known: each pulse that has begun is finished, and all are counted
limit switch           the same
underrun               the same: the ring stops, no wrong step is made
E-stop                 known, but unknown where the arm record releases the drivers
following error        unknown for the joint that was lost
wrong steps            unknown for the joint that made others than its record has
DIR turned too late    unknown for all joints
exception in service   unknown for all joints
=====================  =============================================================
"""

import gc
import time

from armtempo_shared import codes
from armtempo_shared.limits import LONGEST_RUN_TICKS
from armtempo_shared.messages import NO_JOINT
from micropython import const

from armtempo_board import features, heap
from armtempo_board.errors import Refused
from armtempo_board.hardware import isr

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from typing import Any

    from armtempo_shared.motion import MotionHead

    from armtempo_board.motion.engine_parts import EngineParts

LEAD_TICKS = const(1680000)
"""Time from the start of the counters to time 0: 20 ms, in which drivers switch on and DIR settles."""

_PREFILLS = const(32)
_ROUNDS = const(8)  # of filling the queues, before other work gets its turn
_PERMILLE = const(1000)
_KITICKS_PER_32_MS = const(2625)
_MOST_KITICKS = const(5_000_000)  # a minute
_ALL_JOINTS = const(0xFF)
# work besides the filling of queues: one of these in each call of ``service``
_POLL_SWITCHES = const(0)
_CHECK_FOLLOWING = const(1)
_CHECK_INTERRUPT = const(2)


class Engine:
    """Drives the arm whose ``parts`` it gets. Nothing moves, drivers are off."""

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
        self.moving = False
        self.fault = 0
        self.fault_joint = NO_JOINT
        self.known = 0
        self._watched_joint = self._background_task = 0
        self._homing = 0  # one bit per joint that moves in a homing motion
        self._in_service = False  # service() or refill() is at work, or has not come to its end
        self.skip_check = False  # the next motion was checked before, and nothing has changed since

    # between motions

    def home(self, mask: int, steps: "list[int]") -> None:
        """The joints of ``mask`` stand at ``steps`` (one number for every joint)."""
        for number, joint in enumerate(self.drives):
            if mask >> number & 1:
                joint.declare(steps[number])
                self._encoders[number].declare(self._following[number].expected(steps[number]))
        self.known |= mask

    def drivers(self, on: int) -> None:
        """The drivers on, or off: then the arm can be moved by hand, and only its encoders know where to."""
        self.inputs.enable(on != 0)
        if not on:
            self.known = 0

    def clear(self) -> bool:
        """Clear the fault, unless its cause is still there; True where it is cleared."""
        if self.moving or self.inputs.estop_active():
            return False
        self.block[isr.FAULT] = 0
        self.fault = 0
        self.fault_joint = NO_JOINT
        return True

    def _watch_idle(self) -> None:
        """While nothing moves: follow the encoders, and look at the E-stop."""
        for encoder in self._encoders:
            encoder.update()
        if self.inputs.estop_active():
            self.inputs.trip_estop()
        self._note_trip()
        if self.block[isr.FAULT] and not self.fault:
            self._take_fault()

    def _note_trip(self) -> None:
        """A switch may have tripped: know of it, and that an E-stop released the drivers."""
        if self.inputs.note_trip() and self.inputs.releases:
            self.known = 0

    def _take_fault(self) -> None:
        self.fault = self.block[isr.FAULT]
        self.fault_joint = self.block[isr.FAULT_JOINT]

    # before a motion

    def load(self, motion: "MotionHead", rate: int = _PERMILLE, ready: "Any" = None, homing: int = 0) -> None:
        """Check a motion and fill the rings; Refused where something is wrong.

        ``rate``, in thousandths: how fast the motion's own time is to run. ``ready``: the ``NextMotion`` that has it
        loaded already. ``homing``: one bit per joint that moves in a homing motion; a switch of these ends it without a
        fault, and ``fault_joint`` says whose.
        """
        if self.moving:
            raise Refused(codes.BUSY)
        self.inputs.thaw()  # before it looks: a switch that trips from here on is found now or freezes the motion
        self._watch_idle()
        if self.fault:
            raise Refused(codes.FAULT_PENDING, self.fault_joint, self.fault)
        override = ready.override if ready else self._override(rate, motion)
        self.rates.begin(override, motion)
        self.clock.set(-(ready.lead_ticks() if ready else LEAD_TICKS))
        self.inputs.enable(True)
        self._sampler.plan(self.rates.duration_ticks)
        self._readings.begin(override)
        for number, joint in enumerate(self.drives):
            if ready:
                ready.hand_over(number, joint)
            else:
                joint.load(motion, number)
                if rate != _PERMILLE:
                    joint.follow(override.law, False)
            now_kiticks = self.clock.kiticks()
            for _ in range(_PREFILLS):
                joint.refill(now_kiticks)
        self._homing = homing
        self.fault_joint = NO_JOINT
        self.inputs.watch(homing or _ALL_JOINTS)
        if not ready:
            gc.collect()

    def _override(self, rate: int, motion: "MotionHead") -> "Any":
        """Check the motion; the law of its time, with the code that only a motion needs."""
        from armtempo_board.motion import start_check  # here, so that it can be forgotten

        limits = None if self.skip_check else self.limits
        duration_ticks = start_check.check_start(motion, self.drives, limits, self.known)
        del start_check
        heap.tidy()
        from armtempo_board.stepgen.override import Override

        override = Override()
        override.begin(rate, motion, duration_ticks)
        if override.end_ticks() > LONGEST_RUN_TICKS:
            raise Refused(codes.TOO_LONG)
        return override

    def start(self) -> None:
        """Let the counters run."""
        self.moving = True
        if not self.clock.start():
            self._fail(codes.START_FAILED, NO_JOINT)

    # while it moves

    def service(self) -> None:
        """Keep the queues filled, convert samples, look for faults. An exception in it leaves the position unknown."""
        self._in_service = True
        self._service()
        self._in_service = False

    def refill(self) -> None:
        """Keep the queues filled and nothing else: for between other work, as full ones last a few milliseconds."""
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
            self.block[isr.TURN_LATE] = 1
        if self.block[isr.TURN_LATE]:
            self._fail(codes.INTERNAL, NO_JOINT)
        elif self._has_ended() and self.moving:  # not where an encoder has just ended it
            self._check_end()
            self._finish(self.rates.duration_ticks)

    def _refill_queues(self) -> bool:
        """Keep all queues filled; False where that ended the motion."""
        now_kiticks = self.clock.kiticks()
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
            if not can_queue_more:
                break
            now_kiticks = self.clock.kiticks()
        return True

    def _has_ended(self) -> bool:
        if not self._sampler.done():
            return False
        for joint in self.drives:
            if not joint.ended:
                if self.rates.duration_ticks == LONGEST_RUN_TICKS:  # it has stood still for too long
                    self.freeze()
                return False
        return True

    def _check_end(self, at_rest: bool = False) -> None:
        """However a motion came to its end, each joint has made the steps of its record, or it is a fault.

        ``at_rest``: it ends in a pause.
        """
        for number, joint in enumerate(self.drives):
            if joint.is_astray(at_rest):
                self.known &= ~(1 << number)
                isr.set_fault(self.block, codes.WRONG_STEPS, number)
                self._take_fault()

    def _check_following(self) -> None:
        """Compare one joint with its encoder; the next joint comes with the next call."""
        number = self._watched_joint
        self._watched_joint = (number + 1) % len(self.drives)
        joint = self.drives[number]
        if not self._following[number].limit:
            return
        matches = joint.ring.matches()
        if self._sampler.waits():  # a sample may be older than these matches, and comes first
            return
        encoder = self._encoders[number]
        encoder.update()
        if self._following[number].is_exceeded(joint.position(matches), encoder.counts):
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
        """Come to rest along the path; freeze where the motion's record has no time for it, or at rest in a pause.

        Over that time acceleration and jerk stay within 1.25 times the arm's limits. Braking begins after what is
        in the rings, about 75 ms from now; where the rate is changing, after that. A motion that ends by itself before
        it would have come to rest does that.
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
        """In how many milliseconds it rests after ``brake``, which came before or comes now; 0: at once."""
        return (
            min(self.rates.rest_kiticks(self._ahead_kiticks()), _MOST_KITICKS) * 32 // _KITICKS_PER_32_MS + 1
        )

    def _ahead_kiticks(self) -> int:
        """How far ahead steps are in the rings; allocates nothing."""
        ahead_kiticks = 0
        for joint in self.drives:
            ahead_kiticks = max(joint.ahead_kiticks(), ahead_kiticks)
        return ahead_kiticks

    if features.SPEED:

        def change_rate(self, rate: int) -> None:
            """Let the motion's own time continue at another rate, in thousandths; 0: pause, RESUME: as before it.

            Each change takes as long as the record says, with acceleration and jerk as in ``brake``. It begins as
            braking does; one that comes while the rate is changing waits until that has ended, and only the last
            one counts.
            """
            if not self.moving:
                raise Refused(codes.NOT_MOVING)
            self.rates.want(rate)
            self._change_rate()

    def _change_rate(self) -> None:
        """Begin the ramp to the rate that is wanted, or wait until the last one has ended."""
        rates = self.rates
        if not rates.is_due():
            return
        self._readings.convert()  # by the law that they were taken under
        law = rates.ramp(self._ahead_kiticks())
        if law is None:
            return
        for joint in self.drives:
            joint.follow(law, rates.braked)
            if not self._refill_queues():
                break

    def _fail(self, code: int, joint: int) -> None:
        self.inputs.freeze()
        self._note_trip()
        isr.set_fault(self.block, code, joint)
        self._stopped()

    # after it

    def _stopped(self) -> None:
        """The outputs were frozen: let pulses that have begun end, then count."""
        time.sleep_us(self._pulse_us)
        self.clock.stop()
        end_ticks = max(self.clock.ticks(), 0)
        self.clock.kiticks()
        self._readings.convert()
        for joint in self.drives:
            joint.settle()
        self._sampler.take_now()
        self._readings.convert()
        if self.block[isr.TURN_LATE]:
            self.known = 0
        self.inputs.watch(0)  # a switch that bounces is noted once
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
        """Release the hardware, the workspace and the motion's file; the engine is not used after it."""
        self.freeze()
        for joint in self.drives:
            joint.close()
        self.feeder.disconnect()
        self.inputs.close()

    # what it knows

    def commanded(self, joint: int) -> int:
        """Steps issued so far, as a position."""
        return self._readings.commanded(joint)

    def next_sample(self, buffer: "array[int]") -> bool:
        """Copy the oldest sample to ``buffer``, its words as in ``buffers.py``; False: there is none."""
        return self._readings.next(buffer)

    def snapshot(self, buffer: "array[int]") -> None:
        """Write a sample of this moment to ``buffer``; after a motion with the time at which it ended."""
        self._readings.snapshot(buffer)
