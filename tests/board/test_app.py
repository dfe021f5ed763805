"""The program above the engine, on every interpreter: commands, runs, faults, picking up again."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests import interpreters

SCRIPTS = Path(__file__).parent / "scripts"


@pytest.mark.parametrize("name", interpreters.AVAILABLE)
def test_first_words_to_last_sample(name: str, tmp_path: Path) -> None:
    lines = interpreters.run(name, SCRIPTS / "app_basics.py", str(tmp_path / "flash")).splitlines()
    expected = (SCRIPTS / "app_basics.txt").read_text().splitlines()
    assert lines == expected


@pytest.mark.parametrize("subject", ["commands", "storing", "runs", "faults", "prompt", "start"])
@pytest.mark.parametrize("name", interpreters.AVAILABLE)
def test_cases(name: str, subject: str, tmp_path: Path) -> None:
    """Each case asserts by itself and prints its name when it holds."""
    script = SCRIPTS / f"app_{subject}.py"
    lines = interpreters.run(name, script, f"{tmp_path}/flash").splitlines()
    wanted = sorted(re.findall(r"def (case_\w+)", script.read_text()))
    assert lines == wanted


@pytest.mark.parametrize("name", [name for name in interpreters.AVAILABLE if name != "cpython"])
def test_the_loop_allocates_nothing_while_moving(name: str, tmp_path: Path) -> None:
    """2000 turns with the heap locked: samples, status, resending, refusals, noise."""
    output = interpreters.run(name, SCRIPTS / "turns_locked.py", str(tmp_path / "flash"))
    taken, first, sent = map(int, output.split())
    assert taken > 195
    assert 0 < first < taken
    assert sent > 200 * 40
