"""A stretch: steps between two nodes, their times by the cubic Hermite polynomial in forward differences."""

import micropython
from micropython import const

# state: what ``emit`` runs on
_TIME = const(0)  # since the base, ticks * 2**SHIFT
FIRST = 1  # first difference over a group, ticks * 2**(SHIFT + POWER) / steps of a group
SECOND = 2  # the second, + 2**29
THIRD = 3  # the third, + 2**29
POWER = 4
SHIFT = 5
_BASE = const(6)  # ticks, modulo 2**32
_REST = const(7)  # of the time of a group what its steps have left over
_LEFT = const(8)  # steps left in the group
GROUP = 9  # steps in a group
CARRY = 10  # REST / 2**CARRY is in units of TIME
STEPS = 11  # steps of the stretch not written yet
BASE_1024 = 12  # base in 1024 ticks
UNTIL_1024 = 13  # steps after it are not written
# what the stretch is made from
TIME_SCALE = 14  # fraction bits of the nodes' times
BASE_HIGH = 15  # what the nodes' times count from: 4096 ticks, + 2**28
# the stretch behind it: its words 0 to 12
NEXT = 16
NEXT_STEPS = 27
PULSE = 29  # ticks
_STEP = const(30)  # time of one step of the group, ticks * 2**SHIFT
LAST_1024 = 31  # time of the step written last, 1024 ticks
# what ``emit`` is told
HEAD = 32  # entry to be written next; not masked
ROOM = 33  # entries that may be written
STATE_SIZE = 34

REJECTED = 0
ACCEPTED = 1
EASY = 2  # twice as many steps would do

_BIAS = const(1 << 29)
_HIGH_BIAS = const(1 << 28)
_LOW = const((1 << 15) - 1)
_LONG = const(1 << 19)  # 1024 ticks: longer than any stretch


@micropython.viper
def emit(now: int, ring: ptr32, state: ptr32, mask: int) -> int:
    """Write edges of the prepared stretches to the ring; 1 where it could go on if there were more of them.

    The compiler keeps the first two arguments in registers: ``now`` becomes the running time, and ``ring`` moves.
    """
    start = int(ring)
    pulse = state[29]
    while True:
        if state[33] < 2:
            return 0
        if state[11] == 0:
            if state[27] == 0:
                return 1
            n = 0
            while n < 13:
                state[n] = state[n + 16]
                n += 1
            state[27] = 0
        now = state[0]
        shift = state[5]
        at = state[32] & mask
        count = (mask + 1 - at) >> 1
        n = state[33] >> 1
        if count > n:
            count = n
        if count > state[11]:
            count = state[11]
        n = state[13] - state[12]
        if n < _LONG:
            step = state[30]
            if state[8] == 0:
                step = state[1] >> state[4]
            n = (n << 10) - ((now + step) >> shift)
            if n < 0:
                return 0
            n = n // ((step >> shift) + 1) + 1
            if count > n:
                count = n
        if count == 0:
            return 0
        state[11] = state[11] - count
        state[32] = state[32] + count + count
        state[33] = state[33] - count - count
        ring = ptr32(start + 4 * at)
        base = state[6]
        while count > 0:
            left = state[8]
            if left == 0:
                left = state[9]
                first = state[1]
                second = state[2]
                step = first >> state[4]
                state[30] = step
                n = state[7] + first - (step << state[4])
                now += n >> state[10]
                state[7] = n & ((1 << state[10]) - 1)
                state[1] = first + second - _BIAS
                state[2] = second + state[3] - _BIAS
            step = state[30]
            n = count
            if n > left:
                n = left
            state[8] = left - n
            count -= n
            while n >= 4:
                now = now + step
                ring[0] = (now >> shift) + base
                ring[1] = ring[0] + pulse
                now = now + step
                ring[2] = (now >> shift) + base
                ring[3] = ring[2] + pulse
                now = now + step
                ring[4] = (now >> shift) + base
                ring[5] = ring[4] + pulse
                now = now + step
                ring[6] = (now >> shift) + base
                ring[7] = ring[6] + pulse
                ring = ptr32(int(ring) + 32)
                n -= 4
            while n > 0:
                now = now + step
                ring[0] = (now >> shift) + base
                ring[1] = ring[0] + pulse
                ring = ptr32(int(ring) + 8)
                n -= 1
        state[0] = now
        state[31] = state[12] + (now >> (shift + 10))


@micropython.viper
def single(state: ptr32, to: int, high: int, ticks: int) -> object:
    """Prepare one step at ``high`` (4096 ticks, + 2**28) and ``ticks``: as the stretch at ``state[to]``, 0 or NEXT."""
    out = ptr32(int(state) + 4 * to)
    out[0] = 0
    out[1] = 0
    out[2] = _BIAS
    out[3] = _BIAS
    out[4] = 0
    out[5] = 0
    high -= _HIGH_BIAS
    out[6] = (high << 12) + ticks
    out[7] = 0
    out[8] = 0
    out[9] = 1
    out[10] = 0
    out[11] = 1
    out[12] = (high << 2) + (ticks >> 10)


@micropython.viper
def upcoming(state: ptr32) -> int:
    """Time of the next step of the stretch, in 1024 ticks."""
    now = state[0]
    if state[8]:
        now += state[30]
    else:
        now += state[1] >> state[4]
    return state[12] + (now >> (state[5] + 10))


@micropython.viper
def accept(state: ptr32, block: ptr32, steps: int) -> int:
    """Whether two stretches of ``steps`` each, from node A over MIDDLE to B, keep the error bound.

    The Hermite cubic through A and B misses MIDDLE by D in time and by E / (4 steps) in slope. Its fourth derivative
    alone makes each stretch D / 16 wrong at most, its fifth E / 26: D / 16 + E / 16 <= 1/8 tick is asked, which
    leaves a factor of four for what is not constant about them. The rounding of the third difference (see
    ``differences``) is allowed a tenth of a tick; where groups of 16 steps are possible it is far below that.
    """
    power = 0
    while (1 << power) < steps:
        power += 1
    exponent = block[30]
    if block[38] < exponent:
        exponent = block[38]
    if block[46] < exponent:
        exponent = block[46]
    if exponent < power + 6:
        return 0
    start = block[29] >> (block[30] - exponent)
    slope = block[37] >> (block[38] - exponent)
    end = block[45] >> (block[46] - exponent)
    off = start - end
    if off < 0:
        off = 0 - off
    if off > start >> 2:
        return 0
    if 3 * power > exponent + 5 and (exponent < 8 or off > steps << (exponent - 8)):
        return 0
    # steps * slope at the three, in the nodes' units
    up = 15 - power
    down = exponent - power - state[14]
    start = ((start >> 15) * steps << up) + ((start & _LOW) * steps >> power)
    slope = ((slope >> 15) * steps << up) + ((slope & _LOW) * steps >> power)
    end = ((end >> 15) * steps << up) + ((end & _LOW) * steps >> power)
    slope -= start
    end -= start
    if down >= 0:
        start >>= down
        slope >>= down
        end >>= down
    else:
        down = 0 - down
        start <<= down
        slope <<= down
        end <<= down
    first = block[36] - block[28] - start
    second = block[44] - block[36] - start
    off = 2 * (first - second) + end
    if off < 0:
        off = 0 - off
    first = 4 * slope + end - 3 * (first + second)
    if first < 0:
        first = 0 - first
    off += 4 * first
    limit = 8 << state[14]
    if off > limit:
        return 0
    if off <= limit >> 4:
        return 2
    return 1


@micropython.viper
def differences(state: ptr32, block: ptr32, steps: int) -> object:
    """Prepare the ``steps`` from node A (itself already written) to MIDDLE, and those to B, which becomes A.

    With K = T - N s_a and D = N (s_b - s_a), the cubic is s_a k + (3 K - D) k**2 / N**2 + (D - 2 K) k**3 / N**3.
    Its differences are taken over groups of steps; within a group time grows evenly: groups are as long as
    that is true within 3/32 tick (second derivative times the group squared, over 8). What the third and the
    second difference lose by rounding goes into those below them, so that the cubic it leaves vanishes at both
    ends and in the middle, the square at both ends: at most 0.004 M**3 and 0.06 M**2 units, for M groups.
    """
    scale = state[14]
    a = ptr32(int(block) + 112)
    out = state
    while True:
        power = 0
        while (1 << power) < steps:
            power += 1
        exponent = a[2]
        if a[10] < exponent:
            exponent = a[10]
        shift = exponent - power
        start = a[1] >> (a[2] - exponent)
        bend = (a[9] >> (a[10] - exponent)) - start
        up = 15 - power
        bend = (((bend >> 15) * steps) << up) + (((bend & _LOW) * steps) >> power)
        time = a[8] - a[0]
        rest = a[0] & ((1 << scale) - 1)
        high = shift - scale
        if high >= 0:
            time <<= high
            rest <<= high
        else:
            time >>= 0 - high
            rest >>= 0 - high
        time -= (((start >> 15) * steps) << up) + (((start & _LOW) * steps) >> power)
        square = 3 * time - bend
        cubic = 6 * (bend - 2 * time)
        # the second derivative is greatest at an end
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
        while group > 0 and (time << (2 * group)) > (3 << shift) >> 2:
            group -= 1
        # in units of the differences, with some fraction bits: cubic * 2**(2 group + power) / steps**3
        bits = power
        if bits > 8:
            bits = 8
        up = 2 * group + power + bits
        time = 0
        while time < 3:
            more = 16
            while more > 0:
                high = 1 << (29 - more)
                if up >= more and cubic < high and cubic > 0 - high:
                    cubic <<= more
                    up -= more
                more >>= 1
            cubic = cubic // steps
            time += 1
        cubic <<= up
        # and square * 2**(group + power) / steps**2
        up = group + power + bits
        time = 0
        while time < 2:
            more = 16
            while more > 0:
                high = 1 << (29 - more)
                if up >= more and square < high and square > 0 - high:
                    square <<= more
                    up -= more
                more >>= 1
            square = square // steps
            time += 1
        square <<= up
        half = (1 << bits) >> 1
        groups = steps >> group
        third = (cubic + half) >> bits
        cubic -= third << bits
        square += (cubic * groups) >> 2
        bend = 2 * square + (third << bits)
        second = (bend + half) >> bits
        bend -= second << bits
        square += (third << bits) // 6 - cubic * groups * groups // 12 + ((bend * groups - bend) >> 1)
        out[0] = rest + (1 << (shift - 1))
        out[1] = start + ((square + half) >> bits)
        out[2] = second + _BIAS
        out[3] = third + _BIAS
        out[4] = power
        out[5] = shift
        high = state[15] - _HIGH_BIAS
        time = a[0] >> scale
        out[6] = (high << 12) + time
        out[7] = 0
        out[8] = 0
        out[10] = power - group
        out[9] = 1 << group
        out[11] = steps
        out[12] = (high << 2) + (time >> 10)
        a = ptr32(int(a) + 32)
        if int(out) != int(state):
            break
        out = ptr32(int(state) + 64)
    power = 0
    while power < 5:
        block[28 + power] = block[44 + power]
        power += 1
