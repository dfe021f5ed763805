"""Through a cell: its steps into the queue, in stretches where the error bound allows it, else one by one."""

import micropython
from micropython import const

from armtempo_board.stepgen.braking import slow, steepen
from armtempo_board.stepgen.newton import solve
from armtempo_board.stepgen.step_queue import accept, differences

_LARGEST = const(1024)  # steps of a stretch
_SINGLY = const(8)  # steps solved one by one before stretches are tried again; a place in the queue takes 8
_HIGH_BIAS = const(1 << 28)


@micropython.viper
def traverse(block: object, state: object, budget: int) -> object:
    """Put steps of the cell behind AT into the queue, until it is full, or goes on beyond UNTIL_1024, or the cell ends.

    ``budget``: nodes to be solved at most, or a few more; each takes about 2000 instructions. A last step that is
    slow is not put in, but HELD is set. In MODE, 1: braking, 2: all steps come at once; ENDED is set where braking
    ends before. The words of ``state`` are named in stretch.py, those of ``block`` in crossing.py.
    """
    words = ptr32(state)  # type: ignore[arg-type]
    nodes = ptr32(block)  # type: ignore[arg-type]
    at = words[23]
    last = words[24]
    high = words[27]
    mode = words[28]
    scale = words[14]
    count = 0  # steps in the queue that IN does not count yet
    while at < last and budget > 0:
        if ((words[20] - words[21]) & 0xFFFF) > 6 or words[22] > words[13]:
            break
        length = (last - at) >> 1
        if length > 1 and mode < 2 and not words[29]:
            size = words[25]
            if length > size:
                length = (last - at) // (2 * ((last - at - 1) // (2 * size) + 1))
                if length < 8:
                    length = size if size < 8 else 8
            while length > 1:
                solve(block, at, length)
                budget -= 2
                words[15] = high
                verdict = 1
                if mode:
                    # nodes in real time, all three counting from the same base
                    verdict = int(slow(block, 36, high, scale))
                    if verdict:
                        steepen(block, 36)
                        verdict = int(slow(block, 44, high, scale))
                    if verdict:
                        steepen(block, 44)
                        base = (nodes[31] >> 12) << 12
                        words[15] = high + (base >> 12)
                        if (nodes[47] - base) >> (28 - scale):
                            verdict = 0
                        else:
                            out = ptr32(int(nodes) + 112)
                            node = 3
                            while node:
                                out[0] = ((out[3] - base) << scale) + out[0]
                                out[3] = base
                                out = ptr32(int(out) + 32)
                                node -= 1
                if verdict:
                    verdict = int(accept(length, block, state))
                if verdict:
                    break
                length >>= 1
                words[25] = length if length > 2 else 2
            if length > 1:
                at += length + length
                held = 0
                if at == last and (nodes[45] >> nodes[46]) > words[26]:
                    held = 1
                differences(length, block, state, held)
                words[30] = held
                if verdict == 2 and length + length > size and size < _LARGEST:
                    words[25] = size + size
            else:
                words[29] = _SINGLY
        else:
            if words[29]:
                words[29] = words[29] - 1
            solve(block, at + 1, 0)
            budget -= 1
            base = 0
            if mode & 1:
                if not int(slow(block, 28, high, scale)):
                    words[31] = 1
                    break
                if mode == 1:
                    steepen(block, 28)
                base = nodes[31]
            at += 1
            if at == last and (mode > 1 or (nodes[29] >> nodes[30]) > words[26]):
                words[30] = 1
            else:
                base += (nodes[28] + (1 << (scale - 1))) >> scale
                if not count:
                    out = ptr32(int(words) + ((words[20] & 7) * 13 + 32) * 4)
                    out[8] = 0
                    out[9] = 0
                out[count] = ((high - _HIGH_BIAS) << 12) + base
                words[22] = ((high - _HIGH_BIAS) << 2) + (base >> 10)
                if not count:
                    out[12] = words[22]
                count += 1
                out[11] = count
            if count and (count == _SINGLY or (not words[29] and last - at > 3)):
                words[20] = (words[20] + 1) & 0xFFFF
                count = 0
    if count:
        words[20] = (words[20] + 1) & 0xFFFF
    words[23] = at
