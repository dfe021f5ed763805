"""A small motion of three joints that turn and rest, as a record and as a function of time."""

from armtempo_shared import motion
from armtempo_shared.basis import BASIS, FACTORIAL
from armtempo_shared.limits import TICK_HZ

SEGMENTS = 9
BRAKE_TICKS = TICK_HZ // 5
RAMP_BITS = 14
_LENGTH = (BRAKE_TICKS >> RAMP_BITS,)
RAMPS = _LENGTH * motion.REST_ENTRIES, _LENGTH * motion.OTHER_ENTRIES, RAMP_BITS, 0
# steps at the control points, seconds at those of the time axis
ANGLES = (
    (0, 0, 0, 0, 0, 400, 1800, 2500, 3000, 3000, 3000, 3000, 3000, 3000),
    (0, 0, 0, 0, 0, -500, -900, 200, 700, 700, 700, 700, 700, 700),
    (0, 0, 0, 0, 0, 3, 3, -3, 2, 2, 2, 2, 2, 2),
)
TIMES = (-0.2, -0.1, 0, 0.1, 0.2, 0.4, 0.55, 0.65, 0.8, 1.0, 1.1, 1.2, 1.3, 1.4)


def whole(values, scale):
    return [round(value * scale) for value in values]


def record(ramps=RAMPS, control_points=ANGLES, time_points=TIMES):
    angles = [whole(points, 1 << 28) for points in control_points]
    times = [whole(time_points, TICK_HZ << 16)]
    return motion.Motion(motion.pack(5, angles, times, 1, ramps, 0))


def ramp_way(shape, r):
    """e at r of a shape: the integral of a rate from 0 to 1 whose slope is linear between 0, p/16, q/16 and 1."""
    first, second = (motion.RAMP_SHAPES[shape] & 15) / 16, (motion.RAMP_SHAPES[shape] >> 4) / 16
    late = 3 - first - second - 3 * motion.RAMP_WAYS[shape] / 64
    way = rate = start = 0.0
    slopes = (0.0, 2 * (1 - late) / second, 2 * late / (1 - first), 0.0)
    for width, before, after in zip((first, second - first, 1 - second), slopes, slopes[1:]):
        x = min(max(r - start, 0.0), width)
        bend = (after - before) / width
        way += x * (rate + x * (before / 2 + x * bend / 6))
        rate += x * (before + x * bend / 2)
        start += width
    return way


def spline(points, segment, u):
    total = 0.0
    for power in range(6):
        total += u**power * sum([BASIS[5][power][i] * points[segment + i] for i in range(6)])
    return total / FACTORIAL[5]


def path(seconds):
    """Where the joints are at a time of the motion."""
    low, high = 0.0, float(SEGMENTS)
    for _ in range(45):
        middle = (low + high) / 2
        segment = min(int(middle), SEGMENTS - 1)
        if spline(TIMES, segment, middle - segment) < seconds:
            low = middle
        else:
            high = middle
    segment = min(int(low), SEGMENTS - 1)
    return [spline(points, segment, low - segment) for points in ANGLES]
