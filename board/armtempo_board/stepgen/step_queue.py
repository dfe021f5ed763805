"""The queue of steps between the step generator and the ring of a joint.

An item of the queue is a cubic in forward differences (cubics.py), or up to eight single steps. ``emit`` writes the
items to the ring, edge by edge. An interrupt may call it: only ``emit`` changes OUT and the item that it works on, only
the others change IN, and an item is whole before IN counts it.

Times are ticks modulo 2**32, or in Ki ticks (1024 ticks, 12.2 us), which are small integers.
"""

import micropython
from micropython import const

# words of the queue: first the item that ``emit`` works on
_TIME = const(0)  # of the step written last, from the base on; ticks * 2**SHIFT
FIRST = const(1)  # first difference over a group; ticks * 2**(SHIFT + POWER) / steps of a group
SECOND = const(2)  # the second, + 2**29
THIRD = const(3)  # the third, + 2**29
POWER = const(4)
SHIFT = const(5)
_BASE = const(6)  # ticks, modulo 2**32
_REMAINDER = const(7)  # what the steps of a group have left over of its time, as FIRST
_LEFT = const(8)  # steps left in the group that ``emit`` is in; single steps: where the next one's time is
# log2 of the steps in a group, + 1, and SQUARE more if these steps' lengths change evenly; else they are all the
# same. 0: single steps, whose times are in words 0 to 7
GROUP = const(9)
_BASE_KITICKS = const(10)
STEPS = const(11)  # steps not written yet
_ITEM_WORDS = const(12)
# and what ``emit`` keeps besides
_CHANGE = const(12)  # of _STEP, from one step of the group to the next, + 2**29
UNTIL_KITICKS = const(13)  # steps after it are not written
# what cubics are made from
TIME_SCALE = const(14)  # fraction bits of the nodes' times
_BASE_HIGH = const(15)  # what the nodes' times count from; 4096 ticks, + 2**28
_STEP = const(16)  # time of the next step of the group that ``emit`` is in; ticks * 2**SHIFT
PULSE = const(17)  # ticks
HEAD = const(18)  # entry of the ring to be written next; not masked
_ENTRIES_LEFT = const(19)  # entries of the ring that may be written
# items put in and taken out, modulo 2**16
IN = const(20)
OUT = const(21)
LATEST_KITICKS = const(22)  # time of the last step put in
# the subinterval that is gone through (interval_steps.py)
REACHED = const(23)  # its step that was put in last
LAST_STEP = const(24)  # its last one
CUBIC_STEPS = const(25)  # steps of a cubic that kept the error bound
SLOW_TICKS = const(26)  # a last step that takes longer is held back
INTERVAL_HIGH = const(27)  # what the subinterval's real times count from; 4096 ticks, + 2**28
MODE = const(28)
SINGLE_STEPS = const(29)  # steps to be solved one by one before a cubic is tried again
HELD_BACK = const(30)
HALTED = const(31)  # by the law of real time its next step never comes
_ITEMS = const(32)  # CAPACITY of them
CAPACITY = const(16)  # items
QUEUE_SIZE = const(224)

SQUARE = const(8)
_GROUP_MASK = const(7)
_FULL = const(15)  # items: there is no space for two more
# bits of MODE
BY_LAW = const(1)  # real time is not the motion's own, see time_law.py
AT_START = const(2)  # all steps come at the start of the subinterval

_ITEMS_MASK = const(15)
_COUNT_MASK = const(0xFFFF)
_KITICKS_MASK = const(0x3FFFFF)
# entries of a ring: a step is the time of its rising and of its falling edge
_RISE = const(0)
_FALL = const(1)
_RISE_2 = const(2)
_FALL_2 = const(3)
_RISE_3 = const(4)
_FALL_3 = const(5)
_RISE_4 = const(6)
_FALL_4 = const(7)

# as in isr.py: words of a ring's state, of a joint in the block, and of a timer
_WRITTEN = const(0)
_LAST_TIME = const(3)
_FAR_TIME = const(4)
_MASK = const(5)
_FED = const(7)
_SPACE = const(8)
_RING_AT = const(9)
_QUEUE_AT = const(11)
_JOINT_WORDS = const(29)
_CNT = const(9)

_BIAS = const(1 << 29)
_HIGH_BIAS = const(1 << 28)
_LONG_KITICKS = const(1 << 19)  # longer than any cubic


@micropython.viper
def emit(now: int, ring: ptr32, timer: ptr32) -> int:
    """Write edges of queued items to rings: of each joint up to UNTIL_KITICKS, and as many as its SPACE says.

    ``now``: one bit per joint; ``ring``: the state of the first joint's ring in the block of isr.py, followed by the
    others'. Returns a bit for each joint whose last edge had passed by ``timer`` before all was written.

    An interrupt calls it (its cost: docs/hardware.md), once for all joints, as a call costs as much as ten steps or
    more. The compiler keeps the first two arguments in registers: ``now`` becomes the running time, and ``ring`` moves.

    The program itself puts entry 0 of a ring into the compare register. So the stream begins with entry 1 and continues
    to one word after the ring: entry 0 is repeated there. After the last entry is one that is far away.
    """
    wanted = now
    state = ring
    bit = 1
    late = 0
    while wanted:
        if wanted & 1:
            start = (state[_RING_AT + 1] << 30) + state[_RING_AT]
            queue = ptr32((state[_QUEUE_AT + 1] << 30) + state[_QUEUE_AT])
            mask = state[_MASK]
            pulse = queue[PULSE]
            queue[_ENTRIES_LEFT] = state[_SPACE]
            while True:
                if queue[_ENTRIES_LEFT] < 2:
                    break
                # Take the next item out of the queue
                if not queue[STEPS]:
                    count = queue[OUT]
                    if count == queue[IN]:
                        break
                    ring = ptr32(int(queue) + 4 * (_ITEMS + _ITEM_WORDS * (count & _ITEMS_MASK)))
                    place = queue
                    n = _ITEM_WORDS
                    while n:  # four words at a time
                        place[_TIME] = ring[_TIME]
                        place[FIRST] = ring[FIRST]
                        place[SECOND] = ring[SECOND]
                        place[THIRD] = ring[THIRD]
                        place = ptr32(int(place) + 16)
                        ring = ptr32(int(ring) + 16)
                        n -= 4
                    queue[OUT] = (count + 1) & _COUNT_MASK
                at = queue[HEAD] & mask
                # Single steps: their times as they stand
                if not queue[GROUP]:
                    now = queue[queue[_LEFT]]
                    if (
                        queue[_BASE_KITICKS] + (((now - queue[_TIME]) >> 10) & _KITICKS_MASK)
                        > queue[UNTIL_KITICKS]
                    ):
                        break
                    ring = ptr32(start + 4 * at)
                    ring[_RISE] = now
                    ring[_FALL] = now + pulse
                    queue[_LEFT] = queue[_LEFT] + 1
                    queue[STEPS] = queue[STEPS] - 1
                    queue[HEAD] = queue[HEAD] + 2
                    queue[_ENTRIES_LEFT] = queue[_ENTRIES_LEFT] - 2
                    continue
                # A cubic: how many of its steps fit in front of the ring's end, into the space and before UNTIL_KITICKS
                now = queue[_TIME]
                shift = queue[SHIFT]
                count = (mask + 1 - at) >> 1
                n = queue[_ENTRIES_LEFT] >> 1
                if count > n:
                    count = n
                if count > queue[STEPS]:
                    count = queue[STEPS]
                n = queue[UNTIL_KITICKS] - queue[_BASE_KITICKS]
                if n < _LONG_KITICKS:
                    step = queue[_STEP]
                    if not queue[_LEFT]:
                        step = queue[FIRST] >> queue[POWER]
                    n = (n << 10) - ((now + step) >> shift)
                    if n < 0:
                        break
                    n = n // ((step >> shift) + 1) + 1
                    if count > n:
                        count = n
                if not count:
                    break
                queue[STEPS] = queue[STEPS] - count
                queue[HEAD] = queue[HEAD] + count + count
                queue[_ENTRIES_LEFT] = queue[_ENTRIES_LEFT] - count - count
                ring = ptr32(start + 4 * at)
                base = queue[_BASE]
                # Forward differences, in local variables, which cost less than words of the queue
                first = queue[FIRST]
                second = queue[SECOND] - _BIAS
                third = queue[THIRD] - _BIAS
                power = queue[POWER]
                remainder = queue[_REMAINDER]
                left = queue[_LEFT]
                step = queue[_STEP]
                change = queue[_CHANGE] - _BIAS
                group = queue[GROUP] - 1
                # Groups of one step, if the speed changes much
                if not group:
                    while count:
                        count -= 1
                        remainder += first
                        n = remainder >> power
                        remainder -= n << power
                        now += n
                        ring[_RISE] = (now >> shift) + base
                        ring[_FALL] = ring[_RISE] + pulse
                        ring = ptr32(int(ring) + 8)
                        first += second
                        second += third
                is_square = group & SQUARE
                if not is_square:
                    change = 0
                group &= _GROUP_MASK
                carry = power - group
                while count:
                    # The next group: the time of its first step, how that changes, and the next differences
                    if not left:
                        left = 1 << group
                        step = first >> power
                        remainder += first - (step << power)
                        if is_square:
                            n = power + group
                            change = (second - (third >> 1) + ((1 << n) >> 1)) >> n
                            n = change * (left - 1)
                            step -= n >> 1
                            remainder -= (n & 1) << power >> 1
                        n = remainder >> carry
                        remainder -= n << carry
                        now += n
                        first += second
                        second += third
                        # All its steps, some at a time: all of one length,
                        if count >= left:
                            count -= left
                            if not change:
                                while left:
                                    now = now + step
                                    ring[_RISE] = (now >> shift) + base
                                    ring[_FALL] = ring[_RISE] + pulse
                                    now = now + step
                                    ring[_RISE_2] = (now >> shift) + base
                                    ring[_FALL_2] = ring[_RISE_2] + pulse
                                    now = now + step
                                    ring[_RISE_3] = (now >> shift) + base
                                    ring[_FALL_3] = ring[_RISE_3] + pulse
                                    now = now + step
                                    ring[_RISE_4] = (now >> shift) + base
                                    ring[_FALL_4] = ring[_RISE_4] + pulse
                                    ring = ptr32(int(ring) + 32)
                                    left -= 4
                                continue
                            # or of lengths that change evenly
                            while left:
                                now = now + step
                                ring[_RISE] = (now >> shift) + base
                                ring[_FALL] = ring[_RISE] + pulse
                                step += change
                                now = now + step
                                ring[_RISE_2] = (now >> shift) + base
                                ring[_FALL_2] = ring[_RISE_2] + pulse
                                step += change
                                ring = ptr32(int(ring) + 16)
                                left -= 2
                            continue
                    # or those that have space, singly
                    while left and count:
                        now = now + step
                        ring[_RISE] = (now >> shift) + base
                        ring[_FALL] = ring[_RISE] + pulse
                        step += change
                        ring = ptr32(int(ring) + 8)
                        left -= 1
                        count -= 1
                if queue[STEPS]:
                    queue[_TIME] = now
                    queue[FIRST] = first
                    queue[SECOND] = second + _BIAS
                    queue[_REMAINDER] = remainder
                    queue[_LEFT] = left
                    queue[_STEP] = step
                    queue[_CHANGE] = change + _BIAS
            # Count what was written
            n = queue[HEAD]
            if n != state[_WRITTEN]:
                if ((state[_LAST_TIME] - pulse - timer[_CNT]) >> 31) & 1:
                    late += bit
                ring = ptr32(start)
                now = ring[(n - 1) & mask]
                state[_WRITTEN] = n
                state[_LAST_TIME] = now
                count = 1
                now += count << 31
                state[_FAR_TIME] = now
                ring[n & mask] = now
                ring[mask + 1] = ring[_RISE]
        wanted >>= 1
        bit += bit
        state = ptr32(int(state) + 4 * _JOINT_WORDS)
    return late


@micropython.viper
def put_single(queue: ptr32, high: int, ticks: int) -> object:
    """Put in one step at ``high`` (4096 ticks, + 2**28) and ``ticks``."""
    put_in = queue[IN]
    item = ptr32(int(queue) + 4 * (_ITEMS + _ITEM_WORDS * (put_in & _ITEMS_MASK)))
    high -= _HIGH_BIAS
    item[_TIME] = (high << 12) + ticks
    item[_LEFT] = 0
    item[GROUP] = 0
    item[STEPS] = 1
    high = (high << 2) + (ticks >> 10)
    item[_BASE_KITICKS] = high
    queue[LATEST_KITICKS] = high
    queue[IN] = (put_in + 1) & _COUNT_MASK


@micropython.viper
def has_space(queue: ptr32, until_kiticks: int) -> int:
    """1 if the queue has space for two items and does not continue beyond a time, the new UNTIL_KITICKS; else 0."""
    queue[UNTIL_KITICKS] = until_kiticks
    if (queue[IN] - queue[OUT]) & _COUNT_MASK >= _FULL:
        return 0
    return ((queue[LATEST_KITICKS] - until_kiticks - 1) >> 31) & 1


@micropython.viper
def next_kiticks(queue: ptr32) -> int:
    """Time of the next step in the queue, or of the one before it; -1: there is none."""
    if queue[STEPS]:
        now = queue[_TIME]
        if not queue[GROUP]:
            return queue[_BASE_KITICKS] + (((queue[queue[_LEFT]] - now) >> 10) & _KITICKS_MASK)
        if queue[_LEFT]:
            now += queue[_STEP]
        else:
            now += queue[FIRST] >> queue[POWER]
        return queue[_BASE_KITICKS] + (now >> (queue[SHIFT] + 10))
    if queue[IN] == queue[OUT]:
        return -1
    return queue[_ITEMS + _ITEM_WORDS * (queue[OUT] & _ITEMS_MASK) + _BASE_KITICKS]


@micropython.viper
def withdraw(queue: ptr32, first: int, from_kiticks: int, ring: ptr32) -> int:
    """Take the last items back out, down to one that begins before a time.

    None goes that was put in before the ``first``. Returns their steps that were not written. ``ring``: its state,
    which keeps the interrupt from calling ``emit`` meanwhile; about 30 instructions an item, as a full ring may last
    only 2 ms.
    """
    fed = ring[_FED]
    ring[_FED] = 0
    steps = 0
    put_in = queue[IN]
    while put_in != first:
        if put_in == queue[OUT]:
            steps += queue[STEPS]
            queue[STEPS] = 0
            break
        put_in = (put_in - 1) & _COUNT_MASK
        item = _ITEMS + _ITEM_WORDS * (put_in & _ITEMS_MASK)
        steps += queue[item + STEPS]
        if queue[item + _BASE_KITICKS] < from_kiticks:
            break
    queue[IN] = put_in
    queue[LATEST_KITICKS] = 0
    ring[_FED] = fed
    return steps
