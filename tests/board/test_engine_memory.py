"""The memory for engines, on every interpreter."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import scripted

SCRIPT = Path(__file__).parent / "scripts" / "cases" / "memory.py"


@pytest.mark.parametrize("case", scripted.cases(SCRIPT), ids=str)
def test_case(case: scripted.Case) -> None:
    case.run()
