"""What the compiled part of the check of a motion finds for random subintervals and control points: a line each.

CPython computes it with exact numbers, MicroPython with words: all must print the same.
"""

import sys
from array import array
from binascii import crc32

import stand_in

stand_in.install()

from armtempo_board.motion import rate_check  # noqa: E402
from armtempo_board.stepgen import control_points  # noqa: E402

BIAS = 1 << 29


class Numbers:
    """The same on each interpreter: a linear congruential generator (Knuth's MMIX)."""

    def __init__(self, seed):
        self.state = seed

    def bits(self, count):
        self.state = (self.state * 6364136223846793005 + 1442695040888963407) & (1 << 64) - 1
        return self.state >> 64 - count

    def within(self, low, high):
        return low + self.bits(48) % (high - low + 1)

    def signed(self):
        """Of any magnitude that a difference has."""
        most = 1 << self.within(0, 29)
        return self.within(1 - most, most - 1)


def measures(scale, differences, points):
    low, high = min(points), max(points)
    row = differences + [min(differences), max(differences)]
    return array("i", [scale] + [each + BIAS for each in row] + [low, high])


def subinterval(numbers):
    """Words of a piece of the angle, its measures, those of its time, limits: most near what decides; whether time
    is steady."""
    middle = BIAS + numbers.within(-(1 << 26), 1 << 26)
    reach = 1 << numbers.within(0, 26)
    points = [middle + numbers.within(-reach, reach) for _ in range(6)]
    piece = array("i", points + [numbers.bits(28) for _ in range(6)])
    least = 1 << numbers.within(2, 27)
    ticks = [numbers.within(least, 2 * least) for _ in range(5)]
    if is_back := numbers.bits(4) == 0:
        ticks[numbers.bits(2)] = -1
    steps = [numbers.signed() for _ in range(5)]
    rate = numbers.within(1, 120_000)
    angle_scale, time_scale = numbers.within(0, 28), numbers.within(0, 40)
    if numbers.bits(1):  # near the rate that is compared with
        rate = numbers.within(1_000, 120_000)
        angle_scale, time_scale = 0, 12
        steps = [min(max(each, 1) * rate // 84_000_000, BIAS - 1) + numbers.within(-6, 6) for each in ticks]
    low, high = middle - numbers.within(0, 2 * reach), middle + numbers.within(0, 2 * reach)
    gap = 1 << numbers.within(0, 20)
    angle = measures(angle_scale, steps, points)
    return (
        piece,
        angle,
        measures(time_scale, ticks, points),
        rate_check.limits(low, high, rate, gap + numbers.bits(8)),
        not is_back,
    )


def points(numbers):
    """Words of six control points, close together or far apart; in order or not; and their bound."""
    middle = numbers.within(-(1 << 56), 1 << 56)
    reach = 1 << numbers.within(0, 58)
    found = [middle + numbers.within(0, reach) for _ in range(6)]
    if numbers.bits(1):
        found.sort()
    if numbers.bits(3) == 0:
        found = [middle] * 6
    data = b"".join([(each & (1 << 64) - 1).to_bytes(8, "little") for each in found])
    return array("i", bytes(8) + data), 1 << (26 + numbers.bits(1))


def main(seed, count):
    numbers = Numbers(seed)
    found = {name: bytearray() for name in ("is_inside", "compare", "is_gentle", "survey")}
    for _ in range(count):
        piece, angle, time, limits, is_steady = subinterval(numbers)
        found["is_inside"].append(rate_check.is_inside(piece, angle, time, limits))
        found["compare"].append(1 + rate_check.compare(angle, time, limits))
        if is_steady:
            found["is_gentle"].append(rate_check.is_gentle(angle, time, limits))
        words, bound = points(numbers)
        found["survey"].append(control_points.survey(words, 2, 6, bound))
    for name in sorted(found):
        assert len(set(found[name])) > 1, name
        print(name, [found[name].count(bytes([value])) for value in range(4)], "%08x" % crc32(found[name]))


main(int(sys.argv[1]), int(sys.argv[2]))
