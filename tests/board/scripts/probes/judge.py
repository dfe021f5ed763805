"""Print what the check says of motion records; arguments: lowest and highest position, rate, gap, records."""

import sys

from armtempo_board.errors import Refused
from armtempo_board.memory import Memory
from armtempo_board.motion.motion_check import check
from armtempo_board.stepgen.step_generator import StepGenerator
from armtempo_shared import engine_memory
from armtempo_shared.motion import Motion


def main(low, high, rate, gap, *records):
    """A line for each record."""
    subintervals = StepGenerator(Memory(list(engine_memory.GENERATOR_PARTS))).subintervals
    row = {"min_steps": int(low), "max_steps": int(high), "max_rate": int(rate)}
    for record in records:
        with open(record, "rb") as file:
            motion = Motion(file.read())
        try:
            check(motion, [row] * motion.joints, int(gap), subintervals)
            print(None)
        except Refused as refused:
            print((refused.code, refused.joint, refused.value))


main(*sys.argv[1:])
