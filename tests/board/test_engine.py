"""The engine on simulated hardware, on every interpreter; each case asserts by itself and prints its name."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests import interpreters

SCRIPTS = Path(__file__).parent / "scripts"
HEAP = {"cpython": "", "micropython": "16M", "micropython-arm": "6M"}


@pytest.mark.parametrize(
    "script",
    ["engine_pulses", "engine_faults", "engine_brake", "engine_override", "ring_cases", "encoder_cases"],
)
def test_cases(interpreter: str, script: str) -> None:
    path = SCRIPTS / f"{script}.py"
    listed = re.findall(r"^    +(\w+),$", path.read_text().rpartition("cases(")[2], re.MULTILINE)
    short = ["short"] if interpreter == "micropython-arm" else []
    assert interpreters.run(interpreter, path, *short, heap=HEAP[interpreter]).split() == listed
    assert len(listed) >= 4


@pytest.mark.skipif("micropython" not in interpreters.AVAILABLE, reason="needs MicroPython")
def test_two_hundred_changes_of_speed() -> None:
    """Where it is quickest, on more motions; the other interpreters have a few of them above."""
    script = SCRIPTS / "engine_override.py"
    output = interpreters.run("micropython", script, "30", "whole_path", "stops", heap="16M")
    assert output.split() == ["whole_path", "stops"]


@pytest.mark.parametrize("name", [name for name in interpreters.AVAILABLE if name != "cpython"])
def test_nothing_is_allocated_while_a_motion_runs(name: str) -> None:
    """Whole motions with the heap locked; what an engine keeps, in bytes on the 32-bit interpreter."""
    output = interpreters.run(name, SCRIPTS / "no_allocation.py", heap=HEAP[name]).splitlines()
    three, six = map(int, output[0].split())
    if name == "micropython-arm":
        assert three < 22_000, three
        assert six < 42_000, six
    assert output[1].startswith("13 [3000, 700, 2]")
    assert len(output) == 3
