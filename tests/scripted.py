"""Scripts of cases for several interpreters as tests: one test for each script and interpreter, or for each case.

A comment behind ``def case_…():`` says where a case runs: ``slow``, ``slow on CPython``, ``not emulated``, ``not on
CPython``. A line ``# all cases: …`` says it of a whole script, and ``emulated`` or ``on CPython`` makes an exception.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

from tests import interpreters

HEAP = {"cpython": "", "micropython": "16M", "micropython-arm": "6M"}
NOT_ON = {"micropython-arm": "not emulated", "cpython": "not on CPython"}
EMULATED = "micropython-arm"
_SHORT = {"memory", "rings"}
"""Scripts on what depends on the width of words first of all; the others are long in the emulator."""


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
        """AssertionError with the script's traceback if the case does not hold; options of ``interpreters.run``."""
        options = {"heap": HEAP[self.interpreter], **options}
        named = self.name.split()
        output = interpreters.run(self.interpreter, self.script, *arguments, *named, **options)  # type: ignore[arg-type]
        assert [line.split()[0] for line in output.splitlines() if line.startswith("case_")] == named, output


@cache
def tags(script: Path) -> dict[str, set[str]]:
    """The cases that a script defines, with what comments say of each."""
    text = script.read_text()
    common = _words(re.search(r"^# all cases: (.*)$", text, re.MULTILINE))
    found = {}
    for match in re.finditer(r"^def (case_\w+)\(.*\):(?:  # (.*))?$", text, re.MULTILINE):
        assert match[1] not in found, f"{match[1]} of {script} is defined twice"
        own = _words(match, 2)
        found[match[1]] = {word for word in common if word.removeprefix("not ") not in own} | own
    assert found, f"{script} has no cases"
    return found


def _words(match: re.Match[str] | None, group: int = 1) -> set[str]:
    return set(match[group].split(", ")) if match and match[group] else set()


def cases(*scripts: Path, on: Iterable[str] = interpreters.AVAILABLE) -> list[Case]:
    """The cases of some scripts on some interpreters, those that are to run there."""
    return [
        Case(name, script, case)
        for name in on
        for script in scripts
        for case, said in tags(script).items()
        if NOT_ON.get(name) not in said
    ]


def each(found: Iterable[Case]) -> pytest.MarkDecorator:
    """A test for each case, as its argument ``case``; in the emulator and if a comment says so it is slow.

    Long is what takes long in the emulator, and what is slow everywhere.
    """
    return pytest.mark.parametrize(
        "case", [pytest.param(case, id=str(case), marks=_marks(case)) for case in found]
    )


def _marks(case: Case) -> list[pytest.MarkDecorator]:
    said = set().union(*(tags(case.script)[name] for name in case.name.split()))
    is_long = "slow" in said or (case.interpreter == EMULATED and case.script.stem not in _SHORT)
    on_cpython = case.interpreter == "cpython" and "slow on CPython" in said
    is_slow = case.interpreter == EMULATED or on_cpython
    return [pytest.mark.long] if is_long else [pytest.mark.slow] * is_slow


def together(found: Iterable[Case]) -> list[Case]:
    """The cases, those of a script that are marked alike in one process: its start takes longer than most of them.

    The output of a script ends with the case that did not hold.
    """
    kept: dict[tuple[object, ...], list[str]] = {}
    for case in found:
        marks = tuple(mark.name for mark in _marks(case))
        kept.setdefault((case.interpreter, case.script, marks), []).append(case.name)
    return [Case(name, script, " ".join(named)) for (name, script, _), named in kept.items()]  # type: ignore[arg-type]
