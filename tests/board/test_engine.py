"""The engine on simulated hardware and the memory for it, on every interpreter."""

from __future__ import annotations

from pathlib import Path

import pytest
from armtempo_shared import engine_memory

from tests import interpreters, scripted

CASES = Path(__file__).parent / "scripts" / "cases"
SCRIPTS = [
    CASES / f"{name}.py"
    for name in ("engine_pulses", "engine_faults", "engine_override", "engine_backlash", "rings", "encoders")
]
QUICKEST = "micropython" if "micropython" in interpreters.AVAILABLE else "cpython"


@scripted.each(scripted.together(scripted.cases(*SCRIPTS)))
def test_case(case: scripted.Case) -> None:
    """Most moments and motions where it is quickest; elsewhere some show that it does the same."""
    case.run(*["short"] * (case.interpreter != QUICKEST))


@pytest.mark.long
@pytest.mark.skipif(
    "micropython" not in interpreters.AVAILABLE,
    reason="no MicroPython here: CI ends at the start, and the summary says so",
)
def test_more_changes_of_speed() -> None:
    """If it is quickest, on more motions; the other interpreters have a few of them above."""
    named = ["case_stops", "case_whole_path"]
    output = interpreters.run("micropython", CASES / "engine_override.py", "12", *named, heap="16M")
    assert output.split() == named


@pytest.mark.parametrize("name", interpreters.EACH[1:])
def test_nothing_is_allocated_while_a_motion_runs(name: str) -> None:
    """Whole motions with the heap locked; what an engine keeps, in bytes on the 32-bit interpreter."""
    output = interpreters.run(name, CASES / "no_allocation.py", heap=scripted.HEAP[name]).splitlines()
    three, six, with_backlash = map(int, output[0].split())
    if name == "micropython-arm":
        assert three < 22_000, three
        assert six < 42_000, six
        assert three <= engine_memory.object_bytes(3)
        assert with_backlash <= engine_memory.object_bytes(3, 1)
    assert output[1].startswith("13 [3000, 700, 2]")
    assert output[3].startswith("13 [3000, 700, 2]")
    assert len(output) == 4


# the memory for engines, on every interpreter


SCRIPT = Path(__file__).parent / "scripts" / "cases" / "memory.py"


@scripted.each(scripted.together(scripted.cases(SCRIPT)))
def test_case_of_engine_memory(case: scripted.Case) -> None:
    case.run()
