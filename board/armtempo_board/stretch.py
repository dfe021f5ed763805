"""A stretch: 2**p steps between two nodes, their times by the cubic Hermite polynomial in forward differences.

State, array('i') of 12: what ``emit`` runs on, then what ``differences`` is told.
"""

import micropython
from micropython import const

# running: time since the base, first to third difference over a group, shifts, base time, pulse length
TIME = 0  # ticks * 2**SHIFT
FIRST = 1  # of a group, ticks * 2**(SHIFT + POWER) / steps of a group
SECOND = 2  # the same, + 2**29
THIRD = 3  # the same, + 2**29
POWER = 4  # p
SHIFT = 5
BASE = 6  # ticks, modulo 2**32
PULSE = 7
LEFT = 8  # steps left in the group
GROUP = 9  # steps in a group
STEP = 10  # time of one step of the group, ticks * 2**SHIFT
# told
EXPONENT = 11  # fraction bits of slopes
TIME_SCALE = 12  # fraction bits of the nodes' times
BASE_HIGH = 13  # what the nodes' times count from: 4096 ticks, + 2**28
STATE_SIZE = 14
_BIAS = const(1 << 29)
_HIGH_BIAS = const(1 << 28)


@micropython.viper
def emit(now: int, ring: ptr32, state: ptr32, count: int):
    """Write the rising and falling edges of the next ``count`` steps to ``ring[now]`` and on.

    The compiler keeps the first two arguments in registers: ``now`` becomes the running time, and ``ring`` moves.
    """
    ring = ptr32(int(ring) + 4 * now)
    now = state[0]
    shift = state[5]
    base = state[6]
    pulse = state[7]
    while count > 0:
        left = state[8]
        if left == 0:
            left = state[9]
            first = state[1]
            second = state[2]
            state[10] = first >> state[4]
            state[1] = first + second - _BIAS
            state[2] = second + state[3] - _BIAS
        step = state[10]
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


@micropython.viper
def single(state: ptr32, high: int, ticks: int):
    """Prepare one step at ``high`` (4096 ticks, + 2**28) and ``ticks``."""
    state[0] = 0
    state[1] = 0
    state[2] = _BIAS
    state[3] = _BIAS
    state[4] = 0
    state[5] = 0
    state[6] = ((high - _HIGH_BIAS) << 12) + ticks
    state[8] = 0
    state[9] = 1


@micropython.viper
def elapsed(state: ptr32, ahead: int) -> int:
    """Time since the base of the step written last, or (``ahead`` = 1) of the next one: 1024 ticks."""
    now = state[0]
    if ahead:
        if state[8]:
            now += state[10]
        else:
            now += state[1] >> state[4]
    return now >> (state[5] + 10)


@micropython.viper
def within(state: ptr32, span: int) -> int:
    """About how many of the next steps come before ``span`` (1024 ticks, below 2**20) after the base."""
    step = state[10]
    if state[8] == 0:
        step = state[1] >> state[4]
    shift = state[5]
    span = (span << 10) - ((state[0] + step) >> shift)
    if span < 0:
        return 0
    return span // ((step >> shift) + 1) + 1


@micropython.viper
def deviation(state: ptr32, a: ptr32, middle: ptr32, b: ptr32) -> int:
    """How far the node ``middle`` lies off the Hermite cubic through ``a`` and ``b``: 2**-TIME_SCALE / 2 ticks.

    2**p steps lie between ``a`` and ``middle``, and as many between ``middle`` and ``b``.
    """
    exponent = state[11]
    bend = (a[4] >> (a[5] - exponent)) - (b[4] >> (b[5] - exponent))
    shift = exponent - state[12] - state[4] + 1
    if shift >= 0:
        bend >>= shift
    else:
        bend <<= 0 - shift
    off = 2 * middle[1] - a[1] - b[1] - bend
    if off < 0:
        off = 0 - off
    return off


@micropython.viper
def differences(state: ptr32, a: ptr32, b: ptr32):
    """Prepare the 2**p steps from node ``a`` (itself already written) to node ``b``.

    With K = T - N s_a and D = N (s_b - s_a), the cubic is s_a k + (3 K - D) k**2 / N**2 + (D - 2 K) k**3 / N**3.
    Its differences are taken over groups of steps; within a group time grows evenly: groups are as long as
    that is true within 3/32 tick (second derivative times the group squared, over 8). What the third
    difference loses by rounding goes into the other two, so that the cubic it leaves vanishes at both ends and
    in the middle: at most 0.004 M**3 units, for M groups.
    """
    power = state[4]
    exponent = state[11]
    scale = state[12]
    shift = exponent - power
    start = a[4] >> (a[5] - exponent)
    bend = (b[4] >> (b[5] - exponent)) - start
    time = b[1] - a[1]
    rest = a[1] & ((1 << scale) - 1)
    up = shift - scale
    if up >= 0:
        time <<= up
        rest <<= up
    else:
        time >>= 0 - up
        rest >>= 0 - up
    time -= start
    square = 3 * time - bend
    cubic = bend - 2 * time
    # the second derivative is greatest at an end
    most = 2 * square
    other = most + 6 * cubic
    if most < 0:
        most = 0 - most
    if other < 0:
        other = 0 - other
    if most < other:
        most = other
    group = 4
    if group > power:
        group = power
    while group > 0 and (most >> (2 * (power - group))) > (3 << shift) >> 2:
        group -= 1
    state[8] = 0
    state[9] = 1 << group
    power -= group
    cubic *= 6
    third = cubic
    if power > 0:
        third = (cubic + (1 << (2 * power - 1))) >> (2 * power)
    cubic -= third << (2 * power)
    square = (square >> power) + (cubic >> (power + 2))
    state[0] = rest + (1 << (shift - 1))
    state[1] = start - cubic // 12 + square + third // 6
    state[2] = 2 * square + third + _BIAS
    state[3] = third + _BIAS
    state[5] = shift
    state[6] = ((state[13] - _HIGH_BIAS) << 12) + (a[1] >> scale)
