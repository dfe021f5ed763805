"""Walk every joint of a motion record and write the steps to a file; runs on all interpreters.

Arguments: record, output, pulse ticks, gap ticks, room, and, to brake, start and length in ticks. Output, little endian int32 per step: joint, direction,
time of the step in 1024 ticks (room 2 only: of the last step of its batch), rising edge, falling edge.
"""

import struct
import sys
from array import array

from armtempo_board.walker import Walker
from armtempo_shared.motion import Motion

MASK = 1023


def walk(motion, joint, walker, out, pulse, gap, room, start, length):
    """All steps of one joint; returns their number."""
    ring = array("I", bytes(4 * (MASK + 1)))
    first = struct.unpack_from("<6q", motion.data, motion.angle_offset(joint))
    weights = (1, 26, 66, 26, 1) if motion.degree == 5 else (20, 80, 20)
    total = 0
    for value, weight in zip(first, weights):
        total += value * weight
    position = (total // 60 + (1 << 28)) >> 29
    walker.load(motion, joint, position, pulse, gap)
    head = 0
    steps = 0
    braked = not length
    while not walker.ended:
        if not braked and walker.next_1024() > start >> 10:
            walker.brake(start, length)
            braked = True
        if walker.at_turn:
            walker.turn()
        count = walker.fill(ring, MASK, head, room if braked else 2)
        for i in range(0, count, 2):
            rise = ring[(head + i) & MASK]
            fall = ring[(head + i + 1) & MASK]
            out.write(struct.pack("<iiiII", joint, walker.direction, walker.last_1024(), rise, fall))
        head = (head + count) & MASK
        steps += count // 2
    return steps


def main(record, output, pulse, gap, room, start=0, length=0):
    """Walk all joints with one walker, as the board reuses them."""
    with open(record, "rb") as file:
        motion = Motion(file.read())
    walker = Walker()
    with open(output, "wb") as out:
        for joint in range(motion.joints):
            steps = walk(
                motion, joint, walker, out, int(pulse), int(gap), int(room), int(start), int(length)
            )
            print(joint, steps)


main(*sys.argv[1:])
