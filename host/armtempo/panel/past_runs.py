"""The recorded runs in a folder, those of the command line among them, and their reports."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from threading import Lock

from armtempo import pipeline
from armtempo.basics.errors import RunFolderError
from armtempo.panel import words
from armtempo.report import run_reader, run_report
from armtempo.report.run_folder import META, RUNNING

_known: dict[Path, tuple[int, PastRun]] = {}
"""What was read, with the time of its file."""
_WRITTEN_S = 60.0
"""Samples of a run that goes on are written more often."""
_making = Lock()
"""Pages are made one at a time: two that are asked for at once may be the same file."""


@dataclass(frozen=True)
class PastRun:
    """A row of the list."""

    folder: Path
    date: str
    duration: str
    ending: str


def listed(folder: Path, most: int) -> list[PastRun]:
    """The newest runs in a folder, at most so many, the newest first."""
    return [_with_end(_read(found / META)) for found in run_reader.folders(folder)[:most]]


def _with_end(run: PastRun) -> PastRun:
    """The run, without the claim that it is running still if nothing is written any more: its program was killed."""
    if run.ending != RUNNING:
        return run
    written_s = max((file.stat().st_mtime for file in run.folder.iterdir()), default=0.0)
    return replace(run, ending=words.NO_END) if time.time() - written_s > _WRITTEN_S else run


def _read(file: Path) -> PastRun:
    changed_ns = file.stat().st_mtime_ns
    if (known := _known.get(file)) is None or known[0] != changed_ns:
        _known[file] = known = changed_ns, _row(file)
    return known[1]


def _row(file: Path) -> PastRun:
    try:
        meta = run_reader.description(file.parent)
        date = datetime.fromisoformat(meta["started"]).astimezone().strftime("%Y-%m-%d %H:%M")
        entries = [run_reader.entry(values) for values in meta["repetitions"]]
    except (RunFolderError, LookupError, ValueError, TypeError):
        return PastRun(file.parent, "", "", words.UNREADABLE)
    whole_s = sum(entry.duration_s for entry in entries)
    cut = [entry for entry in entries if not entry.complete]
    ending = next((entry.fault or entry.state for entry in (*cut, *entries)), "")
    return PastRun(file.parent, date, f"{whole_s:.1f} s" if whole_s else "", ending)


def report(runs: Path, name: str) -> bytes:
    """The report of a run, which is made if there is none since the run was written.

    Raises RunFolderError if there is no such run, or it cannot be read.
    """
    with _making:
        (folder,) = _folders(runs, [name])
        page, changed_ns = folder / run_report.PAGE, (folder / META).stat().st_mtime_ns
        if not page.is_file() or page.stat().st_mtime_ns < changed_ns:
            run_report.write(folder)
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
