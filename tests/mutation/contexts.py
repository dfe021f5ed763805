"""Which test runs a line, by coverage.py: a plugin of pytest that names the test under way, and what was found.

coverage.py starts in every Python that has its variable: in the workers, and in virtual boards and scripts of cases on
CPython, which take the test's name from pytest's variable.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import coverage

from tests.interpreters import ROOT

KEPT = ROOT / ".cache" / "mutation"
SETTINGS = KEPT / "coverage.ini"
LEFT_OUT = (
    "not micropython-arm and not cut_off and not test_examples and not test_first_hour"
    " and not test_recovery and not test_speed and not cpython-engine"
)
"""The emulator, the slowest, and those that build or install."""
_CALL = re.compile(r"^([\d.]+)s (?:call|setup) +(tests/\S.*)$", re.MULTILINE)
_SETTINGS = """\
[run]
parallel = true
sigterm = true
data_file = {kept}/lines
source =
    {root}/host/armtempo
    {root}/shared/armtempo_shared
    {root}/board/armtempo_board
context = ${{PYTEST_CURRENT_TEST-}}
disable_warnings = no-data-collected, module-not-imported, no-sysmon, already-imported, module-not-measured
"""


def pytest_runtest_logstart(nodeid: str) -> None:
    """From here on lines are this test's."""
    measured = coverage.Coverage.current()
    if measured is not None:
        measured.switch_context(nodeid)


@dataclass(frozen=True)
class Known:
    """Tests that run a line, and seconds that each takes."""

    data: coverage.CoverageData
    seconds: dict[str, float]

    def running(self, path: Path, lines: set[int]) -> list[str]:
        """Tests that run any of the lines, quickest first."""
        by_line = self.data.contexts_by_lineno(str(ROOT / path))
        found = {test_of(context) for line in lines for context in by_line.get(line, ())}
        return self.quickest(found & self.seconds.keys())

    def quickest(self, tests: set[str]) -> list[str]:
        """By the time that they take; the same case on MicroPython instead of CPython, which takes longer."""
        twins = {test.replace("[cpython-", "[micropython-") for test in tests}
        gone = {test for test in tests if test.replace("[cpython-", "[micropython-") in self.seconds}
        return sorted(
            twins & self.seconds.keys() | (tests - gone), key=lambda test: (self.seconds[test], test)
        )


def test_of(context: str) -> str:
    """The test of a context: of the process itself, of the plugin, or both."""
    own, _, named = context.rpartition("|")
    return named if "::" in named else re.sub(r" \(\w+\)$", "", own or named)


def load() -> Known:
    """As last measured; measured now if it never was."""
    if not (KEPT / "seconds.json").exists():
        measure(["tests"])
    data = coverage.CoverageData(str(KEPT / "lines"))
    data.read()
    return Known(data, json.loads((KEPT / "seconds.json").read_text()))


def measure(tests: list[str]) -> None:
    """Run the tests with coverage.py in two processes; what was known is forgotten."""
    KEPT.mkdir(parents=True, exist_ok=True)
    for old in KEPT.glob("lines*"):
        old.unlink()
    SETTINGS.write_text(_SETTINGS.format(root=ROOT, kept=KEPT))
    command = [sys.executable, "-m", "pytest", "-q", "-n", "2", "-p", "tests.mutation.contexts"]
    command += ["--dist", "loadfile", "--durations=0", "-vv", "-k", LEFT_OUT, *tests]
    environment = {**os.environ, "COVERAGE_PROCESS_START": str(SETTINGS), "OPENBLAS_NUM_THREADS": "1"}
    said = subprocess.run(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True).stdout
    seconds: dict[str, float] = {}
    for took_s, test in _CALL.findall(said):
        seconds[test] = seconds.get(test, 0.0) + float(took_s)
    failed = set(re.findall(r"^(?:FAILED|ERROR) (\S+)", said, re.MULTILINE))
    combined = coverage.Coverage(data_file=str(KEPT / "lines"), config_file=str(SETTINGS))
    combined.combine()
    combined.save()
    kept = {test: took_s for test, took_s in seconds.items() if test not in failed}
    (KEPT / "seconds.json").write_text(json.dumps(kept))


if __name__ == "__main__":
    measure(sys.argv[1:] or ["tests"])
