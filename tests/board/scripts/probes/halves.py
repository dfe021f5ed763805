"""Walk through parts at will and compare each with halving from the root, in plain integers; on all interpreters.

Arguments: motion records. Prints how many parts were compared, and the deepest level.
"""

import sys

from armtempo_board.memory import Memory
from armtempo_board.stepgen import subdivision
from armtempo_board.stepgen.subintervals import Subintervals
from armtempo_shared import engine_memory
from armtempo_shared.motion import Motion

DEEPEST = 14
LOW = (1 << 28) - 1
ROOT = subdivision.PIECES_SIZE - 13


def halved(pieces, node, level):
    """The part's points: its root halved ``level`` times, as the node's bits say."""
    points = [(pieces[ROOT + i] << 28) + pieces[ROOT + i + 6] for i in range(6)]
    while level:
        level -= 1
        left, right = [], []
        while points:
            left.append(points[0])
            right.append(points[-1])
            points = [(points[i] + points[i + 1] + 1) >> 1 for i in range(len(points) - 1)]
        points = right[::-1] if node >> level & 1 else left
    return [point >> 28 for point in points] + [point & LOW for point in points]


def walk(motion, joint, parts, number):
    """Split and skip at random; the numbers of parts, and the deepest level."""
    parts.load(motion, joint)
    count = deepest = 0
    while parts.measure():
        node, level = parts.time_measures[subdivision.NODE], parts.angle_measures[subdivision.LEVEL]
        assert node >> level == 1
        for pieces in (parts.angle, parts.time):
            assert list(pieces)[:12] == halved(pieces, node, level), (joint, node, level)
        count += 1
        deepest = max(deepest, level)
        number = (number * 1103515245 + 12345) & 0x3FFFFFFF
        if level < 2 or (level < DEEPEST and number >> 16 & 15 < 5):
            parts.advance(subdivision.SPLIT)
        else:
            parts.advance(subdivision.SKIP)
    return count, deepest


def main(*records):
    """All joints of all records with the same buffers, as the board reuses them."""
    parts = Subintervals(Memory(list(engine_memory.GENERATOR_PARTS)))
    found = []
    for number, record in enumerate(records):
        with open(record, "rb") as file:
            motion = Motion(file.read())
        for joint in range(motion.joints):
            found.append(walk(motion, joint, parts, number + joint))
    print(sum([count for count, _ in found]), max([level for _, level in found]))


main(*sys.argv[1:])
