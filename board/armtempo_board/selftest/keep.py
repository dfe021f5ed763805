"""Stores the measured step rates, which the program states after its next start."""

import os

from armtempo_board.app.board import board_id
from armtempo_board.storage import measured_rates

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


def measure(root: str, program_crc: int, rates: "tuple[int, int, int]") -> "dict[str, Any]":
    """``rates``: of one joint, of all together, and the number of joints with which they were measured."""
    measured_rates.write(root, board_id(), program_crc, rates)
    if hasattr(os, "sync"):
        os.sync()  # a reset follows
    return {}
