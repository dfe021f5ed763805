"""Check motion records and walk every joint of them; runs on all interpreters.

Arguments: pulse ticks, gap ticks, space, start and length of braking in ticks (0 0: none; the length whole in a unit
for it) and its shape, then records. Prints what the check says of each, and writes its steps next to it (.steps),
little endian int32 each: joint, direction, time of it or of the one before in 1024 ticks, rising edge, falling edge.
"""

import struct
import sys
from array import array

import micropython
from armtempo_board import step_rates
from armtempo_board.errors import Refused
from armtempo_board.hardware import isr
from armtempo_board.memory import Memory
from armtempo_board.motion import motion_check as checking
from armtempo_board.stepgen.override import Override
from armtempo_board.stepgen.step_generator import StepGenerator
from armtempo_shared import engine_memory
from armtempo_shared.motion import Motion

MASK = 1023
OVERRIDE = Override()
NEVER = 1 << 28
step_rates.one = 333_000  # the evaluator is tried beyond what the program's loop keeps up with
step_rates.together = 1_000_000


class SameRamps:
    """A motion, as far as ``Override`` asks one, whose ramps are all the same."""

    def __init__(self, ticks, shape):
        self.ramp_bits = 14
        while ticks >> self.ramp_bits > 2047:
            self.ramp_bits += 1
        self._entry = (ticks >> self.ramp_bits) + 2048 * shape

    def ramp(self, _at, _parts, _to_rest):
        return self._entry


FREE = {"min_steps": -50000000, "max_steps": 50000000, "max_rate": 336330}


def walk(motion, joint, generator, out, pulse, gap, space, start, length, shape):
    """All steps of one joint; nothing may be allocated on the way."""
    ring, state = array("I", bytes(4 * (MASK + 2))), array("i", bytes(4 * isr.STATE_WORDS))
    state[isr.MASK] = MASK
    isr.set_places(state, ring, generator.queue)
    generator.load(motion, joint, first_position(motion, joint), pulse, gap)
    head = 0
    braked = not length
    OVERRIDE.begin(1000, SameRamps(length, shape), 1 << 38)
    start_kiticks = start >> 10
    lock, unlock = heap_lock, heap_unlock
    while generator.waits() or not generator.ended:
        lock()
        if generator.at_reversal and not generator.waits():
            generator.reverse()
        generator.prepare(NEVER if braked else start_kiticks)
        near = generator.next_kiticks()
        brake_now = not braked and near >= start_kiticks
        count = 0 if brake_now else generator.write(state, head, space, state)
        unlock()
        if brake_now:
            OVERRIDE.ramp(start, 0)
            generator.follow(OVERRIDE.law, True)
            braked = True
        for i in range(0, count, 2):
            rise = ring[(head + i) & MASK]
            fall = ring[(head + i + 1) & MASK]
            out.write(struct.pack("<iiiII", joint, generator.direction, near, rise, fall))
        head = (head + count) & MASK


def first_position(motion, joint):
    """Where the joint stands before: its first angle, rounded."""
    first = struct.unpack_from("<%dq" % motion.degree, motion.data, motion.angle_offset(joint))
    weights = (1, 26, 66, 26, 1) if motion.degree == 5 else (20, 80, 20)
    total = sum([value * weight for value, weight in zip(first, weights)])
    return (total // 60 + (1 << 28)) >> 29


def main(pulse, gap, space, start, length, shape, *records):
    """Walk all with one generator, as the board reuses them."""
    generator = StepGenerator(Memory(list(engine_memory.GENERATOR_PARTS)))
    for record in records:
        with open(record, "rb") as file:
            motion = Motion(file.read())
        wrong = None
        try:
            checking.check(motion, [FREE] * motion.joints, int(gap), generator.subintervals)
        except Refused as refused:
            wrong = (refused.code, refused.joint, refused.value)
        print(wrong)
        with open(record + ".steps", "wb") as out:
            for joint in range(0 if wrong else motion.joints):
                walk(
                    motion,
                    joint,
                    generator,
                    out,
                    *[int(word) for word in (pulse, gap, space, start, length, shape)],
                )


def nothing():
    """There is no heap to lock on CPython."""


heap_lock = getattr(micropython, "heap_lock", nothing)
heap_unlock = getattr(micropython, "heap_unlock", nothing)
main(*sys.argv[1:])
