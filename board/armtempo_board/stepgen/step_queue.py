"""The queue of steps between the step generator and the ring of a joint, and the cubics that it holds.

An item of the queue is a cubic or a few single steps. A cubic: the times of up to 1024 steps between two nodes, by the
cubic Hermite polynomial through them, in forward differences. ``emit`` writes the items to the ring, edge by edge. An
interrupt may call it: only ``emit`` changes OUT and the item that it works on, only the others change IN, and an item
is whole before IN counts it.

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
_REMAINDER = const(7)  # what the steps of a group have left over of its time
_LEFT = const(8)  # steps left in the group; of single steps: the word in which the next one's time stands
GROUP = const(9)  # steps in a group; 0: single steps, whose times stand in words 0 to 7
CARRY = const(10)  # _REMAINDER / 2**CARRY is in units of _TIME
STEPS = const(11)  # steps not written yet
_BASE_KITICKS = const(12)
_ITEM_WORDS = const(13)
UNTIL_KITICKS = const(13)  # steps after it are not written
# what cubics are made from
TIME_SCALE = const(14)  # fraction bits of the nodes' times
_BASE_HIGH = const(15)  # what the nodes' times count from; 4096 ticks, + 2**28
_STEP = const(16)  # time of one step of the group that ``emit`` is in; ticks * 2**SHIFT
PULSE = const(17)  # ticks
HEAD = const(18)  # entry of the ring to be written next; not masked
_ROOM = const(19)  # entries of the ring that may be written
# items put in and taken out, modulo 2**16
IN = const(20)
OUT = const(21)
LATEST_KITICKS = const(22)  # time of the last step put in
# the subinterval that is gone through (interval_steps.py)
REACHED = const(23)  # its step that was put in last
LAST_STEP = const(24)  # its last one
CUBIC_STEPS = const(25)  # steps of a cubic that kept the error bound
SLOW_TICKS = const(26)  # a last step that takes longer is held back
INTERVAL_HIGH = const(27)  # what the subinterval's times count from; 4096 ticks, + 2**28
MODE = const(28)
SINGLE_STEPS = const(29)  # steps to be solved one by one before a cubic is tried again
HELD_BACK = const(30)
ENDED = const(31)
_ITEMS = const(32)  # CAPACITY of them
CAPACITY = const(8)  # items
QUEUE_SIZE = const(136)

_FULL = const(7)  # items: there is no room for two more
# bits of MODE
BRAKING = const(1)
AT_START = const(2)  # all steps come at the start of the subinterval

_ITEMS_MASK = const(7)
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
# as in newton.py: words of the solver
_FIRST_NODE = const(28)
_FIRST_TIME = const(28)
_FIRST_MANTISSA = const(29)
_FIRST_EXPONENT = const(30)
_MIDDLE_TIME = const(36)
_MIDDLE_MANTISSA = const(37)
_MIDDLE_EXPONENT = const(38)
_END_TIME = const(44)
_END_MANTISSA = const(45)
_END_EXPONENT = const(46)
# of two neighbouring nodes
_NODE_TIME = const(0)
_NODE_MANTISSA = const(1)
_NODE_EXPONENT = const(2)
_NODE_DELAY = const(3)
_NODE_RATE = const(4)
_NEXT_TIME = const(8)
_NEXT_MANTISSA = const(9)
_NEXT_EXPONENT = const(10)
_NODE_WORDS = const(8)

_BIAS = const(1 << 29)
_HIGH_BIAS = const(1 << 28)
_HALF_MASK = const((1 << 15) - 1)
_LONG_KITICKS = const(1 << 19)  # longer than any cubic


@micropython.viper
def emit(now: int, ring: ptr32, queue: ptr32, mask: int) -> object:
    """Write edges of the items in the queue to the ring: up to UNTIL_KITICKS, and as many as ``now`` says.

    The compiler keeps the first two arguments in registers: ``now`` becomes the running time, and ``ring`` moves.
    """
    start = int(ring)
    pulse = queue[PULSE]
    queue[_ROOM] = now
    while True:
        if queue[_ROOM] < 2:
            break
        # Take the next item out of the queue
        if not queue[STEPS]:
            count = queue[OUT]
            if count == queue[IN]:
                break
            ring = ptr32(int(queue) + 4 * (_ITEMS + _ITEM_WORDS * (count & _ITEMS_MASK)))
            n = 0
            while n < _ITEM_WORDS:
                queue[n] = ring[n]
                n += 1
            queue[OUT] = (count + 1) & _COUNT_MASK
        at = queue[HEAD] & mask
        # Single steps: their times as they stand
        if not queue[GROUP]:
            now = queue[queue[_LEFT]]
            if queue[_BASE_KITICKS] + (((now - queue[_TIME]) >> 10) & _KITICKS_MASK) > queue[UNTIL_KITICKS]:
                break
            ring = ptr32(start + 4 * at)
            ring[_RISE] = now
            ring[_FALL] = now + pulse
            queue[_LEFT] = queue[_LEFT] + 1
            queue[STEPS] = queue[STEPS] - 1
            queue[HEAD] = queue[HEAD] + 2
            queue[_ROOM] = queue[_ROOM] - 2
            continue
        # A cubic: how many of its steps fit in front of the ring's end, into the room and before UNTIL_KITICKS
        now = queue[_TIME]
        shift = queue[SHIFT]
        count = (mask + 1 - at) >> 1
        n = queue[_ROOM] >> 1
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
        queue[_ROOM] = queue[_ROOM] - count - count
        ring = ptr32(start + 4 * at)
        base = queue[_BASE]
        # Forward differences, in local variables, which cost less than words of the queue
        first = queue[FIRST]
        second = queue[SECOND] - _BIAS
        third = queue[THIRD] - _BIAS
        power = queue[POWER]
        remainder = queue[_REMAINDER]
        left = queue[_LEFT]
        carry = queue[CARRY]
        step = queue[_STEP]
        while count:
            # The next group: the time of one of its steps, and the next differences
            if not left:
                left = queue[GROUP]
                step = first >> power
                remainder += first - (step << power)
                n = remainder >> carry
                remainder -= n << carry
                now += n
                first += second
                second += third
            n = count
            if n > left:
                n = left
            left -= n
            count -= n
            # Its steps, evenly spaced: four at a time, then singly
            while n >= 4:
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
                n -= 4
            while n:
                now = now + step
                ring[_RISE] = (now >> shift) + base
                ring[_FALL] = ring[_RISE] + pulse
                ring = ptr32(int(ring) + 8)
                n -= 1
        queue[_TIME] = now
        queue[FIRST] = first
        queue[SECOND] = second + _BIAS
        queue[_REMAINDER] = remainder
        queue[_LEFT] = left
        queue[_STEP] = step


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
def has_room(queue: ptr32) -> int:
    """1 where the queue has room for two items and does not go on beyond UNTIL_KITICKS, else 0."""
    if (queue[IN] - queue[OUT]) & _COUNT_MASK >= _FULL:
        return 0
    return 1 if queue[LATEST_KITICKS] <= queue[UNTIL_KITICKS] else 0


@micropython.viper
def holds_steps(queue: ptr32) -> int:
    """1 while steps in the queue have not been written, else 0."""
    return 1 if queue[STEPS] or queue[IN] != queue[OUT] else 0


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
def withdraw(queue: ptr32, first: int, from_kiticks: int) -> int:
    """Take the last items back out, down to one that begins before a time; ``emit`` must not run meanwhile.

    None goes that was put in before the ``first``. Returns their steps that were not written.
    """
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
    return steps


@micropython.viper
def cubics_fit(steps: int, solver: ptr32, queue: ptr32) -> int:
    """1 where two cubics of ``steps`` each, from FIRST_NODE over MIDDLE_NODE to END_NODE, keep the error bound; else 0.

    2 where twice as many steps would do.

    The Hermite cubic through the first and the end node misses the middle one by D in time and by E / (4 steps) in
    slope. Its fourth derivative alone makes each of the two D / 16 wrong at most, its fifth E / 26. D / 16 + E / 16 <=
    1/8 tick is asked, which leaves a factor of four for what is not constant about them. The rounding of the third
    difference (see ``put_cubics``) is allowed a tenth of a tick; where groups of 16 steps are possible it is far below.
    """
    # The slopes with one exponent, and log2 of the steps, rounded up
    power = 0
    while (1 << power) < steps:
        power += 1
    exponent = solver[_FIRST_EXPONENT]
    if solver[_MIDDLE_EXPONENT] < exponent:
        exponent = solver[_MIDDLE_EXPONENT]
    if solver[_END_EXPONENT] < exponent:
        exponent = solver[_END_EXPONENT]
    if exponent < power + 6:
        return 0
    start = solver[_FIRST_MANTISSA] >> (solver[_FIRST_EXPONENT] - exponent)
    middle = solver[_MIDDLE_MANTISSA] >> (solver[_MIDDLE_EXPONENT] - exponent)
    end = solver[_END_MANTISSA] >> (solver[_END_EXPONENT] - exponent)
    # The slopes differ by a quarter at most, and by no more than the third difference can hold
    off = start - end
    if off < 0:
        off = 0 - off
    if off > start >> 2:
        return 0
    if 3 * power > exponent + 5 and (exponent < 8 or off > steps << (exponent - 8)):
        return 0
    # steps * slope at the three nodes, in units of the nodes' times
    up = 15 - power
    down = exponent - power - queue[TIME_SCALE]
    start = ((start >> 15) * steps << up) + ((start & _HALF_MASK) * steps >> power)
    middle = ((middle >> 15) * steps << up) + ((middle & _HALF_MASK) * steps >> power)
    end = ((end >> 15) * steps << up) + ((end & _HALF_MASK) * steps >> power)
    middle -= start
    end -= start
    if down >= 0:
        start >>= down
        middle >>= down
        end >>= down
    else:
        down = 0 - down
        start <<= down
        middle <<= down
        end <<= down
    # D and E of the Hermite cubic at the middle node
    first = solver[_MIDDLE_TIME] - solver[_FIRST_TIME] - start
    second = solver[_END_TIME] - solver[_MIDDLE_TIME] - start
    off = 2 * (first - second) + end
    if off < 0:
        off = 0 - off
    first = 4 * middle + end - 3 * (first + second)
    if first < 0:
        first = 0 - first
    off += 4 * first
    limit = 8 << queue[TIME_SCALE]
    if off > limit:
        return 0
    if off <= limit >> 4:
        return 2
    return 1


@micropython.viper
def put_cubics(steps: int, node: ptr32, queue: ptr32, held_back: int) -> object:
    """Put in the ``steps`` from FIRST_NODE (itself already there) to MIDDLE_NODE, and those to END_NODE, which becomes
    the first.

    ``node``: the solver. ``held_back``: 1 where the last of the steps is left out.

    With K = T - N s_a and D = N (s_b - s_a), the Hermite cubic is s_a k + (3 K - D) k**2 / N**2 + (D - 2 K) k**3 /
    N**3: T ticks over N steps, with slopes s_a, s_b at the two nodes.
    Its differences are taken over groups of steps; within a group time grows evenly: groups are as long as
    that is true within 3/32 tick (second derivative times the group squared, over 8). What the third and the
    second difference lose by rounding goes into those below them, so that the cubic it leaves vanishes at both
    ends and in the middle, the square at both ends: at most 0.004 M**3 and 0.06 M**2 units, for M groups.
    """
    scale = queue[TIME_SCALE]
    node = ptr32(int(node) + 4 * _FIRST_NODE)  # then the middle one
    put_in = queue[IN]
    while True:
        item = ptr32(int(queue) + 4 * (_ITEMS + _ITEM_WORDS * (put_in & _ITEMS_MASK)))
        # The slopes with one exponent; D; log2 of the steps, rounded up
        power = 0
        while (1 << power) < steps:
            power += 1
        exponent = node[_NODE_EXPONENT]
        if node[_NEXT_EXPONENT] < exponent:
            exponent = node[_NEXT_EXPONENT]
        shift = exponent - power
        start = node[_NODE_MANTISSA] >> (node[_NODE_EXPONENT] - exponent)
        bend = (node[_NEXT_MANTISSA] >> (node[_NEXT_EXPONENT] - exponent)) - start
        up = 15 - power
        bend = (((bend >> 15) * steps) << up) + (((bend & _HALF_MASK) * steps) >> power)
        # K
        time = node[_NEXT_TIME] - node[_NODE_TIME]
        rest = node[_NODE_TIME] & ((1 << scale) - 1)
        high = shift - scale
        if high >= 0:
            time <<= high
            rest <<= high
        else:
            time >>= 0 - high
            rest >>= 0 - high
        time -= (((start >> 15) * steps) << up) + (((start & _HALF_MASK) * steps) >> power)
        # Hermite: the square and the cubic coefficient (times 6)
        square = 3 * time - bend
        cubic = 6 * (bend - 2 * time)
        # How long a group may be: the second derivative is greatest at an end
        time = 2 * square
        bend = time + cubic
        if time < 0:
            time = 0 - time
        if bend < 0:
            bend = 0 - bend
        if time < bend:
            time = bend
        time = time // steps // steps + 1
        group = 4
        if group > power:
            group = power
        while group and (time << (2 * group)) > (3 << shift) >> 2:
            group -= 1
        # Into units of the differences, with some fraction bits: cubic * 2**(2 group + power) / steps**3
        bits = power
        if bits > 8:
            bits = 8
        up = 2 * group + power + bits
        time = 5
        while time:
            if time == 2:  # and square * 2**(group + power) / steps**2
                third = cubic << up
                cubic = square
                up = group + power + bits
            high = cubic
            if high < 0:
                high = 0 - high
            while up and not high >> 28:
                high += high
                cubic += cubic
                up -= 1
            cubic = cubic // steps
            time -= 1
        # Forward differences, rounded; what the third and the second lose goes into those below
        square = cubic << up
        cubic = third
        half = (1 << bits) >> 1
        groups = steps >> group
        third = (cubic + half) >> bits
        cubic -= third << bits
        square += (cubic * groups) >> 2
        bend = 2 * square + (third << bits)
        second = (bend + half) >> bits
        bend -= second << bits
        square += (third << bits) // 6 - cubic * groups * groups // 12 + ((bend * groups - bend) >> 1)
        # The item
        item[_TIME] = rest + (1 << (shift - 1))
        item[FIRST] = start + ((square + half) >> bits)
        item[SECOND] = second + _BIAS
        item[THIRD] = third + _BIAS
        item[POWER] = power
        item[SHIFT] = shift
        high = queue[_BASE_HIGH] - _HIGH_BIAS
        time = node[_NODE_TIME] >> scale
        item[_BASE] = (high << 12) + time
        item[_REMAINDER] = 0
        item[_LEFT] = 0
        item[CARRY] = power - group
        item[GROUP] = 1 << group
        item[STEPS] = steps
        item[_BASE_KITICKS] = (high << 2) + (time >> 10)
        node = ptr32(int(node) + 4 * _NODE_WORDS)
        put_in = (put_in + 1) & _COUNT_MASK
        if put_in != (queue[IN] + 1) & _COUNT_MASK:
            break
    item[STEPS] = steps - held_back
    queue[LATEST_KITICKS] = (high << 2) + (node[_NODE_TIME] >> (scale + 10))
    queue[IN] = put_in
    # The end node becomes the first
    item = ptr32(int(node) - 4 * 2 * _NODE_WORDS)
    item[_NODE_TIME] = node[_NODE_TIME]
    item[_NODE_MANTISSA] = node[_NODE_MANTISSA]
    item[_NODE_EXPONENT] = node[_NODE_EXPONENT]
    item[_NODE_DELAY] = node[_NODE_DELAY]
    item[_NODE_RATE] = node[_NODE_RATE]
