"""Reading JSON from outside: numbers are finite, and nesting has an end."""

from __future__ import annotations

import json
import math
from typing import Any


def loads(text: str | bytes) -> Any:
    """The content of a JSON text; raises ValueError if it is none, or a number is not finite."""
    try:
        return json.loads(text, parse_constant=_refuse, parse_float=_finite)
    except RecursionError:
        raise ValueError("nested too deep") from None


def _finite(digits: str) -> float:
    number = float(digits)
    if not math.isfinite(number):
        _refuse(digits)
    return number


def _refuse(word: str) -> None:
    raise ValueError(f"{word} is not a finite number")
