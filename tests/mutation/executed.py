"""Which tests execute a line, and how long each takes: traced once for a state of the sources, kept in the cache."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

from tests.interpreters import ROOT
from tests.mutation import tracer

KEPT = ROOT / ".cache" / "executed.jsonl"
LEFT_OUT = (
    "not micropython-arm and not cut_off and not test_demo and not test_examples and not test_wheel"
    " and not test_first_hour and not test_recovery and not test_site and not test_speed and not cpython-engine"
)
"""The emulator, the slowest, and those that build or install."""


@dataclass
class Executed:
    """Lines by file by test, and seconds by test."""

    lines: dict[str, dict[str, set[int]]] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    def add(self, path: Path) -> None:
        """What one process wrote, or what was kept."""
        known: dict[str, set[int]] = {}
        with path.open(encoding="utf-8") as file:
            for line in file:
                read = json.loads(line)
                if "test" in read:
                    known = self.lines.setdefault(read["test"], {})
                elif "path" in read:
                    known.setdefault(read["path"], set()).update(read["lines"])
                else:
                    self.seconds[read["of"]] = self.seconds.get(read["of"], 0.0) + read["seconds"]

    def save(self) -> None:
        """In the cache."""
        with KEPT.open("w", encoding="utf-8") as file:
            for test, files in self.lines.items():
                print(json.dumps({"test": test}), file=file)
                for name, lines in files.items():
                    print(json.dumps({"path": name, "lines": sorted(lines)}), file=file)
            for test, seconds in self.seconds.items():
                print(json.dumps({"of": test, "seconds": seconds}), file=file)

    def forget(self, paths: list[str]) -> None:
        """What is known of the tests of these files, or below these folders."""
        for kept in (self.lines, self.seconds):
            for test in [test for test in kept if test.startswith(tuple(paths))]:
                del kept[test]


def load() -> Executed:
    """As last traced; traced now where it never was."""
    found = Executed()
    if KEPT.exists():
        found.add(KEPT)
    else:
        trace(["tests"], found)
    return found


def trace(tests: list[str], into: Executed) -> None:
    """Run the tests with the tracer, in two processes, and keep what they execute."""
    into.forget(tests)
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, tracer.FOLDER: folder, "OPENBLAS_NUM_THREADS": "1"}
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-p",
            "tests.mutation.tracer",
            "-p",
            "no:cacheprovider",
        ]
        command += ["-n", "2", "--dist", "loadfile", "-k", LEFT_OUT, *tests]
        subprocess.run(command, cwd=ROOT, env=environment, check=False)
        for path in Path(folder).glob("*.lines"):
            into.add(path)
    into.save()


if __name__ == "__main__":
    EXECUTED = Executed()
    if KEPT.exists():
        EXECUTED.add(KEPT)
    trace(sys.argv[1:] or ["tests"], EXECUTED)
