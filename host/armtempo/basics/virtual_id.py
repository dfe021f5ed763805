"""How a virtual board is told from a real one: by the first digits of its unique id."""

from __future__ import annotations

PREFIX = b"virt".hex()
"""On an STM32 these 32 bits are wafer coordinates (RM0090 39.1), which are never as large as these letters."""


def is_virtual(board_id: str) -> bool:
    """Whether a board that calls itself so in its answer to ``hello`` is a virtual one."""
    return board_id.startswith(PREFIX)
