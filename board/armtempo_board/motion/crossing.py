"""The times of the steps that cross the play of a gear, merged with those of the joint.

The n-th of N steps comes at 64 * PACE * sqrt(n) ticks until half of them are made, and the others mirrored: the motor's
extra speed grows evenly and falls evenly. Times are ticks modulo 2**32; a step is never closer than SPACING to the one
before it.
"""

import micropython
from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array

PACE = const(0)
SPACING = const(1)  # ticks
TOTAL = const(2)  # steps of this crossing,
LEFT = const(3)  # and those that were not put into the queue
START = const(4)  # ticks
SPAN = const(5)  # ticks from START to the last step
LATEST = const(6)  # time of the step put in last
NEXT = const(7)  # of the joint's steps that were tapped, the next one,
COUNT = const(8)  # and how many they are
END = const(9)  # time of the last step of the play
LATE = const(10)  # a step came so much later than it should that others would follow it in a burst
SIZE = const(11)

_LATE_TICKS = const(168000)  # 2 ms
_MARGIN_TICKS = const(2097152)  # 25 ms, for which the main loop may be busy with something else
_MOST_SINGLE = const(8)  # steps of an item
_ROOT_BIT = const(1 << 26)  # of the square of 64 times a root; N is at most 32767
# as in step_queue.py: words of the queue
_LEFT = const(8)
_GROUP = const(9)
_BASE_KITICKS = const(10)
_STEPS = const(11)
_ITEM_WORDS = const(12)
_IN = const(20)
_OUT = const(21)
_ITEMS = const(32)
_ITEMS_MASK = const(15)
_COUNT_MASK = const(0xFFFF)
_FULL = const(15)
# as in isr.py
_CNT = const(9)
_LAST_TIME = const(3)


@micropython.viper
def root(value: int) -> int:
    """64 times the square root, rounded down. 470 to 660 instructions."""
    rest = value << 12
    found = 0
    bit = _ROOT_BIT
    while bit:
        if rest >= found + bit:
            rest -= found + bit
            found = (found >> 1) + bit
        else:
            found >>= 1
        bit >>= 2
    return found


def start_at_0(words: "array[int]", steps: int) -> None:
    """Begin a crossing of ``steps`` at time 0."""
    words[TOTAL] = words[LEFT] = steps
    words[START] = words[LATE] = 0
    words[LATEST] = -words[SPACING]
    words[SPAN] = words[END] = words[PACE] * (root(steps >> 1) + root(steps - (steps >> 1)))


def start_after(
    words: "array[int]", steps: int, state: "array[int] | memoryview[int]", timer: int, gap_ticks: int
) -> None:
    """Begin a crossing after the last entry of a ring, when DIR has been turned, but not before the next 25 ms.

    The joint's own steps may come earlier. ``state``: the ring's (isr.py).
    """
    start_at_0(words, steps)
    _move(words, state, timer, gap_ticks)


@micropython.viper
def _move(words: ptr32, state: ptr32, timer: ptr32, gap_ticks: int) -> object:
    start = state[_LAST_TIME] + gap_ticks
    words[LATEST] = start - words[SPACING]
    soonest = timer[_CNT] + _MARGIN_TICKS
    if ((start - soonest) >> 31) & 1:
        start = soonest
    words[START] = start
    words[END] = start + words[SPAN]


@micropython.viper
def merge(words: ptr32, tapped: ptr32, queue: ptr32, extra_kiticks: int) -> object:
    """Put steps into the queue until it is full: of the joint those that were tapped, of the play up to a time.

    ``tapped``: pairs of a rising and a falling edge, as in a ring.
    """
    while (queue[_IN] - queue[_OUT]) & _COUNT_MASK < _FULL:
        item = ptr32(int(queue) + 4 * (_ITEMS + _ITEM_WORDS * (queue[_IN] & _ITEMS_MASK)))
        count = 0
        while count < _MOST_SINGLE:
            left = words[LEFT]
            next_step = words[NEXT]
            is_joint = 0
            if next_step < words[COUNT]:
                is_joint = 1
            time = 0
            if left:
                n = words[TOTAL] - left + 1
                if n + n <= words[TOTAL]:
                    time = words[START] + words[PACE] * int(root(n))
                else:
                    time = words[START] + words[SPAN] - words[PACE] * int(root(left - 1))
                if is_joint:
                    is_joint = ((tapped[next_step + next_step] - time) >> 31) & 1
                elif ((time - (extra_kiticks << 10)) >> 31) & 1 == 0:
                    break
            elif not is_joint:
                break
            if is_joint:
                time = tapped[next_step + next_step]
                words[NEXT] = next_step + 1
            else:
                words[LEFT] = left - 1
            soonest = words[LATEST] + words[SPACING]
            if ((time - soonest) >> 31) & 1:
                if ((time - soonest + _LATE_TICKS) >> 31) & 1:
                    words[LATE] = 1
                time = soonest
            words[LATEST] = time
            item[count] = time
            count += 1
        if not count:
            break
        item[_LEFT] = 0
        item[_GROUP] = 0
        item[_BASE_KITICKS] = 0
        item[_STEPS] = count
        queue[_IN] = (queue[_IN] + 1) & _COUNT_MASK


@micropython.viper
def has_ended(words: ptr32, until_kiticks: int) -> int:
    """1 if all steps were put into the queue, and a step after a time is not too close to the last one; else 0."""
    if words[LEFT] or words[NEXT] < words[COUNT]:
        return 0
    return ((words[LATEST] + words[SPACING] - (until_kiticks << 10) - 1) >> 31) & 1
