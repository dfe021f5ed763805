"""Reading the run folder of a sequence."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arguments import checked
from armtempo.basics.errors import ArmtempoError, RunFolderError
from armtempo.basics.text import visible
from armtempo.records import decode
from armtempo.report import run_reader
from armtempo.report.run_folder import META, JointScale
from armtempo.report.run_reader import RepetitionData
from armtempo.report.sequence_folder import FORMAT, ROWS, SAMPLES, VERSION, leg_file
from armtempo.splines.trajectory import Trajectory

_RESTORE = "restore the folder from a copy, or run again"
_UNKNOWN = -1


@dataclass(frozen=True)
class RowPassed:
    """A row of the sequence that has begun."""

    passed: int
    """Number of rows begun, including this one; a jump means lost rows."""
    time_s: float
    """Seconds since the start, by the host's clock."""
    run: int
    row: int
    """From 0."""
    step: int
    """Step of the sequence file, from 1."""
    cycle: int
    value: int
    """Value of the counter, if the row counts."""
    words: str


@checked
@dataclass(frozen=True, eq=False)
class SequenceRun:
    """A recorded sequence, also an interrupted one."""

    path: Path
    meta: Mapping[str, Any]
    """Content of run.json."""
    joints: tuple[JointScale, ...]
    rows: tuple[RowPassed, ...]
    samples: RepetitionData
    """All samples in the order of arrival; ``index`` counts from 0 in each run of a motion."""
    run: NDArray[np.int64]
    """(N,): the board's run number of each sample."""
    row: NDArray[np.int64]
    """(N,): the row of each sample; -1 if that was not reported."""

    @classmethod
    def load(cls, path: Path | str) -> SequenceRun:
        """Read the folder of a recorded sequence; raises RunFolderError if it is none or inconsistent."""
        folder = Path(path)
        meta = _meta(folder / META)
        try:
            joints = tuple(run_reader.scale(**joint) for joint in meta["joints"])
            rows = tuple(_row(cells) for cells in run_reader.whole_lines(folder / ROWS))
            lines = run_reader.whole_lines(folder / SAMPLES)
            samples = run_reader.parsed(folder / SAMPLES, str(meta["state"]), joints, lines)
            run = np.array([int(line["run"]) for line in lines], dtype=np.int64)
            row = np.array([int(line["row"] or _UNKNOWN) for line in lines], dtype=np.int64)
            motions = [int(entry["motion"]) for entry in meta["rows"]]
            if row.size and row.max() >= len(motions):
                raise ValueError("a sample of a row that does not exist")
        except OSError as error:
            raise RunFolderError(f"{folder}: cannot be read: {error.strerror}", _RESTORE) from error
        except (KeyError, TypeError, ValueError) as error:
            raise RunFolderError(f"{folder}: {error} is missing or wrong", _RESTORE) from error
        return cls(folder, meta, joints, rows, samples, run, row)

    @property
    def name(self) -> str:
        """The sequence's name on the board."""
        return visible(str(self.meta["name"]))

    @property
    def state(self) -> str:
        """How it ended, by the board; ``interrupted`` or ``broken`` if the host did not receive that."""
        return visible(str(self.meta["state"]))

    @property
    def last(self) -> RowPassed | None:
        """The last reported row, which shows how far it was at a power failure; None if there is none."""
        return self.rows[-1] if self.rows else None

    @property
    def rows_lost(self) -> int:
        """Number of rows before the last reported one that were not reported."""
        return self.rows[-1].passed - len(self.rows) if self.rows else 0

    def motion_of(self, row: int) -> int:
        """Number of a row's motion, from 1; 0 without motion."""
        return int(self.meta["rows"][row]["motion"])

    @cached_property
    def legs(self) -> tuple[Trajectory, ...]:
        """Its motions, from the board's records; raises RunFolderError if one cannot be read."""
        count = max((int(entry["motion"]) for entry in self.meta["rows"]), default=0)
        found = []
        for number in range(1, count + 1):
            path = self.path / leg_file(number)
            try:
                found.append(decode.trajectory(path.read_bytes(), self.joints, f"motion {number}"))
            except OSError as error:
                raise RunFolderError(f"{path}: cannot be read: {error.strerror}", _RESTORE) from error
            except ArmtempoError as error:
                raise RunFolderError(f"{path}: {error.problem}", _RESTORE) from error
        return tuple(found)


def is_sequence_run(folder: Path) -> bool:
    """Whether a folder is that of a recorded sequence; False if it cannot be read."""
    try:
        return bool(json.loads((folder / META).read_text(encoding="utf-8"))["format"] == FORMAT)
    except (OSError, ValueError, LookupError, TypeError):
        return False


def _meta(path: Path) -> dict[str, Any]:
    try:
        meta = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise RunFolderError(f"{path}: cannot be read: {error}", _RESTORE) from error
    if not isinstance(meta, dict) or meta.get("format") != FORMAT:
        raise RunFolderError(f"{path}: not the description of a recorded sequence", "give a folder of one")
    if meta.get("version") != VERSION:
        raise RunFolderError(
            f"{path}: version {meta.get('version')}; this armtempo reads {VERSION}",
            "update armtempo, or read it with the version that wrote it",
        )
    return meta


def _row(cells: Mapping[str, str]) -> RowPassed:
    run, row, step, cycle, value = (int(cells[name]) for name in ("run", "row", "step", "cycle", "value"))
    time_s, words = float(cells["time_s"]), visible(cells["words"])
    return RowPassed(int(cells["passed"]), time_s, run, row, step, cycle, value, words)
