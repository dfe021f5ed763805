"""The simulated hardware behaves like the chip's, on every interpreter."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import scripted

SCRIPT = Path(__file__).parent / "scripts" / "cases" / "virtual_hardware.py"


@pytest.mark.parametrize("case", scripted.cases(SCRIPT), ids=str)
def test_case(case: scripted.Case, tmp_path: Path) -> None:
    (tmp_path / "flash").mkdir()
    case.run(str(tmp_path), heap="")
