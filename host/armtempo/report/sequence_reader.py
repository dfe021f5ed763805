"""Reading the run folder of a sequence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from armtempo_shared.sequence import MAX_MOTIONS
from numpy.typing import NDArray

from armtempo.basics.arguments import checked
from armtempo.basics.errors import ArmtempoError, RunFolderError
from armtempo.basics.text import visible
from armtempo.encoding import decode
from armtempo.report import run_reader
from armtempo.report.run_folder import JointScale, transmission
from armtempo.report.run_reader import RESTORE, RepetitionData
from armtempo.report.sequence_folder import FORMAT, ROWS, SAMPLES, VERSION, leg_file
from armtempo.splines.trajectory import Trajectory

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
        meta = run_reader.description(folder)
        run_reader.check_version(folder, meta, FORMAT, VERSION)
        try:
            joints = run_reader.scales(meta)
            meta |= {key: visible(str(meta[key])) for key in ("name", "started", "state")}
            meta |= {"rows": [_described(row) for row in meta["rows"]], "ended": _ended(meta["ended"])}
            rows = tuple(_row(cells) for cells in run_reader.whole_lines(folder / ROWS))
            lines = run_reader.whole_lines(folder / SAMPLES)
            samples = run_reader.parsed(folder / SAMPLES, str(meta["state"]), joints, lines)
            run = np.array([run_reader.whole(line["run"]) for line in lines], dtype=np.int64)
            row = np.array([run_reader.whole(line["row"] or _UNKNOWN) for line in lines], dtype=np.int64)
            if row.size and row.max() >= len(meta["rows"]):
                raise ValueError("a sample of a row that does not exist")
        except OSError as error:
            raise RunFolderError(f"{folder}: cannot be read: {error.strerror}", RESTORE) from error
        except (LookupError, TypeError, ValueError) as error:
            raise run_reader.wrong(folder, error) from error
        return cls(folder, meta, joints, rows, samples, run, row)

    @property
    def name(self) -> str:
        """The sequence's name on the board."""
        return str(self.meta["name"])

    @property
    def state(self) -> str:
        """How it ended, by the board; ``interrupted`` or ``broken`` if the host did not receive that."""
        return str(self.meta["state"])

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
                found.append(
                    decode.trajectory(path.read_bytes(), transmission(self.joints), f"motion {number}")
                )
            except OSError as error:
                raise RunFolderError(f"{path}: cannot be read: {error.strerror}", RESTORE) from error
            except ArmtempoError as error:
                raise RunFolderError(f"{path}: {error.problem}", RESTORE) from error
        return tuple(found)


def is_sequence_run(folder: Path) -> bool:
    """Whether a folder is that of a recorded sequence; False if it cannot be read."""
    try:
        return run_reader.description(folder).get("format") == FORMAT
    except RunFolderError:
        return False


def _described(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row of run.json."""
    found = {"step": run_reader.whole(row["step"]), "motion": run_reader.whole(row["motion"])}
    if not 0 <= found["motion"] <= MAX_MOTIONS:
        raise ValueError(f"there is no motion {found['motion']}")
    return {**found, "words": visible(str(row["words"]))}


def _ended(ended: Mapping[str, Any]) -> dict[str, Any]:
    """The end in run.json; empty if the host did not receive it."""
    if not ended:
        return {}
    return {
        "step": run_reader.whole(ended["step"]),
        "cycle": run_reader.whole(ended["cycle"]),
        "code": visible(str(ended["code"])),
        "counters": {
            visible(name): run_reader.whole(value) for name, value in dict(ended["counters"]).items()
        },
    }


def _row(cells: Mapping[str, str]) -> RowPassed:
    run, row, step, cycle, value = (
        run_reader.whole(cells[name]) for name in ("run", "row", "step", "cycle", "value")
    )
    time_s, words = run_reader.finite(cells["time_s"]), visible(cells["words"])
    return RowPassed(run_reader.whole(cells["passed"]), time_s, run, row, step, cycle, value, words)
