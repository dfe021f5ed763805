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


@pytest.mark.parametrize("name", interpreters.AVAILABLE)
def test_cases(name: str, tmp_path: Path) -> None:
    """Each case asserts by itself and prints its name when it holds."""
    script = SCRIPTS / "app_cases.py"
    lines = interpreters.run(name, script, f"{tmp_path}/flash").splitlines()
    wanted = sorted(re.findall(r"def (case_\w+)", script.read_text()))
    assert lines == wanted
