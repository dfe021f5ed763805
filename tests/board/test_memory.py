"""What the board program keeps in its heap: it must not grow unnoticed (board/docs/memory.md).

With what is taken at the start for the largest arm that fits."""

from __future__ import annotations

import pytest

from tests.board import heap_use

PEAK = 70_000
MOTION = 64_700
MACHINE_CODE = 31_000


@pytest.mark.slow
def test_heap_of_the_compiled_program() -> None:
    """Measured on 32-bit MicroPython with the shipped arm; machine code is counted apart."""
    stages = heap_use.measure()
    assert max(stages.values()) == stages["check"] <= PEAK, stages
    assert stages["motion"] <= MOTION, stages
    assert stages["machine code"] <= MACHINE_CODE, stages
