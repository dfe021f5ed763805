"""The engine on simulated hardware, on every interpreter."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import interpreters, scripted

CASES = Path(__file__).parent / "scripts" / "cases"
SCRIPTS = [
    CASES / f"{name}.py"
    for name in ("engine_pulses", "engine_faults", "engine_brake", "engine_override", "rings", "encoders")
]

NOT_EMULATED = {
    *("case_estop_anywhere", "case_interrupt_gone", "case_long_pause", "case_long_rest", "case_refused"),
    *(
        "case_prepared",
        "case_stops",
        "case_three_joints",
        "case_too_late",
        "case_underrun_anywhere",
        "case_whole_motion",
    ),
    # here nothing depends on the width of words
    *("case_close_and_anew", "case_enable", "case_estop_at_rest", "case_estop_behind_a_limit_switch"),
    *("case_estop_while_loading", "case_following", "case_limit_switches", "case_limit_tripped_before"),
    *("case_loaded_in_vain", "case_long_stall", "case_many_turns", "case_not_planned_for", "case_refusals"),
    *("case_start_failed", "case_written_too_late"),
}
"""Left to the two quick interpreters: in the emulator, 25 times slower, they take 1 to 30 s each."""
CHOSEN = [
    case
    for case in scripted.cases(*SCRIPTS)
    if case.interpreter != "micropython-arm" or case.name not in NOT_EMULATED
]


@pytest.mark.parametrize("case", scripted.together(CHOSEN), ids=str)
def test_case(case: scripted.Case) -> None:
    case.run(*["short"] * (case.interpreter == "micropython-arm"))


@pytest.mark.slow
@pytest.mark.skipif("micropython" not in interpreters.AVAILABLE, reason="needs MicroPython")
def test_more_changes_of_speed() -> None:
    """Where it is quickest, on more motions; the other interpreters have a few of them above."""
    named = ["case_stops", "case_whole_path"]
    output = interpreters.run("micropython", CASES / "engine_override.py", "12", *named, heap="16M")
    assert output.split() == named


@pytest.mark.parametrize("name", [name for name in interpreters.AVAILABLE if name != "cpython"])
def test_nothing_is_allocated_while_a_motion_runs(name: str) -> None:
    """Whole motions with the heap locked; what an engine keeps, in bytes on the 32-bit interpreter."""
    output = interpreters.run(name, CASES / "no_allocation.py", heap=scripted.HEAP[name]).splitlines()
    three, six = map(int, output[0].split())
    if name == "micropython-arm":
        assert three < 22_000, three
        assert six < 42_000, six
    assert output[1].startswith("13 [3000, 700, 2]")
    assert len(output) == 3
