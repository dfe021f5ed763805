"""Brings the parts of a joint's motion, one after the other: halves the pieces of time and angle, measures both
in a block scale of their own, in single words, and judges whether the part can be solved.

An array of pieces holds six, 13 words each: the one that is looked at, four right halves by their level modulo
4, and the root. A right half comes with the left one; it is kept, as it is the next to be looked at or halved.
The last word of a kept one tells where it stands, as a node: 2**level + index among the 2**level parts.
One of an earlier segment is never taken for one of this: before a right half is looked for, what both were
halved from has been halved in this segment, which put it into its place.

Signed values in arrays are stored with a bias, see points.py.
"""

import micropython
from micropython import const

# what is measured
SCALE = 0  # fraction bits f of the local unit, 2**-f high units; 0: the piece is too large
STEPS = 1  # five differences of neighbouring points, local units, + DIFFERENCE_BIAS
LEAST = 6  # least and largest of these
MOST = 7
LOWEST = 8  # least and largest position (high + BIAS of the points, rounded) in the hull, if it was looked at
HIGHEST = 9
# the state of the walk: with the measures of time
MOVE = 10  # what is done before the next part is looked at
NODE = 11  # the part
LEVEL = 10  # with those of angle: its level
LOCAL_SIZE = 12
PIECES_SIZE = 78
DIFFERENCE_BIAS = 1 << 29

# moves
STAY = 0
SKIP = 1  # go on behind the part, with one twice as long where the grid allows it
SPLIT = 2  # go on with its first half

# what ``Subintervals.measure`` gives, but for a 1
STRAIGHT = 2  # the differences of angle have one sign and are within a factor of two
EVEN = 8  # those of time are positive, and so, too

_D_BIAS = const(1 << 29)
_WORK = const(12)  # for one call: a part is 2, halving its pieces once 2 more
_LARGE = const(13)  # least scale of any piece
_TIME_SCALE = const(17)  # least scale of a cell's time: 2**23 ticks fill 28 bits
_NONE = const(29)
_DEEPEST = const(27)
_SHORTEST = const(2)  # ticks


@micropython.viper
def seek(
    piece: ptr32, here: ptr32, local: ptr32, other_local: ptr32, position: int, reversal_ticks: int
) -> int:
    """Look at parts until one holds steps, or it is enough for one call. A verdict (subintervals.py).

    ``piece`` and ``local``: pieces and measures of time; ``here`` and ``other_local``: those of angle. ``position``
    (+ points.BIAS): where the steps so far lead; 0: only measure the next part, and give 4 * (1 + STRAIGHT + EVEN).
    """
    other = here
    node = local[11]
    level = other_local[10]
    move = local[10]
    work = _WORK
    found = 0
    while work > 0:
        work -= 2
        below = move >> 1  # levels from the part back up to the piece it is halved from, which begins ``at``
        at = 0
        if below:  # split: it is the one that was looked at
            node <<= 1
            level += 1
        else:
            if move:
                node += 1
                if node >> level == 2:
                    node >>= 1
                    move = 0
                    found = 3
                    break
                if not node & 1:
                    node >>= 1
                    level -= 1
            while below < level:
                at = (((level - below) & 3) + 1) * 52
                here = ptr32(int(piece) + at)
                if here[12] == node >> below:
                    break
                below += 1
            else:
                at = 260
        least_scale = _TIME_SCALE if position else _LARGE
        heading = 0
        turn = 2
        while turn:  # time, then angle
            here = ptr32(int(piece) + at)
            fetch = at
            todo = below
            while True:
                if fetch:
                    piece[0] = here[0]
                    piece[1] = here[1]
                    piece[2] = here[2]
                    piece[3] = here[3]
                    piece[4] = here[4]
                    piece[5] = here[5]
                    piece[6] = here[6]
                    piece[7] = here[7]
                    piece[8] = here[8]
                    piece[9] = here[9]
                    piece[10] = here[10]
                    piece[11] = here[11]
                if not todo:
                    break
                # by de Casteljau: the left half stays in place, point by point of the right one comes out at its end
                todo -= 1
                work -= 1
                kept = ptr32(int(piece) + (((level - todo) & 3) + 1) * 52)
                i = node >> todo
                fetch = i & 1
                kept[12] = i | 1
                i = 5
                while True:
                    kept[5] = piece[5]
                    kept[11] = piece[11]
                    if not i:
                        break
                    here = ptr32(int(piece) + 16)
                    k = i
                    while k:
                        # the mean: half of bit 28 moves down, the carry of the low words or an odd sum of the high
                        low = here[6] + 1 + here[7]
                        high = here[0] + here[1]
                        here[7] = (((high & 1) << 28) ^ low) >> 1
                        here[1] = ((low >> 28) + high) >> 1
                        here = ptr32(int(here) - 4)
                        k -= 1
                    kept = ptr32(int(kept) - 4)
                    i -= 1
                here = ptr32(int(kept) + 20)
            # the hull: of the high words, then, where it matters, of the rounded positions
            bits = 28
            while True:
                least = _D_BIAS
                most = 0
                here = piece
                i = 6
                while i:
                    high = (here[6] >> bits) + here[0]
                    if high < least:
                        least = high
                    if high > most:
                        most = high
                    here = ptr32(int(here) + 4)
                    i -= 1
                if bits & 1:
                    break
                bits = 27
                span = most - least
                if span > 1 and position:
                    break
            local[8] = least
            local[9] = most
            scale = 28
            while span:
                span >>= 1
                scale -= 1
            if scale < _LARGE:
                scale = 0
            local[0] = scale
            even = heading
            heading = 0
            if scale >= least_scale:
                least_scale = _LARGE
                bits = 28 - scale
                # from behind, as the pointer stands
                last = 0
                low = _D_BIAS
                high = 0 - _D_BIAS
                i = 6
                while i:
                    i -= 1
                    here = ptr32(int(here) - 4)
                    span = ((here[0] - least) << scale) + (here[6] >> bits)
                    last -= span
                    if i < 5:
                        local[i + 1] = last + _D_BIAS
                        if last < low:
                            low = last
                        if last > high:
                            high = last
                    last = span
                local[6] = low + _D_BIAS
                local[7] = high + _D_BIAS
                # true of positive differences, of negative ones below, of nothing but zeros both
                if low + low >= high:
                    heading = 1
                if low >= high + high:
                    heading -= 1
            else:
                least_scale = _NONE  # the part is too long: its angle does not matter
            here = piece
            piece = other
            other = here
            here = local
            local = other_local
            other_local = here
            turn -= 1
        # judge it
        move = 1
        if position:
            high = other[5] + (other[11] >> 27) - position
            if least == most:
                if least != position:
                    move = 2
                    if local[0]:
                        move = 1
                        found = 2
            elif local[0] < _TIME_SCALE:
                move = 2
            elif heading and even > 0:
                if high * heading > 0:
                    found = 1
            else:
                low = ((piece[5] - piece[0]) << 12) + ((piece[11] - piece[6]) >> 16)
                if high or low > reversal_ticks or other[0] + (other[6] >> 27) != position:
                    move = 2
                    if low <= _SHORTEST or level >= _DEEPEST:
                        move = 1
                        if high:
                            found = 2
        else:
            found = ((even + 1) << 4) + ((heading & 1) << 3) + 4
        if found:
            break
    local[10] = move
    local[11] = node
    other_local[10] = level
    return found
