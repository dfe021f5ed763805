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


@pytest.mark.parametrize("name", interpreters.EACH)
def test_first_words_to_last_sample(name: str, tmp_path: Path) -> None:
    lines = interpreters.run(name, BASICS, str(tmp_path / "flash")).splitlines()
    assert lines == BASICS.with_suffix(".txt").read_text().splitlines()


@scripted.each(scripted.together(scripted.cases(*SUBJECTS)))
def test_case(case: scripted.Case, tmp_path: Path) -> None:
    case.run(str(tmp_path / "flash"), heap="")


@pytest.mark.parametrize("name", interpreters.EACH[1:])
def test_the_loop_allocates_nothing_while_moving(name: str, tmp_path: Path) -> None:
    """2000 turns with the heap locked: samples, status, resending, refusals, noise."""
    output = interpreters.run(name, SCRIPTS / "cases" / "turns_locked.py", str(tmp_path / "flash"))
    taken, first, sent = map(int, output.split())
    assert taken > 195
    assert 0 < first < taken
    assert sent > 200 * 40
