"""The hardware side of a motion: from its splines to the pins, and back to samples.

``load`` checks a motion and fills the rings, ``start`` lets the counters run, ``service`` keeps steps ready for
the interrupt that fills the rings (call it every few milliseconds), until ``moving`` is False. Then ``fault``
says why it ended.
After any stop ``commanded`` is exact for every joint whose bit in ``known`` is set:

=====================  =============================================================
end, brake, freeze     known: each pulse begun is finished, and all are counted
limit switch           the same
underrun               the same: the ring stalls, nothing wrong is stepped
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
from armtempo_shared.limits import TICK_HZ
from armtempo_shared.messages import NO_JOINT
from armtempo_shared.motion import Motion
from machine import mem32
from micropython import const

from armtempo_board import heap
from armtempo_board.errors import Refused
from armtempo_board.hardware import isr
from armtempo_board.hardware.encoders import Encoder, NoEncoder
from armtempo_board.hardware.inputs import Inputs
from armtempo_board.hardware.sampler import Sampler
from armtempo_board.motion.following_error import Following
from armtempo_board.motion.joint import LOOKAHEAD_K, Joint
from armtempo_board.motion.readings import Readings
from armtempo_board.motion.ring_feeder import Feeder

LEAD_TICKS = const(1680000)
"""Time from the start of the counters to time 0: 20 ms, in which drivers switch on and DIR settles."""

_PREFILLS = const(32)
_ROUNDS = const(8)  # while queues have room, this work comes before all other, so often
_BRAKE_MARGIN_K = const(2048)  # 25 ms, in which all joints are told
_PULSE_SPARE_US = const(5)
_LIMITS = ("min_steps", "max_steps", "max_rate")  # what of a joint's row in the arm record is needed later


class Engine:
    """``head`` and ``joints`` as ``armrecord.unpack`` gives them. Nothing moves, drivers are off."""

    def __init__(self, head: "dict[str, int]", joints: "list[dict[str, int]]") -> None:
        from armtempo_shared import armrecord  # here, so that they can be forgotten

        from armtempo_board.hardware import registers

        rows = [row for row in joints if row["encoder"] != armrecord.NONE]
        fitted = [Encoder(row["encoder"], row["encoder_inverted"]) for row in rows]
        self._sampler = Sampler(len(joints), tuple([encoder.address for encoder in fitted]))
        self._block = self._sampler.block
        self._sampler.connect()
        registers.apply(registers.CLOCKS)
        registers.apply(registers.TIMERS)
        self._joints = [Joint(n, head, row, self._sampler) for n, row in enumerate(joints)]
        self._encoders = [fitted[rows.index(row)] if row in rows else NoEncoder() for row in joints]
        slots = [7 + rows.index(row) if row in rows else 0 for row in joints]
        self._readings = Readings(self._sampler, self._joints, self._encoders, slots)
        self._following = [Following(row) for row in joints]
        self._inputs = Inputs(head, joints, self._sampler)
        Feeder(self._inputs, self._joints, self._block)  # its timer keeps it
        registers.apply(registers.PRIORITIES)
        self.limits = [{name: row[name] for name in _LIMITS} for row in joints]
        self._pulse_us = head["pulse_ticks"] // (TICK_HZ // 1000000) + _PULSE_SPARE_US
        self._epoch = 0
        self._low = 0
        self._watched = self._chore = 0
        self._homing = False
        self._brake_ticks = 0
        self._braked = self._end_moves = False
        self._halfway = False  # service() did not come to its end
        self.moving = False
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

    def load(self, motion: Motion) -> None:
        """Check a motion and fill the rings; Refused where something is wrong."""
        self._check(motion)
        self._inputs.enable(True)
        self._set_clock(-LEAD_TICKS)
        self._end_ticks = self.duration_ticks
        self._sampler.plan(self._end_ticks)
        self._readings.clear()
        self._brake_ticks = motion.brake_ticks
        self._braked = self._end_moves = False
        for number, joint in enumerate(self._joints):
            joint.load(motion, number)
            self._inputs.watch(number, 1)
            self._prefill(joint)
        self.finished = False

    def _check(self, motion: Motion) -> None:
        if self.moving:
            raise Refused(codes.BUSY)
        self._look()
        if self.fault:
            raise Refused(codes.FAULT_PENDING, self.fault_joint, self.fault)
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

    def _check_splines(self, motion: Motion) -> None:
        from armtempo_board.motion.motion_check import check  # here, so that it can be forgotten

        joint = self._joints[0]
        check(motion, self.limits, joint.gap_ticks, joint.walker.subintervals)

    def _prefill(self, joint: Joint) -> None:
        now_k = self._clock()
        for _ in range(_PREFILLS):
            joint.serve(now_k)

    def start(self, homing: bool = False) -> None:
        """Let the counters run. ``homing``: a limit switch ends the motion without a fault."""
        gc.collect()
        self._homing = homing
        self.moving = True
        before_k = isr.clock_k(stm.TIM2)
        mem32[stm.TIM2 + 4 * isr.CR1] = 1
        time.sleep_us(50)
        for _ in range(5):
            if isr.in_step(stm.TIM2, stm.TIM5) and isr.clock_k(stm.TIM2) != before_k:
                return
        self._fail(codes.START_FAILED, NO_JOINT)

    # while it moves

    def service(self) -> None:
        """Keep the queues filled, convert samples, look for faults. What it raises leaves the position unknown."""
        self._halfway = True
        self._service()
        self._halfway = False

    def refill(self) -> None:
        """Keep the queues filled and nothing else: between other work, as full ones last some milliseconds only."""
        if self.moving and not self._block[isr.FROZEN]:
            self._halfway = True
            self._serve()
            self._halfway = False

    def _service(self) -> None:
        if not self.moving:
            self._look()
            return
        if self._block[isr.FROZEN]:
            self._stopped()
            return
        if not self._serve():
            return
        self._chore = self._chore + 1 if self._chore < 2 else 0
        if self._chore == 0:
            self._inputs.poll()
        elif self._chore == 1:
            self._follow()
        elif self._sampler.overdue(self._watched):
            self._block[isr.LATE] = 1
        if self._block[isr.LATE]:
            self._fail(codes.INTERNAL, NO_JOINT)
        elif self._over():
            self._finish()

    def _serve(self) -> bool:
        """Keep all queues filled; False where that ended the motion."""
        now_k = self._clock()
        self._readings.convert(self._epoch, self._low)
        if self._end_moves and self._sampler.quiet():
            self._sampler.end_at(self.duration_ticks)
            self._end_moves = False
        for _ in range(_ROUNDS):
            hungry = False
            for number in range(len(self._joints)):
                joint = self._joints[number]
                fault = joint.serve(now_k)
                if fault:
                    self._fail(fault, number)
                    return False
                hungry = hungry or joint.hungry
            if not hungry:
                break
            now_k = self._clock()
        return True

    def _over(self) -> bool:
        for joint in self._joints:
            if not joint.over:
                return False
        return self._sampler.done()

    def _follow(self) -> None:
        """Compare one joint with its encoder; the next joint comes with the next call."""
        number = self._watched
        self._watched = (number + 1) % len(self._joints)
        joint = self._joints[number]
        if not self._following[number].limit:
            return
        matches = joint.ring.matches()
        if self._sampler.waits():  # a sample may be older than these matches, and comes first
            return
        encoder = self._encoders[number]
        encoder.update()
        if self._following[number].lost(joint.position(matches), encoder.counts):
            self.known &= ~(1 << number)
            self._fail(codes.FOLLOWING, number)

    def _look(self) -> None:
        """While nothing moves: follow the encoders; the E-stop counts here too."""
        for encoder in self._encoders:
            encoder.update()
        if self._inputs.estop_active():
            self._inputs.trip_estop()
        if self._block[isr.FAULT] and not self.fault:
            self._note_fault()

    def freeze(self) -> None:
        """Stop all outputs now; not a fault."""
        self._inputs.freeze()
        if self._halfway:
            self._halfway = False
            self.known = 0
        if self.moving:
            self._stopped()

    def brake(self) -> None:
        """Come to rest along the path within the motion's own limits; freeze where that was not planned for.

        Braking begins behind what is in the rings, about 75 ms from now. A motion that is over by then ends.
        """
        if not self.moving or self._braked:
            return
        if not self._brake_ticks:
            self.freeze()
            return
        now_k = self._clock()
        start_k = now_k + LOOKAHEAD_K + _BRAKE_MARGIN_K
        for joint in self._joints:
            start_k = max(start_k, now_k + joint.written_k())
        if start_k << 10 < self.duration_ticks:
            self._brake_at(start_k << 10)

    def _brake_at(self, start_ticks: int) -> None:
        self._braked = self._end_moves = True
        self.duration_ticks = self._end_ticks = start_ticks + self._brake_ticks
        for joint in self._joints:
            joint.brake(start_ticks, self._brake_ticks)
            if not self._serve():
                break

    def _fail(self, code: int, joint: int) -> None:
        self._inputs.freeze()
        isr.trip(self._block, code, joint)
        self._stopped()

    # after it

    def _stopped(self) -> None:
        """The outputs were frozen: let begun pulses end, then count."""
        time.sleep_us(self._pulse_us)
        self._stop_counters()
        self._end_ticks = max(self.motion_ticks(), 0)
        self._clock()
        self._readings.convert(self._epoch, self._low)
        high = self._block[isr.HIGH]
        for number, joint in enumerate(self._joints):
            joint.settle(high >> number & 1)
        self._sampler.take_now()
        self._readings.convert(self._epoch, self._low)
        if self._block[isr.LATE]:
            self.known = 0
        if self._block[isr.FAULT] == codes.LIMIT_SWITCH and self._homing:
            self._block[isr.FAULT] = 0
        if self._block[isr.FAULT]:
            self._note_fault()
        self._finish()

    def _note_fault(self) -> None:
        self.fault = self._block[isr.FAULT]
        self.fault_joint = self._block[isr.FAULT_JOINT]
        if self.fault == codes.ESTOP and self._inputs.releases:
            self.known = 0

    def _finish(self) -> None:
        self._stop_counters()
        for number, joint in enumerate(self._joints):
            joint.rest()
            self._inputs.watch(number, 0)
        self.moving = False
        self.finished = True

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
        """Let go of the hardware; the rings may be forgotten after it."""
        self.freeze()
        self._inputs.close()

    # what it knows

    def commanded(self, joint: int) -> int:
        """Steps issued so far, as a position."""
        while True:
            matches = self._joints[joint].ring.matches()
            if not self._sampler.waits():
                return self._joints[joint].position(matches)
            self._readings.convert(self._epoch, self._low)  # samples come first: they may be older

    def next_sample(self, buffer: "array[int]") -> bool:
        """Copy the oldest sample to ``buffer``: ticks (low, high), commanded[], counts[]; False: none."""
        return self._readings.next(buffer)

    def snapshot(self, buffer: "array[int]") -> None:
        """The same as a sample, of this moment; after a motion with the time at which it ended."""
        ticks = self._end_ticks if self.finished else max(self.motion_ticks(), 0)
        low = ticks & 0xFFFFFFFF
        buffer[0] = low - (1 << 32) if low >> 31 else low
        buffer[1] = ticks >> 32
        count = len(self._joints)
        for number in range(count):
            buffer[2 + number] = self.commanded(number)
            self._encoders[number].update()
            buffer[2 + count + number] = self._encoders[number].counts

    def motion_ticks(self) -> int:
        """The motion clock, 64 bits; negative before time 0."""
        counter = mem32[stm.TIM2 + 4 * isr.CNT] & 0xFFFFFFFF
        epoch = self._epoch + (1 if counter >> 10 < self._low else 0)
        return int((epoch << 32) + counter)

    def _set_clock(self, ticks: int) -> None:
        mem32[stm.TIM2 + 4 * isr.CNT] = ticks & 0xFFFFFFFF
        mem32[stm.TIM5 + 4 * isr.CNT] = ticks & 0xFFFFFFFF
        self._epoch = ticks >> 32
        self._low = isr.clock_k(stm.TIM2)

    def _clock(self) -> int:
        """The motion clock in units of 1024 ticks: a small integer."""
        low = isr.clock_k(stm.TIM2)
        if low < self._low:
            self._epoch += 1
        self._low = low
        return (self._epoch << 22) + low
