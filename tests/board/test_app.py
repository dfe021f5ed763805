"""The program above the engine, on every interpreter: commands, runs, faults, picking up again."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import interpreters, scripted

SCRIPTS = Path(__file__).parent / "scripts"
BASICS = SCRIPTS / "probes" / "app_basics.py"
SUBJECTS = [
    SCRIPTS / "cases" / f"app_{name}.py"
    for name in (
        "commands",
        "storing",
        "runs",
        "held",
        "faults",
        "outputs",
        "prompt",
        "start",
        "sequence_start",
        "sequences",
    )
] + [SCRIPTS / "cases" / "heap_modules.py"]


@pytest.mark.parametrize("name", interpreters.AVAILABLE)
def test_first_words_to_last_sample(name: str, tmp_path: Path) -> None:
    lines = interpreters.run(name, BASICS, str(tmp_path / "flash")).splitlines()
    assert lines == BASICS.with_suffix(".txt").read_text().splitlines()


NOT_EMULATED = ("app_outputs", "app_prompt", "app_sequence_start", "app_start")
"""Nothing there depends on the width of words."""
ORDER_OF_STEPS = {
    "case_a_fault_ends_it_and_says_where",
    "case_a_fault_in_a_wait_ends_it",
    "case_a_mistake_of_the_program_ends_it",
    "case_a_motions_row_is_told_with_its_run",
    "case_a_record_that_is_another_now_is_refused_though_it_was_checked",
    "case_an_input_that_never_comes_is_a_fault",
    "case_an_input_that_never_comes_is_passed_over",
    "case_before_any_the_command_is_unknown",
    "case_each_row_is_told_when_it_begins",
    "case_hosts_come_and_go",
    "case_nothing_else_is_taken_meanwhile",
    "case_the_button_starts_it_as_the_default",
    "case_what_cannot_go_on_is_named",
    "case_while_a_motion_runs_the_last_one_is_told",
    "case_without_counters_there_are_none",
}
"""Cases of app_sequences that are left to the two quick interpreters: which step is next, and what is told of it.

Counters, waits, rates and checksums, whose numbers take more than 30 bits, are tried in the emulator too.
"""
CHOSEN = [
    case
    for case in scripted.cases(*SUBJECTS)
    if case.interpreter != "micropython-arm"
    or (case.script.stem not in NOT_EMULATED and case.name not in ORDER_OF_STEPS)
]


@pytest.mark.parametrize("case", scripted.together(CHOSEN), ids=str)
def test_case(case: scripted.Case, tmp_path: Path) -> None:
    case.run(str(tmp_path / "flash"), heap="")


@pytest.mark.parametrize("name", [name for name in interpreters.AVAILABLE if name != "cpython"])
def test_the_loop_allocates_nothing_while_moving(name: str, tmp_path: Path) -> None:
    """2000 turns with the heap locked: samples, status, resending, refusals, noise."""
    output = interpreters.run(name, SCRIPTS / "cases" / "turns_locked.py", str(tmp_path / "flash"))
    taken, first, sent = map(int, output.split())
    assert taken > 195
    assert 0 < first < taken
    assert sent > 200 * 40
