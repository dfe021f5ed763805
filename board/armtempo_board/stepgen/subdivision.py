"""Subdivision of a joint's motion: halves the Bezier pieces of time and angle, measures both, and judges the result.

The subintervals are those of a binary tree over a time segment; a node's number is 2**level + index. An array of pieces
has six places of 13 words: the piece that is looked at, four right halves by their level modulo 4, and the root. A
right half comes with the left one and is kept, as it is the next to be looked at or halved. The last word of a place
holds the node's number. A right half that was kept in an earlier segment is never taken for one of this segment: before
it is looked for, its parent has been halved in this segment, which has overwritten the old one.

A piece is measured in block floating point: differences of neighbouring points as single words, with a scale of their
own. Signed values in arrays are stored with a bias, see bezier.py.
"""

import micropython
from micropython import const

# measures of a piece
SCALE = const(0)  # fraction bits f of the differences, in 2**-f high units; 0: the piece is too large
FIRST_DIFFERENCE = const(1)  # the first of five differences of neighbouring points, + DIFFERENCE_BIAS,
LAST_DIFFERENCE = const(5)  # and the last
LEAST = const(6)  # least and greatest of these
MOST = const(7)
# least and greatest position (high + BIAS of the points, rounded) in the hull, if that was looked at
LOWEST = const(8)
HIGHEST = const(9)
# the state of the walk through the tree: with the measures of time
MOVE = const(10)  # what is done before the next subinterval is looked at
NODE = const(11)
# with those of angle
LEVEL = const(10)
MEASURES_SIZE = const(12)
DIFFERENCE_BIAS = 1 << 29

# words of an array of pieces
PLACE_WORDS = const(13)
_PLACE_NODE = const(12)  # after the piece
ROOT = const(65)
PIECES_SIZE = const(78)

# moves
STAY = const(0)
SKIP = const(1)  # continue after the subinterval, with one twice as long if the grid allows it
SPLIT = const(2)  # continue with its first half

# results of a search
NOT_YET = const(0)  # no step so far: continue
MONOTONE = const(1)  # steps in it, all in one direction
AT_START = const(2)  # steps, all of them at its start
END = const(3)

# results of a measurement. Steady: the differences have one sign and are within a factor of two
MEASURED = const(1)
ANGLE_STEADY = const(2)
TIME_STEADY = const(8)  # and they are positive

# as in bezier.py: words of a piece, six high and six low ones; a pointer to a point finds its two and those of the next
_HIGH_0 = const(0)  # = HIGH + 0
_HIGH_1 = const(1)  # = HIGH + 1
_HIGH_2 = const(2)  # = HIGH + 2
_HIGH_3 = const(3)  # = HIGH + 3
_HIGH_4 = const(4)  # = HIGH + 4
_HIGH_5 = const(5)  # = HIGH + 5
_LOW_0 = const(6)  # = LOW + 0
_LOW_1 = const(7)  # = LOW + 1
_LOW_2 = const(8)  # = LOW + 2
_LOW_3 = const(9)  # = LOW + 3
_LOW_4 = const(10)  # = LOW + 4
_LOW_5 = const(11)  # = LOW + 5
_HIGH = const(0)
_NEXT_HIGH = const(1)  # = HIGH + 1
_LAST_HIGH = const(5)
_LOW = const(6)
_NEXT_LOW = const(7)  # = LOW + 1
_LAST_LOW = const(11)

_BIAS = const(1 << 29)
_WORK = const(12)  # for one call: a subinterval is 2, halving its pieces once 2 more
_LEAST_SCALE = const(13)  # of any piece
_LEAST_TIME_SCALE = const(17)  # of a subinterval that is solved: 2**23 ticks fill 28 bits
_TOO_LONG = const(29)  # above every scale: the angle of a subinterval that is too long does not matter
_DEEPEST = const(27)
_SHORTEST_TICKS = const(2)


@micropython.viper
def search(
    piece: ptr32, point: ptr32, measures: ptr32, other_measures: ptr32, position: int, min_ticks: int
) -> int:
    """Look at subintervals until one holds steps, or it is enough for one call. Gives one of the results above.

    ``piece`` and ``measures``: those of time; ``point`` and ``other_measures``: pieces and measures of angle.
    ``position`` (+ bezier.BIAS): where the steps so far lead; 0: only measure the next subinterval, and give 4 times
    the results of that. ``min_ticks``: see ``Subintervals``.
    """
    other = point
    node = measures[NODE]
    level = other_measures[LEVEL]
    move = measures[MOVE]
    work = _WORK
    found = NOT_YET
    while work > 0:
        work -= 2
        # The next subinterval in the tree, and the nearest one above it whose piece is kept
        halvings = move >> 1  # from that piece down to the subinterval
        source = 0  # where the piece is, in bytes
        if halvings:  # split: it is the one that was looked at
            node <<= 1
            level += 1
        else:
            if move:
                node += 1
                if node >> level == 2:
                    node >>= 1
                    move = STAY
                    found = END
                    break
                if not node & 1:
                    node >>= 1
                    level -= 1
            while halvings < level:
                source = (((level - halvings) & 3) + 1) * (4 * PLACE_WORDS)
                point = ptr32(int(piece) + source)
                if point[_PLACE_NODE] == node >> halvings:
                    break
                halvings += 1
            else:
                source = 4 * ROOT
        least_scale = _LEAST_TIME_SCALE if position else _LEAST_SCALE
        steady = 0
        passes = 2
        while passes:  # time, then angle
            # Bezier subdivision: copy the kept piece, halve it down to the subinterval
            point = ptr32(int(piece) + source)
            is_copied = source
            left = halvings
            while True:
                if is_copied:
                    piece[_HIGH_0] = point[_HIGH_0]
                    piece[_HIGH_1] = point[_HIGH_1]
                    piece[_HIGH_2] = point[_HIGH_2]
                    piece[_HIGH_3] = point[_HIGH_3]
                    piece[_HIGH_4] = point[_HIGH_4]
                    piece[_HIGH_5] = point[_HIGH_5]
                    piece[_LOW_0] = point[_LOW_0]
                    piece[_LOW_1] = point[_LOW_1]
                    piece[_LOW_2] = point[_LOW_2]
                    piece[_LOW_3] = point[_LOW_3]
                    piece[_LOW_4] = point[_LOW_4]
                    piece[_LOW_5] = point[_LOW_5]
                if not left:
                    break
                # de Casteljau at 1/2: the left half stays in place; points of the right half come out at its end
                left -= 1
                work -= 1
                kept = ptr32(int(piece) + (((level - left) & 3) + 1) * (4 * PLACE_WORDS))
                i = node >> left
                is_copied = i & 1
                kept[_PLACE_NODE] = i | 1
                i = _LAST_HIGH
                while True:
                    kept[_LAST_HIGH] = piece[_LAST_HIGH]
                    kept[_LAST_LOW] = piece[_LAST_LOW]
                    if not i:
                        break
                    point = ptr32(int(piece) + 4 * _HIGH_4)
                    k = i
                    while k:
                        # The mean of two points, rounded: bit 28 of the low sum and an odd high sum carry over
                        low = point[_LOW] + 1 + point[_NEXT_LOW]
                        high = point[_HIGH] + point[_NEXT_HIGH]
                        point[_NEXT_LOW] = (((high & 1) << 28) ^ low) >> 1
                        point[_NEXT_HIGH] = ((low >> 28) + high) >> 1
                        point = ptr32(int(point) - 4)
                        k -= 1
                    kept = ptr32(int(kept) - 4)
                    i -= 1
                point = ptr32(int(kept) + 4 * _HIGH_5)
            # The convex hull: of the high words, then, if it matters, of the rounded positions
            bits = 28
            while True:
                least = _BIAS
                most = 0
                point = piece
                i = 6
                while i:
                    high = (point[_LOW] >> bits) + point[_HIGH]
                    if high < least:
                        least = high
                    if high > most:
                        most = high
                    point = ptr32(int(point) + 4)
                    i -= 1
                if bits & 1:
                    break
                bits = 27
                span = most - least
                if span > 1 and position:
                    break
            measures[LOWEST] = least
            measures[HIGHEST] = most
            # The differences, in the finest scale in which they fit a word
            scale = 28
            while span:
                span >>= 1
                scale -= 1
            if scale < _LEAST_SCALE:
                scale = 0
            measures[SCALE] = scale
            time_steady = steady
            steady = 0
            if scale >= least_scale:
                least_scale = _LEAST_SCALE
                bits = 28 - scale
                last = 0
                low = _BIAS
                high = 0 - _BIAS
                i = 6
                while i:  # from the last point on, where the pointer is
                    i -= 1
                    point = ptr32(int(point) - 4)
                    span = ((point[_HIGH] - least) << scale) + (point[_LOW] >> bits)
                    last -= span
                    if i < 5:
                        measures[i + FIRST_DIFFERENCE] = last + _BIAS
                        if last < low:
                            low = last
                        if last > high:
                            high = last
                    last = span
                measures[LEAST] = low + _BIAS
                measures[MOST] = high + _BIAS
                # 1: steady and rising, -1: steady and falling, 0: neither, or all differences are zero
                if low + low >= high:
                    steady = 1
                if low >= high + high:
                    steady -= 1
            else:
                least_scale = _TOO_LONG
            point = piece
            piece = other
            other = point
            point = measures
            measures = other_measures
            other_measures = point
            passes -= 1
        # Judge it: pass over, split or stop. ``piece`` is that of time again, ``other`` that of angle
        move = SKIP
        if position:
            high = other[_LAST_HIGH] + (other[_LAST_LOW] >> 27) - position  # steps to its end
            if least == most:
                if least != position:
                    move = SPLIT
                    if measures[SCALE]:
                        move = SKIP
                        found = AT_START
            elif measures[SCALE] < _LEAST_TIME_SCALE:
                move = SPLIT
            elif steady and time_steady > 0:
                if high * steady > 0:
                    found = MONOTONE
            else:
                low = ((piece[_LAST_HIGH] - piece[_HIGH]) << 12) + ((piece[_LAST_LOW] - piece[_LOW]) >> 16)
                if high or low > min_ticks or other[_HIGH] + (other[_LOW] >> 27) != position:
                    move = SPLIT
                    if low <= _SHORTEST_TICKS or level >= _DEEPEST:
                        move = SKIP
                        if high:
                            found = AT_START
        else:
            found = ((time_steady + 1) << 4) + ((steady & 1) << 3) + 4 * MEASURED
        if found:
            break
    measures[MOVE] = move
    measures[NODE] = node
    other_measures[LEVEL] = level
    return found
