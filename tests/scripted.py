"""Scripts of cases for several interpreters as tests: one test for each case, each in an interpreter of its own."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from tests import interpreters

HEAP = {"cpython": "", "micropython": "16M", "micropython-arm": "6M"}


EMULATED = "micropython-arm"


@dataclass(frozen=True)
class Case:
    """One case of a script on one interpreter, or several (their names with a space between) one after the other."""

    interpreter: str
    script: Path
    name: str

    def __str__(self) -> str:
        names = "all" if " " in self.name else self.name.removeprefix("case_")
        return f"{self.interpreter}-{self.script.stem}-{names}"

    def run(self, *arguments: str, **options: float | str) -> None:
        """AssertionError with the script's traceback where the case does not hold; options of ``interpreters.run``."""
        options = {"heap": HEAP[self.interpreter], **options}
        named = self.name.split()
        output = interpreters.run(self.interpreter, self.script, *arguments, *named, **options)  # type: ignore[arg-type]
        assert [line.split()[0] for line in output.splitlines() if line.startswith("case_")] == named, output


def names(script: Path) -> list[str]:
    """The cases that a script defines."""
    found = re.findall(r"^def (case_\w+)", script.read_text(), re.MULTILINE)
    assert found, f"{script} has no cases"
    assert len(found) == len(set(found)), f"a case of {script} is defined twice"
    return found


def cases(*scripts: Path, on: Iterable[str] = interpreters.AVAILABLE) -> list[Case]:
    """All cases of some scripts on some interpreters, for ``pytest.mark.parametrize`` with ``ids=str``."""
    return [Case(name, script, case) for name in on for script in scripts for case in names(script)]


def together(found: Iterable[Case]) -> list[Case]:
    """The cases, those of a script in one process where that is the emulator, which takes long to start.

    The other interpreters run each case by itself; the output of a script ends with the case that did not hold.
    """
    kept: dict[tuple[str, Path, str], list[str]] = {}
    for case in found:
        alone = "" if case.interpreter == EMULATED else case.name
        kept.setdefault((case.interpreter, case.script, alone), []).append(case.name)
    return [Case(name, script, " ".join(named)) for (name, script, _), named in kept.items()]
