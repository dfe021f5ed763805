"""Scripts of cases for several interpreters as tests: one test for each case, each in an interpreter of its own."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from tests import interpreters

HEAP = {"cpython": "", "micropython": "16M", "micropython-arm": "6M"}


@dataclass(frozen=True)
class Case:
    """One case of a script on one interpreter."""

    interpreter: str
    script: Path
    name: str

    def __str__(self) -> str:
        return f"{self.interpreter}-{self.script.stem}-{self.name.removeprefix('case_')}"

    def run(self, *arguments: str, **options: float | str) -> None:
        """AssertionError with the script's traceback where the case does not hold; options of ``interpreters.run``."""
        options = {"heap": HEAP[self.interpreter], **options}
        output = interpreters.run(self.interpreter, self.script, *arguments, self.name, **options)  # type: ignore[arg-type]
        assert output.splitlines()[-1].split()[:1] == [self.name], output


def names(script: Path) -> list[str]:
    """The cases that a script defines."""
    found = re.findall(r"^def (case_\w+)", script.read_text(), re.MULTILINE)
    assert found, f"{script} has no cases"
    assert len(found) == len(set(found)), f"a case of {script} is defined twice"
    return found


def cases(*scripts: Path, on: Iterable[str] = interpreters.AVAILABLE) -> list[Case]:
    """All cases of some scripts on some interpreters, for ``pytest.mark.parametrize`` with ``ids=str``."""
    return [Case(name, script, case) for name in on for script in scripts for case in names(script)]
