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
DIR turned too late    unknown for all joints
exception in service   unknown for all joints
=====================  =============================================================
"""

import gc
import time
from array import array

import stm
from armtempo_shared import codes
from armtempo_shared.limits import LONGEST_RUN_TICKS
from armtempo_shared.messages import NO_JOINT, RESUME
from machine import mem32
from micropython import const

from armtempo_board import heap
from armtempo_board.buffers import COMMANDED, PATH_HIGH, PATH_LOW, TICKS_HIGH, TICKS_LOW
from armtempo_board.errors import Refused
from armtempo_board.hardware import isr
from armtempo_board.hardware.encoders import EncoderInput, NoEncoder
from armtempo_board.hardware.inputs import Inputs
from armtempo_board.motion.following_error import FollowingError
from armtempo_board.motion.joint_drive import LOOKAHEAD_KITICKS, JointDrive
from armtempo_board.motion.readings import Readings
from armtempo_board.motion.workspace import Workspace

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from armtempo_shared.motion import MotionHead

LEAD_TICKS = const(1680000)
"""Time from the start of the counters to time 0: 20 ms, in which drivers switch on and DIR settles."""

_PREFILLS = const(32)
_ANY_JOINT = const(0)
_ROUNDS = const(8)  # of filling the queues, before other work gets its turn
_LAW_MARGIN_KITICKS = const(2048)  # 25 ms, within which all joints get another law of time
_PERMILLE = const(1000)
_PULSE_SPARE_US = const(5)
_TICKS_PER_US = const(84)
_START_US = const(50)
_START_CHECKS = const(5)
# work beside the filling of queues: one of these in each call of ``service``
_POLL_SWITCHES = const(0)
_CHECK_FOLLOWING = const(1)
_CHECK_INTERRUPT = const(2)
_LIMITS = ("min_steps", "max_steps", "max_rate")  # what of a joint's row in the arm record is needed later


class Engine:
    """``head`` and ``joints`` as ``armrecord.unpack`` gives them. Nothing moves, drivers are off.

    ``workspace``: what the engine before worked in and this one takes over; MemoryError where it is too small.
    """

    def __init__(self, head: "dict[str, int]", joints: "list[dict[str, int]]", workspace: Workspace) -> None:
        from armtempo_shared import armrecord  # here, so that they can be forgotten

        from armtempo_board.hardware import registers

        self._feeder = workspace.feeder

        rows = [row for row in joints if row["encoder"] != armrecord.NONE]
        fitted = [EncoderInput(row["encoder"], row["encoder_inverted"]) for row in rows]
        self._sampler = workspace.sampler
        self._sampler.configure(len(joints), tuple([encoder.address for encoder in fitted]))
        self._block = self._sampler.block
        self._sampler.connect()
        registers.apply(registers.CLOCKS)
        registers.apply(registers.TIMERS)
        rings = workspace.rings([row["max_rate"] for row in joints])
        heap.forget("room", "engine_memory")
        arm = head, joints
        self._joints = [
            JointDrive(n, arm, self._sampler, ring, workspace.memory) for n, ring in enumerate(rings)
        ]
        self._encoders = [fitted[rows.index(row)] if row in rows else NoEncoder() for row in joints]
        slots = [isr.RAW_ENCODERS + rows.index(row) if row in rows else 0 for row in joints]
        self._override: "Any" = None  # while a motion is loaded
        self._end = array("i", [0] * COMMANDED)  # both times at which the last one ended, as in a sample
        self._readings = Readings(self._sampler, self._joints, self._encoders, slots)
        self._following = [FollowingError(row) for row in joints]
        self._inputs = Inputs(head, joints, self._sampler)
        self._feeder.connect(self._inputs, self._joints)
        registers.apply(registers.PRIORITIES)
        self.limits = [{name: row[name] for name in _LIMITS} for row in joints]
        self._pulse_us = head["pulse_ticks"] // _TICKS_PER_US + _PULSE_SPARE_US
        self._epoch = 0
        self._counter_kiticks = 0
        self._watched_joint = self._background_task = 0
        self._homing = False
        self._can_brake = self._can_change = False
        self._braked = self._end_moves = self._change_waits = False
        self.rate = self._running_rate = _PERMILLE  # wanted, in thousandths; the last that was not 0
        self._in_service = False  # service() or refill() is at work, or has not come to its end
        self.moving = False
        self.judged = False  # the next motion is one that was checked before, and nothing has changed since
        self.finished = False
        self.fault = 0
        self.fault_joint = NO_JOINT
        self.known = 0
        self.duration_ticks = 0

    # before a motion

    def home(self, mask: int, steps: "list[int]") -> None:
        """The joints of ``mask`` stand at ``steps`` (one number for every joint)."""
        for number, joint in enumerate(self._joints):
            if mask >> number & 1:
                joint.declare(steps[number])
                self._encoders[number].declare(self._following[number].expected(steps[number]))
        self.known |= mask

    def drivers(self, on: int) -> None:
        """The drivers on, or off: then the arm can be moved by hand, and only its encoders know where to."""
        self._inputs.enable(on != 0)
        if not on:
            self.known = 0

    def load(self, motion: "MotionHead", rate: int = _PERMILLE) -> None:
        """Check a motion and fill the rings; Refused where something is wrong.

        ``rate``, in thousandths: how fast the motion's own time is to run.
        """
        self._check(motion)
        self._take_override(rate, motion.brake_ticks)
        self._inputs.enable(True)
        self._set_clock(-LEAD_TICKS)
        self._end_ticks = self.duration_ticks
        self._sampler.plan(self._end_ticks)
        self._readings.clear(self._override)
        self._can_brake = motion.brake_ticks > 0
        self._can_change = self._can_brake and motion.ramps
        self._braked = self._end_moves = self._change_waits = False
        self.rate = self._running_rate = rate
        for number, joint in enumerate(self._joints):
            joint.load(motion, number)
            if rate != _PERMILLE:
                joint.follow(self._override.law, False)
            self._prefill(joint)
        self._inputs.watch(1)
        self.finished = False

    def _take_override(self, rate: int, brake_ticks: int) -> None:
        heap.release()
        heap.forget()
        gc.collect()
        from armtempo_board.stepgen.override import Override  # here, so that it can be forgotten

        override = Override()
        override.begin(rate, brake_ticks, self.duration_ticks)
        self.duration_ticks = override.end_ticks()
        if self.duration_ticks > LONGEST_RUN_TICKS:
            raise Refused(codes.TOO_LONG)
        self._override = override

    def _check(self, motion: "MotionHead") -> None:
        if self.moving:
            raise Refused(codes.BUSY)
        self._inputs.thaw()  # before it looks: a switch that trips from here on is found now or freezes the motion
        self._watch_idle()
        if self.fault:
            raise Refused(codes.FAULT_PENDING, self.fault_joint, self.fault)
        if not self.judged:
            self._check_splines(motion)
        heap.forget()
        from armtempo_board.motion import endpoints  # here, so that it can be forgotten

        self.duration_ticks = endpoints.duration_ticks(motion)
        for number, joint in enumerate(self._joints):
            if not self.known >> number & 1:
                raise Refused(codes.UNHOMED, number)
            off = endpoints.start_offset(motion, number, joint.position(joint.ring.matches()))
            if off:
                raise Refused(codes.WRONG_START, number, off)

    def _check_splines(self, motion: "MotionHead") -> None:
        from armtempo_board.motion.motion_check import check  # here, so that it can be forgotten

        joint = self._joints[_ANY_JOINT]  # the gap is the same for all
        check(motion, self.limits, joint.gap_ticks, joint.generator.subintervals)

    def _prefill(self, joint: JointDrive) -> None:
        now_kiticks = self._clock()
        for _ in range(_PREFILLS):
            joint.refill(now_kiticks)

    def start(self, homing: bool = False) -> None:
        """Let the counters run. ``homing``: a limit switch ends the motion without a fault."""
        gc.collect()
        self._homing = homing
        self.moving = True
        before_kiticks = isr.counter_kiticks(stm.TIM2)
        mem32[stm.TIM2 + 4 * isr.CR1] = 1
        time.sleep_us(_START_US)
        for _ in range(_START_CHECKS):
            if isr.counters_agree(stm.TIM2, stm.TIM5) and isr.counter_kiticks(stm.TIM2) != before_kiticks:
                return
        self._fail(codes.START_FAILED, NO_JOINT)

    # while it moves

    def service(self) -> None:
        """Keep the queues filled, convert samples, look for faults. An exception in it leaves the position unknown."""
        self._in_service = True
        self._service()
        self._in_service = False

    def refill(self) -> None:
        """Keep the queues filled and nothing else: for between other work, as full ones last a few milliseconds."""
        if self.moving and not self._block[isr.FROZEN]:
            self._in_service = True
            self._refill_queues()
            self._in_service = False

    def _service(self) -> None:
        if not self.moving:
            self._watch_idle()
            return
        if self._block[isr.FROZEN]:
            self._stopped()
            return
        if not self._refill_queues():
            return
        if self._change_waits:
            self._change_rate()
        self._background_task = self._background_task + 1 if self._background_task < _CHECK_INTERRUPT else 0
        if self._background_task == _POLL_SWITCHES:
            self._inputs.poll()
        elif self._background_task == _CHECK_FOLLOWING:
            self._check_following()
        elif self._sampler.overdue(self._watched_joint):
            self._block[isr.TURN_LATE] = 1
        if self._block[isr.TURN_LATE]:
            self._fail(codes.INTERNAL, NO_JOINT)
        elif self._has_ended():
            self._finish()

    def _refill_queues(self) -> bool:
        """Keep all queues filled; False where that ended the motion."""
        now_kiticks = self._clock()
        self._readings.convert(self._epoch, self._counter_kiticks)
        if self._end_moves and self._sampler.quiet():
            self._sampler.end_at(self.duration_ticks)
            self._end_moves = False
        for _ in range(_ROUNDS):
            can_queue_more = False
            for number in range(len(self._joints)):
                joint = self._joints[number]
                fault = joint.refill(now_kiticks)
                if fault:
                    self._fail(fault, number)
                    return False
                can_queue_more = can_queue_more or joint.can_queue_more
            if not can_queue_more:
                break
            now_kiticks = self._clock()
        return True

    def _has_ended(self) -> bool:
        if not self._sampler.done():
            return False
        for joint in self._joints:
            if not joint.ended:
                if self.duration_ticks == LONGEST_RUN_TICKS:  # it has stood still for too long
                    self.freeze()
                return False
        return True

    def _check_following(self) -> None:
        """Compare one joint with its encoder; the next joint comes with the next call."""
        number = self._watched_joint
        self._watched_joint = (number + 1) % len(self._joints)
        joint = self._joints[number]
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

    def _watch_idle(self) -> None:
        """While nothing moves: follow the encoders, and look at the E-stop."""
        for encoder in self._encoders:
            encoder.update()
        if self._inputs.estop_active():
            self._inputs.trip_estop()
        self._note_trip()
        if self._block[isr.FAULT] and not self.fault:
            self._take_fault()

    def _note_trip(self) -> None:
        """A switch may have tripped: know of it, and that an E-stop released the drivers."""
        if self._inputs.note_trip() and self._inputs.releases:
            self.known = 0

    def freeze(self) -> None:
        """Stop all outputs now; not a fault."""
        self._inputs.freeze()
        if self._in_service:
            self._in_service = False
            self.known = 0
        if self.moving:
            self._stopped()

    def brake(self) -> None:
        """Come to rest along the path; freeze where the motion's record has no time for it, or at rest in a pause.

        Over that time acceleration and jerk stay within 1.25 times the arm's limits. Braking begins behind what is
        in the rings, about 75 ms from now; where the rate is changing, behind that. A motion that is over by then ends
        by itself.
        """
        if not self.moving or self._braked:
            return
        standing = self._override.rate == 0
        if not self._can_brake or (standing and self._is_steady()):
            self.freeze()
            return
        self._braked = True
        self.rate = 0
        if standing:  # it will soon
            for joint in self._joints:
                joint.finish()
            self._change_waits = False
            self._end_at(self._override.steady_ticks())
        else:
            self._change_rate()

    def change_rate(self, rate: int) -> None:
        """Let the motion's own time go on at another rate, in thousandths; 0: pause, RESUME: as before it.

        Each change takes the record's brake time, with acceleration and jerk as in ``brake``. It begins as braking
        does; one that comes while the rate is changing waits until that has ended, and only the last one counts.
        """
        if not self.moving:
            raise Refused(codes.NOT_MOVING)
        if self._braked:
            raise Refused(codes.BUSY)
        if not self._can_change:
            raise Refused(codes.FIXED_SPEED)
        if rate == RESUME:
            rate = self._running_rate
        if self._override.is_too_long(self.motion_ticks(), rate):
            raise Refused(codes.TOO_LONG)
        self.rate = rate
        self._running_rate = rate or self._running_rate
        self._change_rate()

    def _is_steady(self) -> bool:
        return bool(self._clock() > self._override.steady_kiticks)

    def _change_rate(self) -> None:
        """Begin the ramp to the rate that is wanted, or wait until the last one lies behind."""
        self._change_waits = self._override.rate != self.rate
        if not self._change_waits or not self._is_steady():
            return
        now_kiticks = self._clock()
        start_kiticks = now_kiticks + LOOKAHEAD_KITICKS + _LAW_MARGIN_KITICKS
        for joint in self._joints:
            start_kiticks = max(start_kiticks, now_kiticks + joint.ahead_kiticks())
        self._change_waits = False
        if start_kiticks << 10 >= self.duration_ticks:
            return
        self._readings.convert(self._epoch, self._counter_kiticks)
        self._override.ramp(start_kiticks << 10, self.rate)
        is_last = self._braked
        self._end_at(self._override.steady_ticks() if is_last else self._override.end_ticks())
        for joint in self._joints:
            joint.follow(self._override.law, is_last)
            if not self._refill_queues():
                break

    def _end_at(self, ticks: int) -> None:
        self.duration_ticks = self._end_ticks = ticks
        self._end_moves = True

    def _fail(self, code: int, joint: int) -> None:
        self._inputs.freeze()
        self._note_trip()
        isr.set_fault(self._block, code, joint)
        self._stopped()

    # after it

    def _stopped(self) -> None:
        """The outputs were frozen: let pulses that have begun end, then count."""
        time.sleep_us(self._pulse_us)
        self._stop_counters()
        self._end_ticks = max(self.motion_ticks(), 0)
        self._clock()
        self._readings.convert(self._epoch, self._counter_kiticks)
        for joint in self._joints:
            joint.settle()
        self._sampler.take_now()
        self._readings.convert(self._epoch, self._counter_kiticks)
        if self._block[isr.TURN_LATE]:
            self.known = 0
        self._inputs.watch(0)  # a switch that bounces is noted once
        self._note_trip()
        if self._block[isr.FAULT] == codes.LIMIT_SWITCH and self._homing:
            self._block[isr.FAULT] = 0
        if self._block[isr.FAULT]:
            self._take_fault()
        self._finish()

    def _take_fault(self) -> None:
        self.fault = self._block[isr.FAULT]
        self.fault_joint = self._block[isr.FAULT_JOINT]

    def _finish(self) -> None:
        self._stop_counters()
        if self._override:
            self._let_override_go()
        for joint in self._joints:
            joint.empty()
            joint.generator.close()
        self._inputs.watch(0)
        self.moving = False
        self.finished = True

    def _let_override_go(self) -> None:
        """What the samples and a snapshot need of it is taken before."""
        self._readings.convert(self._epoch, self._counter_kiticks)
        self._readings.close()
        _put_ticks(self._end, self._end_ticks)
        self._override.put_path(self._end, 0)
        self._override = None

    def _stop_counters(self) -> None:
        mem32[stm.TIM6] = 0
        mem32[stm.TIM2 + 4 * isr.DIER] = 0
        mem32[stm.TIM2 + 4 * isr.CR1] = 0
        mem32[stm.TIM5 + 4 * isr.CR1] = 0

    def clear(self) -> bool:
        """Clear the fault, unless its cause is still there; True where it is cleared."""
        if self.moving or self._inputs.estop_active():
            return False
        self._block[isr.FAULT] = 0
        self.fault = 0
        self.fault_joint = NO_JOINT
        return True

    def close(self) -> None:
        """Release the hardware, the workspace and the motion's file; the engine is not used after it."""
        self.freeze()
        for joint in self._joints:
            joint.close()
        self._feeder.disconnect()
        self._inputs.close()

    # what it knows

    def commanded(self, joint: int) -> int:
        """Steps issued so far, as a position."""
        while True:
            matches = self._joints[joint].ring.matches()
            if not self._sampler.waits():
                return self._joints[joint].position(matches)
            self._readings.convert(
                self._epoch, self._counter_kiticks
            )  # samples come first: they may be older

    def next_sample(self, buffer: "array[int]") -> bool:
        """Copy the oldest sample to ``buffer``, its words as in ``buffers.py``; False: there is none."""
        return self._readings.next(buffer)

    def snapshot(self, buffer: "array[int]") -> None:
        """Write a sample of this moment to ``buffer``; after a motion with the time at which it ended."""
        if self.finished:
            for word in range(COMMANDED):
                buffer[word] = self._end[word]
        else:
            _put_ticks(buffer, max(self.motion_ticks(), 0))
        if self._override:
            self._override.put_path(buffer, 0)
        count = len(self._joints)
        for number in range(count):
            buffer[COMMANDED + number] = self.commanded(number)
            self._encoders[number].update()
            buffer[COMMANDED + count + number] = self._encoders[number].counts

    def motion_ticks(self) -> int:
        """The motion clock, 64 bits; negative before time 0."""
        counter = mem32[stm.TIM2 + 4 * isr.CNT] & 0xFFFFFFFF
        epoch = self._epoch + (1 if counter >> 10 < self._counter_kiticks else 0)
        return int((epoch << 32) + counter)

    def _set_clock(self, ticks: int) -> None:
        mem32[stm.TIM2 + 4 * isr.CNT] = ticks & 0xFFFFFFFF
        mem32[stm.TIM5 + 4 * isr.CNT] = ticks & 0xFFFFFFFF
        self._epoch = ticks >> 32
        self._counter_kiticks = isr.counter_kiticks(stm.TIM2)

    def _clock(self) -> int:
        """The motion clock in Ki ticks (1024 ticks): a small integer."""
        low = isr.counter_kiticks(stm.TIM2)
        if low < self._counter_kiticks:
            self._epoch += 1
        self._counter_kiticks = low
        return (self._epoch << 22) + low


def _put_ticks(sample: "array[int]", ticks: int) -> None:
    """Put the time into a sample; the motion's own time is the same."""
    low = ticks & 0xFFFFFFFF
    sample[TICKS_LOW] = sample[PATH_LOW] = low - (1 << 32) if low >> 31 else low
    sample[TICKS_HIGH] = sample[PATH_HIGH] = ticks >> 32
