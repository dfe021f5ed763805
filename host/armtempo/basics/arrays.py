"""The array type of the whole package."""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[tuple[Any, ...], np.dtype[np.float64]]
"""``NDArray[np.float64]``, written out: from numpy 2.5 on that is an alias, which says nothing of arrays when a program
looks at it (``json_codec.decode``)."""
