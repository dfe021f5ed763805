"""The memory for engines, on every interpreter."""

from __future__ import annotations

from pathlib import Path

from tests import scripted

SCRIPT = Path(__file__).parent / "scripts" / "cases" / "memory.py"


@scripted.each(scripted.cases(SCRIPT))
def test_case(case: scripted.Case) -> None:
    case.run()
