"""The runs of a comparison in one file, a line each, so that an interrupted one can go on.

``runs.jsonl``: the first line says what was compared, every other line is one finished run, written at
once. A line that was cut off when the machine stopped is dropped; nothing else can be lost.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from armtempo.basics.errors import InputError
from armtempo.basics.version import installed_version
from armtempo.research.bench.cases import Case, Problem, Trial

FILE = "runs.jsonl"


class ResultStore:
    """The runs kept in a folder; ``runs`` holds what is there, by case."""

    def __init__(self, folder: Path, problem: Problem) -> None:
        """Open or create the file. Raises InputError where it holds runs of another problem."""
        self.path = folder / FILE
        self.runs: dict[Case, Trial] = {}
        head = _plain({"armtempo": installed_version(), **asdict(problem)})
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lines = self._whole_lines()
            if lines:
                self._read(lines, head)
            else:
                self._append(head)
        except OSError as error:
            raise InputError(
                f"{self.path}: cannot be used: {error.strerror}", "choose another --out"
            ) from None

    def add(self, run: Trial) -> None:
        """Appends a finished run by one write."""
        self._append(asdict(run))
        self.runs[run.case] = run

    def _append(self, content: Mapping[str, Any]) -> None:
        line = json.dumps(content, separators=(",", ":")) + "\n"
        with open(self.path, "ab", buffering=0) as file:
            file.write(line.encode())
            os.fsync(file.fileno())

    def _whole_lines(self) -> list[bytes]:
        """All lines that end; what follows the last line end is cut off the file."""
        if not self.path.exists():
            return []
        content = self.path.read_bytes()
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            os.truncate(self.path, whole)
        return content[:whole].splitlines()

    def _read(self, lines: list[bytes], head: dict[str, Any]) -> None:
        try:
            found, *rest = [json.loads(line) for line in lines]
            differ = [name for name in head if found.get(name) != head[name]]
            runs = [_run(content) for content in rest]
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise InputError(f"{self.path}: not a file of runs ({error})", "choose another --out") from None
        if differ:
            raise InputError(
                f"{self.path}: holds runs of another problem, it differs in {', '.join(differ)}",
                "choose another --out, or remove the file",
            )
        self.runs = {run.case: run for run in runs}


def _run(content: dict[str, Any]) -> Trial:
    (first, best), *rest = content["improvements"]
    return Trial(
        Case(**content["case"]),
        tuple(content["intervals_s"]),
        int(content["evaluations"]),
        float(content["seconds"]),
        tuple((int(iteration), float(value)) for iteration, value in [(first, best), *rest]),
    )


def _plain(content: dict[str, Any]) -> dict[str, Any]:
    """``content`` after a round trip through JSON."""
    plain: dict[str, Any] = json.loads(json.dumps(content))
    return plain
