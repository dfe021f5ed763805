"""A stretch: 2**p steps between two nodes, their times by the cubic Hermite polynomial in forward differences.

State, array('i') of 12: what ``emit`` runs on, then what ``differences`` is told.
"""

import micropython
from micropython import const

# running: time since the base, first to third difference, shifts, base time, pulse length
TIME = 0  # ticks * 2**SHIFT
FIRST = 1  # ticks * 2**(SHIFT + POWER)
SECOND = 2  # the same, + 2**29
THIRD = 3  # the same, + 2**29
POWER = 4  # p
SHIFT = 5
BASE = 6  # ticks, modulo 2**32
PULSE = 7
# told
EXPONENT = 8  # fraction bits of the differences
TIME_SCALE = 9  # fraction bits of the nodes' times
BASE_HIGH = 10  # what the nodes' times count from: 4096 ticks, + 2**28
STATE_SIZE = 11
_BIAS = const(1 << 29)
_HIGH_BIAS = const(1 << 28)


@micropython.viper
def emit(ring: ptr32, state: ptr32, at: int, count: int):
    """Write the rising and falling edges of the next ``count`` steps to ``ring[at]`` and on."""
    acc = state[0]
    first = state[1]
    second = state[2] - _BIAS
    third = state[3] - _BIAS
    power = state[4]
    shift = state[5]
    base = state[6]
    pulse = state[7]
    end = at + count + count
    while at < end:
        acc += first >> power
        first += second
        second += third
        rise = base + (acc >> shift)
        ring[at] = rise
        ring[at + 1] = rise + pulse
        at += 2
    state[0] = acc
    state[1] = first
    state[2] = second + _BIAS
    state[3] = third + _BIAS


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


@micropython.viper
def elapsed(state: ptr32, ahead: int) -> int:
    """Time since the base of the step written last, or (``ahead`` = 1) of the next one: 1024 ticks."""
    acc = state[0]
    if ahead:
        acc += state[1] >> state[4]
    return acc >> (state[5] + 10)


@micropython.viper
def deviation(state: ptr32, a: ptr32, middle: ptr32, b: ptr32) -> int:
    """How far the node ``middle`` lies off the Hermite cubic through ``a`` and ``b``: 2**-TIME_SCALE / 2 ticks.

    2**p steps lie between ``a`` and ``middle``, and as many between ``middle`` and ``b``.
    """
    exponent = state[8]
    bend = (a[4] >> (a[5] - exponent)) - (b[4] >> (b[5] - exponent))
    shift = exponent - state[9] - state[4] + 1
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
    What the third difference loses by rounding goes into the other two, so that the cubic it leaves vanishes
    at both ends and in the middle: at most 0.004 N**3 in units of the differences.
    """
    power = state[4]
    exponent = state[8]
    scale = state[9]
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
    cubic = 6 * (bend - 2 * time)
    third = (cubic + (1 << (2 * power - 1))) >> (2 * power)
    cubic -= third << (2 * power)
    square = ((3 * time - bend) >> power) + (cubic >> (power + 2))
    state[0] = rest + (1 << (shift - 1))
    state[1] = start - cubic // 12 + square + third // 6
    state[2] = 2 * square + third + _BIAS
    state[3] = third + _BIAS
    state[5] = shift
    state[6] = ((state[10] - _HIGH_BIAS) << 12) + (a[1] >> scale)
