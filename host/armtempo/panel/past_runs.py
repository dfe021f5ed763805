"""The recorded runs in a folder, those of the command line among them, and their reports."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from armtempo import pipeline
from armtempo.basics.errors import RunFolderError
from armtempo.panel import words
from armtempo.report.run import Run
from armtempo.report.run_folder import META
from armtempo.report.sequence_folder import FORMAT as SEQUENCE
from armtempo.report.sequence_reader import SequenceRun

REPORT_PAGE = "report.html"
_known: dict[Path, tuple[int, PastRun]] = {}
"""What was read, with the time of its file."""


@dataclass(frozen=True)
class PastRun:
    """A row of the list."""

    folder: Path
    date: str
    duration: str
    ending: str


def listed(folder: Path) -> list[PastRun]:
    """The runs in a folder, the newest first."""
    found = [(file.stat().st_mtime_ns, file) for file in folder.glob(f"*/{META}")]
    return [_read(file, changed_ns) for changed_ns, file in sorted(found, reverse=True)]


def _read(file: Path, changed_ns: int) -> PastRun:
    if (known := _known.get(file)) is None or known[0] != changed_ns:
        _known[file] = known = changed_ns, _row(file)
    return known[1]


def _row(file: Path) -> PastRun:
    try:
        meta: Any = json.loads(file.read_text(encoding="utf-8"))
        date = datetime.fromisoformat(meta["started"]).astimezone().strftime("%Y-%m-%d %H:%M")
        if meta.get("format") == SEQUENCE:
            return PastRun(file.parent, date, "", str(meta.get("ending", "")))
        made = meta["repetitions"]
        whole_s = sum(float(one["duration_s"]) for one in made)
        ending = next(
            (one["fault"] or one["state"] for one in made if one["state"] != "complete"), "complete"
        )
        return PastRun(file.parent, date, f"{whole_s:.1f} s", ending)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return PastRun(file.parent, "", "", words.UNREADABLE)


def report(folder: Path) -> Path:
    """Write the report of a run; returns the page. Raises RunFolderError if it cannot be read."""
    try:
        meta: Any = json.loads((folder / META).read_text(encoding="utf-8"))
        is_sequence = meta["format"] == SEQUENCE
    except (OSError, ValueError, KeyError, TypeError):
        raise RunFolderError(f"{folder.name}: its {META} cannot be read", "restore it from a copy") from None
    return pipeline.report(SequenceRun.load(folder) if is_sequence else Run.load(folder))
