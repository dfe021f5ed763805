"""Points less than a step of each motor apart, which are one."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from armtempo.basics.arrays import Array


def groups(
    steps: Array, may_join: Callable[[int, int], bool] = lambda _before, _number: True
) -> list[list[int]]:
    """The numbers of points, those that are one together, in order; the two ends are never one.

    ``steps``: (n + 1, J), the motors' positions; ``may_join``: whether a point may be one with an earlier one.
    """
    last = len(steps) - 1
    found = [[0]]
    for number in range(1, last):
        if _is_near(steps, found[-1][0], number) and may_join(found[-1][0], number):
            found[-1].append(number)
        else:
            found.append([number])
    end = [last]
    while len(found) > 1 and _is_near(steps, found[-1][0], last) and may_join(found[-1][0], end[0]):
        end = found.pop() + end
    return [*found, end]


def kept(group: Sequence[int], last: int) -> int:
    """The point whose place a group has: its first, or the last of all."""
    return last if group[-1] == last else group[0]


def _is_near(steps: Array, one: int, other: int) -> bool:
    return bool(np.all(np.abs(steps[one] - steps[other]) < 1.0))
