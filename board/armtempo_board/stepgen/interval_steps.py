"""Through a monotone subinterval: its steps into the queue, as cubics if the error bound allows it, else singly."""

import micropython
from micropython import const

from armtempo_board.stepgen.cubics import cubics_fit, put_cubics
from armtempo_board.stepgen.newton import set_interval, solve
from armtempo_board.stepgen.step_queue import put_single
from armtempo_board.stepgen.time_law import scale_slope, to_real_time

_MOST_STEPS = const(1024)  # of a cubic
_NODES = const(12)  # solved in one call
_RAMP_SLACK = const(2)  # log2 of how much wider the error bound is within a ramp, whose nodes are less exact
_MOST_SLACK = const(8)
_SLACK_SHIFT = const(8)  # 2**slack / 8 ticks are 1/1024 of a step's interval
# results of ``queue_steps``
NO_SPACE = const(0)  # the queue is full, or reaches UNTIL_KITICKS
GOES_ON = const(1)
STOPPED = const(2)  # HELD_BACK or HALTED is set

_SINGLY = const(8)  # steps solved one by one before a cubic is tried again; an item of the queue holds 8

# as in step_queue.py: words of the queue
_LEFT = const(8)
_GROUP = const(9)
_STEPS = const(11)
_BASE_KITICKS = const(10)
_UNTIL_KITICKS = const(13)
_ITEM_WORDS = const(12)
_TIME_SCALE = const(14)
_BASE_HIGH = const(15)
_IN = const(20)
_OUT = const(21)
_LATEST_KITICKS = const(22)
_REACHED = const(23)
_LAST_STEP = const(24)
_CUBIC_STEPS = const(25)
_SLOW_TICKS = const(26)
_INTERVAL_HIGH = const(27)
_MODE = const(28)
_SINGLE_STEPS = const(29)
_HELD_BACK = const(30)
_HALTED = const(31)
_ITEMS = const(32)
_ITEMS_MASK = const(15)
_HIGH_BIAS = const(1 << 28)
_COUNT_MASK = const(0xFFFF)
_FULL = const(15)
_BY_LAW = const(1)
_AT_START = const(2)
# as in newton.py: words of the solver
_FIRST_NODE = const(28)
_FIRST_TIME = const(28)  # = FIRST_NODE + NODE_TIME
_MANTISSA = const(29)  # = FIRST_NODE + NODE_MANTISSA
_EXPONENT = const(30)  # = FIRST_NODE + NODE_EXPONENT
_FIRST_DELAY = const(31)  # = FIRST_NODE + NODE_DELAY
_MIDDLE_NODE = const(33)
_MIDDLE_RATE = const(37)  # = MIDDLE_NODE + NODE_RATE
_END_NODE = const(38)
_END_MANTISSA = const(39)  # = END_NODE + NODE_MANTISSA
_END_EXPONENT = const(40)  # = END_NODE + NODE_EXPONENT
_END_DELAY = const(41)  # = END_NODE + NODE_DELAY
_TARGET = const(20)
_RANGE = const(22)
_TIME_OFFSET = const(23)
# of a node
_NODE_TIME = const(0)
_NODE_DELAY = const(3)
_NODE_WORDS = const(5)
# as in time_law.py: words of the law
_REAL_START_HIGH = const(4)
_REAL_START_LOW = const(5)
_REAL_END_HIGH = const(8)
_REAL_END_LOW = const(9)
# as in subintervals.py: arrays of a subinterval
_ANGLE = const(0)
_TIME = const(1)
_ANGLE_MEASURES = const(2)
_TIME_MEASURES = const(3)
# as in bezier.py: words of a piece
_HIGH = const(0)
_LOW = const(6)
_LAST_HIGH = const(5)
_LAST_LOW = const(11)
_BIAS = const(1 << 28)
# as in subdivision.py: measures of a piece
_SCALE = const(0)


@micropython.viper
def begin(solver: object, queue: object, arrays: object, position: int, at_start: int, direction: int) -> int:
    """Take up the steps of a subinterval. Returns twice as many as they are, below 0 if they go down; and 1 more
    if the first of them is in the queue.

    ``arrays``: those of the subinterval (subintervals.py). ``position`` (+ bezier.BIAS):
    where the steps so far lead; ``at_start``: 1 if all steps come at its start. Unless the law stretches the
    motion's time, the first step is solved, and it is queued if more follow and they go in ``direction`` (0: never).
    """
    words = ptr32(queue)  # type: ignore[arg-type]
    nodes = ptr32(solver)  # type: ignore[arg-type]
    angle = ptr32(arrays[_ANGLE])  # type: ignore[index]
    time = ptr32(arrays[_TIME])  # type: ignore[index]
    measures = ptr32(arrays[_TIME_MEASURES])  # type: ignore[index]
    steps = angle[_LAST_HIGH] + (angle[_LAST_LOW] >> 27) - position
    heading = 1 if steps > 0 else -1
    last = heading * steps - 1
    scale = measures[_SCALE] - 12
    words[_TIME_SCALE] = scale
    nodes[_TIME_OFFSET] = time[_LOW] >> (16 - scale)
    words[_LAST_STEP] = last
    words[_REACHED] = 0
    words[_SINGLE_STEPS] = 0
    by_law = words[_MODE] & _BY_LAW
    words[_MODE] = by_law + _AT_START * at_start
    steps += steps
    if at_start:
        nodes[_RANGE] = 0
    else:
        nodes[_TARGET] = 2 * (position - angle[_HIGH]) + heading + _BIAS
        set_interval(solver, arrays[_ANGLE], arrays[_ANGLE_MEASURES], arrays[_TIME_MEASURES])  # type: ignore[index]
    if not by_law:
        words[_INTERVAL_HIGH] = time[_HIGH]
        solve(solver, 0, 0)
        if last and heading == direction:
            put_single(queue, time[_HIGH], (nodes[_FIRST_TIME] + (1 << (scale - 1))) >> scale)
            steps += 1
    return steps


@micropython.viper
def queue_steps(solver: object, queue: object, law: object) -> int:
    """Queue the subinterval's steps after REACHED, until all are in, or the queue is full or reaches UNTIL_KITICKS.

    _NODES are solved at most, or a few more; each takes about 2000 instructions, by a law as much again. A last step
    that is slow is not put in, but HELD_BACK is set. HALTED is set if by the law the next step never comes. Returns one
    of the results above. The words of ``queue`` are named in step_queue.py, those of ``solver`` in newton.py, those of
    ``law`` in time_law.py.
    """
    words = ptr32(queue)  # type: ignore[arg-type]
    nodes = ptr32(solver)  # type: ignore[arg-type]
    reached = words[_REACHED]
    last = words[_LAST_STEP]
    high = words[_INTERVAL_HIGH]
    mode = words[_MODE]
    scale = words[_TIME_SCALE]
    slow_ticks = words[_SLOW_TICKS]
    result = GOES_ON
    budget = _NODES
    count = 0  # single steps in the queue that IN does not count yet
    while reached < last and budget > 0:
        if (words[_IN] - words[_OUT]) & _COUNT_MASK >= _FULL or words[_LATEST_KITICKS] > words[
            _UNTIL_KITICKS
        ]:
            result = NO_SPACE
            break
        length = (last - reached) >> 1
        if length > 1 and mode < _AT_START and not words[_SINGLE_STEPS]:
            # Two cubics of ``length`` steps each: as long as the last that fitted, and so that none of a few is left
            size = words[_CUBIC_STEPS]
            if length > size:
                length = (last - reached) // (2 * ((last - reached - 1) // (2 * size) + 1))
                if length < 8:
                    length = size if size < 8 else 8
            slack = 0
            if mode:
                # Times count from the first node on
                i = nodes[_FIRST_TIME] >> scale
                nodes[_FIRST_TIME] = nodes[_FIRST_TIME] - (i << scale)
                base = nodes[_FIRST_DELAY] + i
                nodes[_FIRST_DELAY] = base
                # and no cubic goes beyond an end of the ramp, where nodes leap by a tick; steps until there
                node = ptr32(law)  # type: ignore[arg-type]
                i = ((node[_REAL_START_HIGH] - high) << 12) + node[_REAL_START_LOW] - base
                if node[_REAL_START_HIGH] < high + (base >> 12):
                    i = ((node[_REAL_END_HIGH] - high) << 12) + node[_REAL_END_LOW] - base
                    slack = _RAMP_SLACK
                    if node[_REAL_END_HIGH] < high + (base >> 12):
                        i = -1
                        slack = 0
                if i >= 0:
                    i = i // ((nodes[_MANTISSA] >> nodes[_EXPONENT]) + 1)
                    i -= (i >> 6) + 1
                    if length + length > i:
                        length = i >> 1
            while length > 1:
                solve(solver, reached, length)
                budget -= 2 + mode + mode
                words[_BASE_HIGH] = high
                verdict = 1
                if mode:
                    # The nodes in real time, all three counting from one base
                    verdict = int(to_real_time(law, solver, _MIDDLE_NODE, scale))
                    if verdict:
                        scale_slope(solver, _MIDDLE_NODE)
                        verdict = int(to_real_time(law, solver, _END_NODE, scale))
                    if verdict:
                        scale_slope(solver, _END_NODE)
                        base = (nodes[_FIRST_DELAY] >> 12) << 12
                        words[_BASE_HIGH] = high + (base >> 12)
                        if (nodes[_END_DELAY] - base) >> (28 - scale):
                            verdict = 0
                        else:
                            node = ptr32(int(nodes) + 4 * _FIRST_NODE)
                            i = 3
                            while i:
                                node[_NODE_TIME] = ((node[_NODE_DELAY] - base) << scale) + node[_NODE_TIME]
                                node[_NODE_DELAY] = base
                                node = ptr32(int(node) + 4 * _NODE_WORDS)
                                i -= 1
                if verdict:
                    # By a law a step may be 1/1024 of its interval off; in a ramp at least half a tick
                    i = slack
                    if mode:
                        base = nodes[_MANTISSA] >> (nodes[_EXPONENT] + _SLACK_SHIFT)
                        while base >> i and i < _MOST_SLACK:
                            i += 1
                    verdict = int(cubics_fit(length, solver, queue, i))
                if verdict > 0:
                    break
                length = (length * (4 + verdict) if mode and verdict else 3 * length) >> 2
                words[_CUBIC_STEPS] = length if length > 2 else 2
            if length > 1:
                reached += length + length
                if reached == last and nodes[_END_MANTISSA] >> nodes[_END_EXPONENT] > slow_ticks:
                    words[_HELD_BACK] = 1
                    result = STOPPED
                base = nodes[_MANTISSA] >> nodes[_EXPONENT]
                put_cubics(length, solver, queue, result - GOES_ON)
                # The next ones: eighths of these, and longer than before only if it says so
                i = (length * verdict) >> 3
                if mode:
                    # By a law as many as fit next time, fewer as steps become longer: before rest one lasts as long as
                    # the number of those that are left to the power of -2/3
                    verdict = nodes[_MANTISSA] >> nodes[_EXPONENT]
                    i = (i * base + (verdict >> 1)) // verdict
                    i = (i * (base + verdict) + verdict) // (2 * verdict)
                    verdict = 8
                    if i > size:
                        verdict = 9
                    elif i < length:
                        verdict = 7
                if i > _MOST_STEPS:
                    i = _MOST_STEPS
                if (i > size and verdict > 8) or (verdict < 8 and i > 1):
                    words[_CUBIC_STEPS] = i
            else:
                words[_SINGLE_STEPS] = _SINGLY
        else:
            # A single step
            if words[_SINGLE_STEPS]:
                words[_SINGLE_STEPS] = words[_SINGLE_STEPS] - 1
            solve(solver, reached + 1, 0)
            budget -= 1 + (mode & _BY_LAW)
            base = 0
            if mode & _BY_LAW:
                if not int(to_real_time(law, solver, _FIRST_NODE, scale)):
                    words[_HALTED] = 1
                    result = STOPPED
                    break
                if mode == _BY_LAW:
                    scale_slope(solver, _FIRST_NODE)
                base = nodes[_FIRST_DELAY]
            reached += 1
            if reached == last and (mode > _BY_LAW or nodes[_MANTISSA] >> nodes[_EXPONENT] > slow_ticks):
                words[_HELD_BACK] = 1
                result = STOPPED
            else:
                base += (nodes[_FIRST_TIME] + (1 << (scale - 1))) >> scale
                if not count:
                    item = ptr32(int(words) + ((words[_IN] & _ITEMS_MASK) * _ITEM_WORDS + _ITEMS) * 4)
                    item[_LEFT] = 0
                    item[_GROUP] = 0
                i = high - _HIGH_BIAS
                item[count] = (i << 12) + base
                words[_LATEST_KITICKS] = (i << 2) + (base >> 10)
                if not count:
                    item[_BASE_KITICKS] = words[_LATEST_KITICKS]
                count += 1
                item[_STEPS] = count
            if count and (count == _SINGLY or (not words[_SINGLE_STEPS] and last - reached > 3)):
                words[_IN] = (words[_IN] + 1) & _COUNT_MASK
                count = 0
    if count:
        words[_IN] = (words[_IN] + 1) & _COUNT_MASK
    words[_REACHED] = reached
    return result
