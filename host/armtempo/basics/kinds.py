"""What counts as a number, a whole number and a text: in calls, in TOML and JSON files, and in messages of programs.

It imports little, as 'armtempo stop' loads it.
"""

from __future__ import annotations

import math
import sys
from numbers import Integral, Real
from typing import Any


def is_number(value: object) -> bool:
    """Whether it is a finite number, and no integer beyond the largest double."""
    if type(value) is float:  # as most are: the check for an abstract class takes ten times as long
        return math.isfinite(value)
    if not isinstance(value, Real) or isinstance(value, bool):
        return False
    size: Any = abs(value)
    return bool(size <= sys.float_info.max)


def is_whole(value: object) -> bool:
    """Whether it is a whole number."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def is_text(value: object) -> bool:
    """Whether it is a text of printable characters only: no control, format or line-breaking characters."""
    return isinstance(value, str) and value.isprintable()
