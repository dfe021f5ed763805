"""The recorded runs in a folder, those of the command line among them, and their reports."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from threading import Lock
from typing import Any

from armtempo import pipeline
from armtempo.basics.errors import RunFolderError
from armtempo.panel import words
from armtempo.report.run import Run
from armtempo.report.run_folder import META
from armtempo.report.sequence_folder import FORMAT as SEQUENCE_FORMAT
from armtempo.report.sequence_reader import SequenceRun

REPORT_PAGE = "report.html"
_known: dict[Path, tuple[int, PastRun]] = {}
"""What was read, with the time of its file."""
_making = Lock()
"""Pages are made one at a time: two that are asked for at once may be the same file."""


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
        if meta.get("format") == SEQUENCE_FORMAT:
            return PastRun(file.parent, date, "", str(meta["state"]))
        made = meta["repetitions"]
        whole_s = sum(float(one["duration_s"]) for one in made)
        ending = next(
            (one["fault"] or one["state"] for one in made if one["state"] != "complete"), "complete"
        )
        return PastRun(file.parent, date, f"{whole_s:.1f} s", str(ending))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return PastRun(file.parent, "", "", words.UNREADABLE)


def report(runs: Path, name: str) -> bytes:
    """The report of a run, which is made if there is none since the run was written.

    Raises RunFolderError if there is no such run, or it cannot be read.
    """
    with _making:
        (folder,) = _folders(runs, [name])
        page, changed_ns = folder / REPORT_PAGE, (folder / META).stat().st_mtime_ns
        if not page.is_file() or page.stat().st_mtime_ns < changed_ns:
            _write_report(folder)
            os.utime(page, ns=(changed_ns, changed_ns))  # older than a run that was written again meanwhile
        return page.read_bytes()


def comparison(runs: Path, names: Sequence[str]) -> bytes:
    """The page that compares runs. Raises RunFolderError if one does not exist, or fewer than two can be read."""
    with _making:
        return pipeline.compare(_folders(runs, names)).read_bytes()


def _folders(runs: Path, names: Sequence[str]) -> list[Path]:
    there = {file.parent.name: file.parent for file in runs.glob(f"*/{META}")}
    if missing := [name for name in names if name not in there]:
        raise RunFolderError(f"there is no run {missing[0]!r}", "choose one of the list")
    return [there[name] for name in names]


def _write_report(folder: Path) -> None:
    try:
        meta: Any = json.loads((folder / META).read_text(encoding="utf-8"))
        is_sequence = meta["format"] == SEQUENCE_FORMAT
    except (OSError, ValueError, KeyError, TypeError):
        raise RunFolderError(f"{folder.name}: its {META} cannot be read", "restore it from a copy") from None
    pipeline.report(SequenceRun.load(folder) if is_sequence else Run.load(folder))
