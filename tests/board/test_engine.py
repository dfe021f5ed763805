"""The engine on simulated hardware, on every interpreter; each case asserts by itself and prints its name."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests import interpreters

SCRIPTS = Path(__file__).parent / "scripts"
HEAP = "6M"


@pytest.mark.parametrize("script", ["engine_pulses", "engine_faults", "engine_brake"])
def test_cases(interpreter: str, script: str) -> None:
    path = SCRIPTS / f"{script}.py"
    listed = re.findall(r"^    +(\w+),$", path.read_text().rpartition("cases(")[2], re.MULTILINE)
    short = ["short"] if interpreter == "micropython-arm" else []
    assert interpreters.run(interpreter, path, *short, heap=HEAP).split() == listed
    assert len(listed) >= 4
