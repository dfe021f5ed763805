"""The heap of the board program must not grow unnoticed (board/docs/memory.md), nor one arm after the other fill it;
the formula that host and board share counts what an arm takes."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from armtempo_shared import engine_memory, limits

from tests import interpreters
from tests.board import heap_use

MODULES = 72_800
"""A word on the stack that nothing uses may keep a block: by the place of the checkout and with each change of the
code this figure varies by 600 (71 808 to 72 400 seen)."""
MARGIN = 8_192
SCRIPT = Path(__file__).parent / "scripts" / "probes" / "arm_changes.py"
CHANGES = 25
SEED = 12


@pytest.mark.slow
def test_heap_of_the_compiled_program() -> None:
    """Measured on 32-bit MicroPython with the shipped arm; its code runs from the image of the flash."""
    stages = heap_use.measure()
    assert stages.pop("code elsewhere") == 0
    assert stages["modules"] <= MODULES, stages
    assert max(stages.values()) <= heap_use.HEAP - MARGIN, stages


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in interpreters.AVAILABLE if name == "micropython"])
def test_arms_one_after_the_other(name: str, tmp_path: Path) -> None:
    """Uploads, runs and removals of random arms; those that do not fit are refused."""
    print("seed", SEED)
    output = interpreters.run(name, SCRIPT, str(tmp_path / "flash"), str(CHANGES), str(SEED), heap="1M")
    used, largest, used_then, largest_then, taken, refused = map(int, output.split())
    assert used_then - used < 1024
    assert largest_then >= largest - 64
    assert min(taken, refused) > 5


def test_what_fits() -> None:
    """All parts of an engine are in the blocks, one after the other; whatever needs more words does not fit."""
    rng = random.Random(SEED)
    for _ in range(300):
        rates = [rng.randrange(1, 240_001) for _ in range(rng.randrange(1, 7))]
        needed = engine_memory.words(rates)
        assert not engine_memory.lasting_ms(rates, needed - 1)
        assert engine_memory.lasting_ms(rates, needed + 1026 * 3)
        assert not engine_memory.fits(rates, engine_memory.needed_bytes(rates) - 4)
    assert sum(engine_memory.blocks(5000)) == 5000
    assert engine_memory.blocks(0) == []


@pytest.mark.parametrize("joints", range(1, limits.MAX_JOINTS + 1))
def test_the_largest_memory_holds_what_the_board_can_step(joints: int) -> None:
    """The sum of the rates at its limit, with the little space that the host gives each joint."""
    rate = limits.MAX_STEP_RATE_SUM // joints
    assert engine_memory.fits([rate + rate // 100 + 1] * joints, engine_memory.LARGEST_BYTES)
