"""What is promised to those who make arms, motions and sequences: the numbers as the pages have them."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest
from armtempo_shared import limits, messages, sequence

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("page", "words", "module", "name", "promised"),
    [
        (
            "board/docs/evaluator.md",
            "hello states 240 000 steps/s for one joint",
            limits,
            "MAX_STEP_RATE",
            240_000,
        ),
        ("board/docs/hardware.md", "TIM2 and TIM5 count 84 MHz ticks", limits, "TICK_HZ", 84_000_000),
        ("board/docs/hardware.md", "pulses of up to six stepper drivers", limits, "MAX_JOINTS", 6),
        ("board/docs/hardware.md", "reads up to four encoders", limits, "MAX_ENCODERS", 4),
        ("host/docs/planning.md", "16 384 bytes, 512 segments", limits, "MAX_MOTION_BYTES", 16_384),
        ("host/docs/planning.md", "16 384 bytes, 512 segments", limits, "MAX_SEGMENTS", 512),
        ("shared/docs/protocol.md", "24 characters of a-z A-Z 0-9", limits, "MAX_NAME", 24),
        ("host/docs/sequences.md", "64 different motions and 500 rows", sequence, "MAX_ROWS", 500),
        ("host/docs/sequences.md", "64 different motions and 500 rows", sequence, "MAX_MOTIONS", 64),
        ("host/docs/sequences.md", "up to four within each other", sequence, "MAX_NESTING", 4),
        ("host/docs/sequences.md", "up to eight in a sequence", sequence, "MAX_COUNTERS", 8),
        ("host/docs/files.md", "Up to eight tables `[output.NAME]`", limits, "MAX_OUTPUTS", 8),
        ("host/docs/files.md", "and eight `[input.NAME]`", limits, "MAX_INPUTS", 8),
        ("host/docs/library.md", "do not reach the board for 300 ms", limits, "HOLD_TIMEOUT_MS", 300),
        ("shared/docs/protocol.md", "of its planned rate (10 to 1000)", messages, "SLOWEST_PERMILLE", 10),
        ("host/docs/sequences.md", "1 ms to an hour", sequence, "MAX_WAIT_MS", 3_600_000),
    ],
)
def test_limits_are_those_of_the_pages(
    page: str, words: str, module: ModuleType, name: str, promised: int
) -> None:
    text = " ".join((ROOT / page).read_text(encoding="utf-8").split())
    assert words in text
    assert getattr(module, name) == promised
