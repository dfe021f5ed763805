"""Start and end of a motion, from its control points in exact integers."""

from armtempo_shared.basis import BASIS, FACTORIAL
from armtempo_shared.limits import STEP_FRACTION_BITS, TICK_FRACTION_BITS
from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import MotionHead

_CONSTANT = const(0)  # the power of u in a row of BASIS


def _at_node(motion: "MotionHead", offset: int, node: int) -> "tuple[int, int]":
    """(numerator, denominator) of a spline at the start of its segment ``node``, Eq. (15) at u = 0."""
    degree = motion.degree
    points = motion.points(offset + 8 * node, degree)
    weights = BASIS[degree][_CONSTANT]
    return sum([weights[i] * points[i] for i in range(degree)]), FACTORIAL[degree]


def duration_ticks(motion: "MotionHead") -> int:
    """Time at which the last joint is done, in whole ticks, rounded up."""
    longest = 0
    for joint in range(1 if motion.shared else motion.joints):
        total, parts = _at_node(motion, motion.time_offset(joint), motion.segments * motion.refine)
        longest = max(longest, -(-total // (parts << TICK_FRACTION_BITS)))
    return longest


def start_offset(motion: "MotionHead", joint: int, position_steps: int) -> int:
    """0 if the joint is at the motion's start, else the distance of the start in steps (not 0).

    A distance up to half a step and 1/64 counts as 0: the step generator allows for it.
    """
    total, parts = _at_node(motion, motion.angle_offset(joint), 0)
    one = parts << STEP_FRACTION_BITS
    off = total - position_steps * one
    if 64 * abs(off) <= 33 * one:
        return 0
    return (2 * off + one) // (2 * one) or (1 if off > 0 else -1)


def at_start(motion: "MotionHead", joint: int) -> int:
    """Start of the joint, in 1/64 step, rounded down."""
    return _at_64th(motion, joint, 0)


def at_end(motion: "MotionHead", joint: int) -> int:
    """End of the joint, in 1/64 step, rounded down."""
    return _at_64th(motion, joint, motion.segments)


def _at_64th(motion: "MotionHead", joint: int, node: int) -> int:
    total, parts = _at_node(motion, motion.angle_offset(joint), node)
    return 64 * total // (parts << STEP_FRACTION_BITS)
