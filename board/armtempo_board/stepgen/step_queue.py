"""A stretch: steps between two nodes, their times by the cubic Hermite polynomial in forward differences.

Stretches that are prepared wait in a queue, which ``emit`` empties into a ring. It may be called by an interrupt: only
``emit`` changes OUT and what it runs on, only the others change IN, and a stretch is whole before IN counts it.
"""

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
GROUP = 9  # steps in a group; 0: the times themselves stand in words 0 to 7, LEFT is the place of the next
CARRY = 10  # REST / 2**CARRY is in units of TIME
STEPS = 11  # steps of the stretch not written yet
_BASE_1024 = const(12)  # base in 1024 ticks
UNTIL_1024 = 13  # steps after it are not written
# what the stretch is made from
TIME_SCALE = 14  # fraction bits of the nodes' times
BASE_HIGH = 15  # what the nodes' times count from: 4096 ticks, + 2**28
_STEP = const(16)  # time of one step of the group, ticks * 2**SHIFT
PULSE = 17  # ticks
HEAD = 18  # entry to be written next; not masked
_ROOM = const(19)  # entries that may be written
# the queue: stretches that were put in and taken out, modulo 2**16
IN = 20
OUT = 21
LATEST_1024 = 22  # time of the last step put in, 1024 ticks
# the cell that is gone through (see traverse.py)
AT = 23  # step reached in it
LAST = 24  # its last one
SIZE = 25  # steps of a stretch that were possible
SLOW = 26  # ticks: a last step that takes longer is held back
HIGH = 27  # what the cell's times count from: 4096 ticks, + 2**28
MODE = 28
SINGLY = 29  # steps to be solved one by one before a stretch is tried
HELD = 30
ENDED = 31
_QUEUE = const(32)  # eight times words 0 to 12
QUEUE_ROOM = 8
STATE_SIZE = 32 + 13 * 8

_BIAS = const(1 << 29)
_HIGH_BIAS = const(1 << 28)
_LOW = const((1 << 15) - 1)
_LONG = const(1 << 19)  # 1024 ticks: longer than any stretch


@micropython.viper
def emit(now: int, ring: ptr32, state: ptr32, mask: int) -> object:
    """Write edges of the stretches in the queue to the ring, up to UNTIL_1024 and as many as ``now`` says.

    The compiler keeps the first two arguments in registers: ``now`` becomes the running time, and ``ring`` moves.
    """
    start = int(ring)
    pulse = state[17]
    state[19] = now
    while True:
        if state[19] < 2:
            break
        if not state[11]:
            count = state[21]
            if count == state[20]:
                break
            ring = ptr32(int(state) + 4 * (32 + 13 * (count & 7)))
            n = 0
            while n < 13:
                state[n] = ring[n]
                n += 1
            state[21] = (count + 1) & 0xFFFF
        at = state[18] & mask
        if not state[9]:
            now = state[state[8]]
            if state[12] + (((now - state[0]) >> 10) & 0x3FFFFF) > state[13]:
                break
            ring = ptr32(start + 4 * at)
            ring[0] = now
            ring[1] = now + pulse
            state[8] = state[8] + 1
            state[11] = state[11] - 1
            state[18] = state[18] + 2
            state[19] = state[19] - 2
            continue
        now = state[0]
        shift = state[5]
        count = (mask + 1 - at) >> 1
        n = state[19] >> 1
        if count > n:
            count = n
        if count > state[11]:
            count = state[11]
        n = state[13] - state[12]
        if n < _LONG:
            step = state[16]
            if not state[8]:
                step = state[1] >> state[4]
            n = (n << 10) - ((now + step) >> shift)
            if n < 0:
                break
            n = n // ((step >> shift) + 1) + 1
            if count > n:
                count = n
        if not count:
            break
        state[11] = state[11] - count
        state[18] = state[18] + count + count
        state[19] = state[19] - count - count
        ring = ptr32(start + 4 * at)
        base = state[6]
        # in locals, which are quicker to come by
        first = state[1]
        second = state[2] - _BIAS
        third = state[3] - _BIAS
        power = state[4]
        rest = state[7]
        left = state[8]
        carry = state[10]
        step = state[16]
        while count:
            if not left:
                left = state[9]
                step = first >> power
                rest += first - (step << power)
                n = rest >> carry
                rest -= n << carry
                now += n
                first += second
                second += third
            n = count
            if n > left:
                n = left
            left -= n
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
            if n > 1:
                now = now + step
                ring[0] = (now >> shift) + base
                ring[1] = ring[0] + pulse
                now = now + step
                ring[2] = (now >> shift) + base
                ring[3] = ring[2] + pulse
                ring = ptr32(int(ring) + 16)
                n -= 2
            if n:
                now = now + step
                ring[0] = (now >> shift) + base
                ring[1] = ring[0] + pulse
                ring = ptr32(int(ring) + 8)
        state[0] = now
        state[1] = first
        state[2] = second + _BIAS
        state[7] = rest
        state[8] = left
        state[16] = step


@micropython.viper
def single(state: ptr32, high: int, ticks: int) -> object:
    """Put one step at ``high`` (4096 ticks, + 2**28) and ``ticks`` into the queue."""
    given = state[20]
    out = ptr32(int(state) + 4 * (32 + 13 * (given & 7)))
    high -= _HIGH_BIAS
    out[0] = (high << 12) + ticks
    out[8] = 0
    out[9] = 0
    out[11] = 1
    high = (high << 2) + (ticks >> 10)
    out[12] = high
    state[22] = high
    state[20] = (given + 1) & 0xFFFF


@micropython.viper
def wanted(state: ptr32) -> int:
    """1 where the queue has room for two stretches and does not go on beyond UNTIL_1024."""
    return 1 if ((state[20] - state[21]) & 0xFFFF) < 7 and state[22] <= state[13] else 0


@micropython.viper
def waiting(state: ptr32) -> int:
    """1 while steps in the queue have not been written."""
    return 1 if state[11] or state[20] != state[21] else 0


@micropython.viper
def upcoming(state: ptr32) -> int:
    """Time of the next step in the queue, or of the one before it; 1024 ticks. -1: there is none."""
    if state[11]:
        now = state[0]
        if not state[9]:
            return state[12] + (((state[state[8]] - now) >> 10) & 0x3FFFFF)
        if state[8]:
            now += state[16]
        else:
            now += state[1] >> state[4]
        return state[12] + (now >> (state[5] + 10))
    if state[20] == state[21]:
        return -1
    return state[32 + 13 * (state[21] & 7) + 12]


@micropython.viper
def withdraw(state: ptr32, first: int, from_1024: int) -> int:
    """Take out the last stretches down to one that begins before a time; ``emit`` must not run meanwhile.

    None goes that was put in before the ``first``. Returns their steps that were not written.
    """
    steps = 0
    given = state[20]
    while given != first:
        if given == state[21]:
            steps += state[11]
            state[11] = 0
            break
        given = (given - 1) & 0xFFFF
        place = 32 + 13 * (given & 7)
        steps += state[place + 11]
        if state[place + 12] < from_1024:
            break
    state[20] = given
    state[22] = 0
    return steps


@micropython.viper
def accept(steps: int, block: ptr32, state: ptr32) -> int:
    """1 where two stretches of ``steps`` each, from node A over MIDDLE to B, keep the error bound; else 0.

    2 where twice as many steps would do.

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
def differences(steps: int, block: ptr32, state: ptr32, held: int) -> object:
    """Queue the ``steps`` from node A (itself already there) to MIDDLE, and those to B, which becomes A.

    ``held``: 1 where the last of them is left out.

    With K = T - N s_a and D = N (s_b - s_a), the cubic is s_a k + (3 K - D) k**2 / N**2 + (D - 2 K) k**3 / N**3.
    Its differences are taken over groups of steps; within a group time grows evenly: groups are as long as
    that is true within 3/32 tick (second derivative times the group squared, over 8). What the third and the
    second difference lose by rounding goes into those below them, so that the cubic it leaves vanishes at both
    ends and in the middle, the square at both ends: at most 0.004 M**3 and 0.06 M**2 units, for M groups.
    """
    scale = state[14]
    block = ptr32(int(block) + 112)  # node A, later MIDDLE and B
    given = state[20]
    while True:
        out = ptr32(int(state) + 4 * (32 + 13 * (given & 7)))
        power = 0
        while (1 << power) < steps:
            power += 1
        exponent = block[2]
        if block[10] < exponent:
            exponent = block[10]
        shift = exponent - power
        start = block[1] >> (block[2] - exponent)
        bend = (block[9] >> (block[10] - exponent)) - start
        up = 15 - power
        bend = (((bend >> 15) * steps) << up) + (((bend & _LOW) * steps) >> power)
        time = block[8] - block[0]
        rest = block[0] & ((1 << scale) - 1)
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
        while group and (time << (2 * group)) > (3 << shift) >> 2:
            group -= 1
        # in units of the differences, with some fraction bits: cubic * 2**(2 group + power) / steps**3
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
        out[0] = rest + (1 << (shift - 1))
        out[1] = start + ((square + half) >> bits)
        out[2] = second + _BIAS
        out[3] = third + _BIAS
        out[4] = power
        out[5] = shift
        high = state[15] - _HIGH_BIAS
        time = block[0] >> scale
        out[6] = (high << 12) + time
        out[7] = 0
        out[8] = 0
        out[10] = power - group
        out[9] = 1 << group
        out[11] = steps
        out[12] = (high << 2) + (time >> 10)
        block = ptr32(int(block) + 32)
        given = (given + 1) & 0xFFFF
        if given != (state[20] + 1) & 0xFFFF:
            break
    out[11] = steps - held
    state[22] = (high << 2) + (block[0] >> (scale + 10))
    state[20] = given
    out = ptr32(int(block) - 64)
    out[0] = block[0]
    out[1] = block[1]
    out[2] = block[2]
    out[3] = block[3]
    out[4] = block[4]
