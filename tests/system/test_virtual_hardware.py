"""The simulated hardware behaves like the chip's, on every interpreter."""

from __future__ import annotations

import re
from pathlib import Path

from tests import interpreters

SCRIPT = Path(__file__).parent / "scripts" / "virtual_hardware.py"


def test_cases(interpreter: str, tmp_path: Path) -> None:
    """Each case asserts by itself and prints its name when it holds."""
    (tmp_path / "flash").mkdir()
    lines = interpreters.run(interpreter, SCRIPT, str(tmp_path)).splitlines()
    assert lines == sorted(re.findall(r"def (case_\w+)", SCRIPT.read_text()))
