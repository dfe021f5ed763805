"""Cubics: the times of up to 1024 steps between two nodes, by the cubic Hermite polynomial through them.

Here are their error bound, and the forward differences that go into the queue.
"""

import micropython
from micropython import const

# as in step_queue.py: words of the queue, and of an item
_TIME = const(0)
_FIRST = const(1)
_SECOND = const(2)
_THIRD = const(3)
_POWER = const(4)
_SHIFT = const(5)
_BASE = const(6)
_REMAINDER = const(7)
_LEFT = const(8)
_GROUP = const(9)
_BASE_KITICKS = const(10)
_STEPS = const(11)
_ITEM_WORDS = const(12)
_TIME_SCALE = const(14)
_BASE_HIGH = const(15)
_IN = const(20)
_LATEST_KITICKS = const(22)
_ITEMS = const(32)
_ITEMS_MASK = const(15)
_COUNT_MASK = const(0xFFFF)
_BIAS = const(1 << 29)
_HIGH_BIAS = const(1 << 28)
# as in newton.py: words of the solver
_FIRST_NODE = const(28)
_FIRST_TIME = const(28)  # = FIRST_NODE + NODE_TIME
_FIRST_MANTISSA = const(29)  # = FIRST_NODE + NODE_MANTISSA
_FIRST_EXPONENT = const(30)  # = FIRST_NODE + NODE_EXPONENT
_MIDDLE_TIME = const(33)  # = MIDDLE_NODE + NODE_TIME
_MIDDLE_MANTISSA = const(34)  # = MIDDLE_NODE + NODE_MANTISSA
_MIDDLE_EXPONENT = const(35)  # = MIDDLE_NODE + NODE_EXPONENT
_END_TIME = const(38)  # = END_NODE + NODE_TIME
_END_MANTISSA = const(39)  # = END_NODE + NODE_MANTISSA
_END_EXPONENT = const(40)  # = END_NODE + NODE_EXPONENT
# of two neighbouring nodes
_NODE_TIME = const(0)
_NODE_MANTISSA = const(1)
_NODE_EXPONENT = const(2)
_NODE_DELAY = const(3)
_NODE_RATE = const(4)
_NEXT_TIME = const(5)  # = NODE_WORDS + NODE_TIME
_NEXT_MANTISSA = const(6)  # = NODE_WORDS + NODE_MANTISSA
_NEXT_EXPONENT = const(7)  # = NODE_WORDS + NODE_EXPONENT
_NODE_WORDS = const(5)

_HALF_MASK = const((1 << 15) - 1)
_MANY = const(5)  # log2 of steps that are many
_SQUARE = const(8)
# log2 of the steps in a group, if it is more than one step
_SHORTEST_GROUP = const(3)
_LONGEST_GROUP = const(4)


@micropython.viper
def cubics_fit(steps: int, solver: ptr32, queue: ptr32, slack: int) -> int:
    """Above 0 if two cubics of ``steps`` each, from FIRST_NODE over MIDDLE_NODE to END_NODE, keep the error bound.

    Then the next ones may have that many eighths of these steps, as the error grows with their fourth power.

    The Hermite cubic through the first and the end node misses the middle one by D in time and by E / (4 steps) in
    slope. Its fourth derivative alone makes each of the two D / 16 wrong at most, its fifth E / 26. D / 16 + E / 16 <=
    1/8 tick is asked, 2**``slack`` times that by a law of time; that leaves a factor of four for what is not constant
    about them. The rounding of the third difference (see ``put_cubics``), in groups of G steps 0.004 steps**3 / G**2
    units, is allowed an eighth of a tick.
    """
    # Log2 of the steps, rounded up, and the slopes with one exponent
    power = 0
    if steps > 1 << _MANY:
        power = _MANY
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
    # The slopes differ by a quarter at most
    off = start - end
    if off < 0:
        off = 0 - off
    if off > start >> 2:
        return 0
    # and groups can be long enough for the third difference: of steps whose lengths change evenly, or of one length
    group = (3 * power - exponent - 4) >> 1
    if group > 0:
        if group < _SHORTEST_GROUP:
            group = _SHORTEST_GROUP
        if group > _LONGEST_GROUP or 2 * group > exponent - power:
            return 0
    # steps * slope at the three nodes, in units of the nodes' times
    up = 15 - power
    down = exponent - power - queue[_TIME_SCALE]
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
    if group > 0:
        power = middle - 2 * first
        if power < 0:
            power = 0 - power
        off = middle + end - 2 * second
        if off < 0:
            off = 0 - off
        if off < power:
            off = power
        group = steps >> group
        if off >> queue[_TIME_SCALE] > group * group * group:
            return 0
    off = 2 * (first - second) + end
    if off < 0:
        off = 0 - off
    first = 4 * middle + end - 3 * (first + second)
    if first < 0:
        first = 0 - first
    off += 4 * first
    limit = 8 << slack << queue[_TIME_SCALE]
    if off > limit:
        return -1 if off >> 2 <= limit else -2
    if off <= limit >> 4:
        return 16
    if 5 * off <= limit:
        return 12
    if 5 * off <= 2 * limit:
        return 10
    return 7 if 4 * off > 3 * limit else 8


@micropython.viper
def put_cubics(steps: int, node: ptr32, queue: ptr32, held_back: int) -> object:
    """Put in the ``steps`` from FIRST_NODE (itself already there) to MIDDLE_NODE, and those to END_NODE, which becomes
    the first.

    ``node``: the solver. ``held_back``: 1 if the last of the steps is left out.

    With K = T - N s_a and D = N (s_b - s_a), the Hermite cubic is s_a k + (3 K - D) k**2 / N**2 + (D - 2 K) k**3 /
    N**3: T ticks over N steps, with slopes s_a, s_b at the two nodes.
    Its differences are taken over groups of G steps. Within a group time grows evenly if that is true within 3/32
    tick (second derivative times G**2 / 8) for eight steps or more; else as a square, if that is true within 1/16 tick
    (third derivative times G**3 / 125) for that many, and its rounding of G**2 / 16 units of time within another 1/16.
    What the third and the second difference lose by rounding goes into those below them, so that the cubic it leaves
    vanishes at both ends and in the middle, the square at both ends: at most 0.004 M**3 and 0.06 M**2 units, for M
    groups.
    """
    scale = queue[_TIME_SCALE]
    node = ptr32(int(node) + 4 * _FIRST_NODE)  # then the middle one
    put_in = queue[_IN]
    # Log2 of the steps, rounded up, and 2**(power + 29) / steps by long division with 15-bit digits
    power = 0
    if steps > 1 << _MANY:
        power = _MANY
    while (1 << power) < steps:
        power += 1
    high = (1 << 14) << power
    over_high = high // steps
    over_low = ((high - over_high * steps) << 15) // steps
    bits = power
    if bits > 8:
        bits = 8
    while True:
        item = ptr32(int(queue) + 4 * (_ITEMS + _ITEM_WORDS * (put_in & _ITEMS_MASK)))
        # The slopes with one exponent; D
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
        # How long a group of steps of one length may be: the second derivative is greatest at an end
        time = 2 * square
        bend = time + cubic
        if time < 0:
            time = 0 - time
        if bend < 0:
            bend = 0 - bend
        if time < bend:
            time = bend
        time = (3 << shift >> 2) // (time // steps // steps + 1)
        high = _LONGEST_GROUP
        if high > power:
            high = power
        group = 0
        while time > 3 and group < high:
            time >>= 2
            group += 1
        # and one of steps whose lengths change evenly
        kind = 1
        if group < _SHORTEST_GROUP or group < (2 * power - shift - 4) >> 1:
            group = 0
            if high > shift >> 1:
                high = shift >> 1
            bend = cubic
            if bend < 0:
                bend = 0 - bend
            while high >= _SHORTEST_GROUP:
                time = steps >> high
                if bend >> shift <= 7 * time * time * time:
                    group = high
                    kind += _SQUARE
                    break
                high -= 1
        # Into units of the differences, with some fraction bits: cubic * 2**(2 group + power) / steps**3
        up = 2 * group + bits + 3 - 2 * power
        factors = 3
        while True:
            high = cubic
            if high < 0:
                high = 0 - high
            if high:
                while not high >> 24:
                    high <<= 4
                    cubic <<= 4
                    up -= 4
            time = factors
            while time:
                high = cubic >> 15
                cubic = (
                    high * over_high + (((cubic & _HALF_MASK) * over_high) >> 15) + ((high * over_low) >> 15)
                )
                time -= 1
            if up >= 0:
                cubic <<= up
            else:
                cubic >>= 0 - up
            if factors < 3:
                break
            # and square * 2**(group + power) / steps**2
            third = cubic
            cubic = square
            up = group + bits + 2 - power
            factors = 2
        # Forward differences, rounded; what the third and the second lose goes into those below
        square = cubic
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
        item[_FIRST] = start + ((square + half) >> bits)
        item[_SECOND] = second + _BIAS
        item[_THIRD] = third + _BIAS
        item[_POWER] = power
        item[_SHIFT] = shift
        high = queue[_BASE_HIGH] - _HIGH_BIAS
        time = node[_NODE_TIME] >> scale
        item[_BASE] = (high << 12) + time
        item[_REMAINDER] = 0
        item[_LEFT] = 0
        item[_GROUP] = group + kind
        item[_STEPS] = steps
        item[_BASE_KITICKS] = (high << 2) + (time >> 10)
        node = ptr32(int(node) + 4 * _NODE_WORDS)
        put_in = (put_in + 1) & _COUNT_MASK
        if put_in != (queue[_IN] + 1) & _COUNT_MASK:
            break
    item[_STEPS] = steps - held_back
    queue[_LATEST_KITICKS] = (high << 2) + (node[_NODE_TIME] >> (scale + 10))
    queue[_IN] = put_in
    # The end node becomes the first
    item = ptr32(int(node) - 4 * 2 * _NODE_WORDS)
    item[_NODE_TIME] = node[_NODE_TIME]
    item[_NODE_MANTISSA] = node[_NODE_MANTISSA]
    item[_NODE_EXPONENT] = node[_NODE_EXPONENT]
    item[_NODE_DELAY] = node[_NODE_DELAY]
    item[_NODE_RATE] = node[_NODE_RATE]
