"""The array type of the whole package."""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[tuple[Any, ...], np.dtype[np.float64]]
"""``NDArray[np.float64]``, written out: from numpy 2.5 on that is an alias, which says nothing of arrays when a program
looks at it (``json_codec.decode``)."""

np.empty(31 << 20, np.uint8)
"""glibc keeps the memory that arrays leave, up to twice the largest block that was freed, of 32 MB at most (mallopt(3),
M_MMAP_THRESHOLD). Without this one, which is never written, it gives the memory back after each call, and the system
zeroes it again, page by page: 1500 times in the plan of a jog, 120 000 in that of six joints and 12 via points."""
