"""The run folder of a sequence: what ran, each row as it passed, each sample with its row.

::

    run.json        what ran, when, on which board; its rows in words; how it ended; the columns' meaning
    sequence.json   the plan, if it is known
    arm.json        else the arm
    leg-01.bin      what the board replayed, a file a motion
    rows.csv        one line a row when it began
    samples.csv     one line a sample

As in ``run_folder`` lines are flushed one by one: after a power failure they say where the sequence stood.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from armtempo.link.board_messages import RowBegun, Sample, SequenceState
from armtempo.report import run_folder
from armtempo.report.run_folder import BROKEN, INTERRUPTED, RUNNING, JointScale

FORMAT = "armtempo sequence run"
VERSION = 1
SEQUENCE = "sequence.json"
ROWS, SAMPLES = "rows.csv", "samples.csv"
ROW_COLUMNS = {
    "passed": "how many rows had begun since the start, with this one; a jump is a gap",
    "time_s": "when it was heard of, by the host's clock, seconds since the start",
    "run": "the board's number of the motion that ran last; of this row, where it moves",
    "row": "number of the row in run.json, from 0",
    "step": "number of the step in the sequence file, from 1",
    "cycle": "finished passes of the outermost repeats",
    "value": "of the counter, where the row counts",
    "words": "what it does",
}


def leg_file(number: int) -> str:
    """Name of the file of a motion, by its number from 1."""
    return f"leg-{number:02d}.bin"


def sample_columns(joints: Sequence[JointScale]) -> dict[str, str]:
    """Column names of the sample file with their meaning and unit, in order."""
    return {
        "run": "the board's number of the motion's run",
        "row": "number of its row in run.json; empty where the row was not heard of",
        **run_folder.columns(joints),
        "index": "number of the sample in its motion, from 0",
    }


@dataclass
class SequenceFolder:
    """The folder of a sequence that runs; a context, whose end notes how it ended."""

    path: Path
    name: str
    joints: tuple[JointScale, ...]
    words: tuple[str, ...]
    """What each row does."""
    steps: tuple[int, ...]
    """The step of the sequence file that each row comes from."""
    motions: tuple[int, ...]
    """Of each row that moves the number of its motion, from 1; 0 of the others."""
    origin: dict[str, Any] = field(default_factory=dict)
    """Further entries of run.json: port, board, arm, names of the motions."""
    started: str = field(default_factory=run_folder.now)
    state: str = RUNNING
    ended: dict[str, Any] = field(default_factory=dict)

    def __enter__(self) -> Self:
        """Files with their heads."""
        self.write()
        self._files = ExitStack()
        self._rows = self._begun(ROWS, list(ROW_COLUMNS))
        self._samples = self._begun(SAMPLES, list(sample_columns(self.joints)))
        return self

    def _begun(self, name: str, head: list[str]) -> _Lines:
        lines = _Lines(self.path / name)
        self._files.callback(lines.close)
        lines.add(head)
        return lines

    def add_row(self, row: RowBegun, time_s: float) -> None:
        """A row has begun; RunFolderError if that cannot be written."""
        words = self.words[row.row] if row.row < len(self.words) else ""
        numbers = (row.run, row.row, row.step, row.cycle, row.value)
        self._rows.add([str(row.passed), f"{time_s:.3f}", *map(str, numbers), words])

    def add_sample(self, sample: Sample, row: int | None) -> None:
        """A sample has come; RunFolderError if it cannot be written."""
        cells = ["" if row is None else str(row), *run_folder.row(sample, self.joints)]
        self._samples.add([str(sample.run), *cells])

    def end(self, state: SequenceState, fault: str, counters: dict[str, int]) -> None:
        """Note how it ended."""
        self.state = state.ending
        self.ended = {"step": state.step, "cycle": state.cycle, "code": fault, "counters": counters}

    def write(self) -> None:
        """Write run.json anew with what is known now."""
        meta = {
            "format": FORMAT,
            "version": VERSION,
            **run_folder.written_head(self.name, self.started),
            "state": self.state,
            "ended": self.ended,
            "joints": [vars(joint) for joint in self.joints],
            "rows": [
                {"step": step, "motion": motion, "words": words}
                for step, motion, words in zip(self.steps, self.motions, self.words, strict=True)
            ],
            "row_columns": ROW_COLUMNS,
            "columns": sample_columns(self.joints),
            **self.origin,
        }
        run_folder.write_meta(self.path, meta)

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._files.close()
        if self.state == RUNNING:
            self.state = INTERRUPTED if kind is KeyboardInterrupt else BROKEN
        with run_folder.unless(value):
            self.write()


class _Lines:
    """A file of comma separated values, flushed line by line."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with run_folder.writing(path):
            self._file = path.open("x", newline="", encoding="utf-8")
        self._csv = csv.writer(self._file, lineterminator="\n")

    def add(self, cells: Sequence[str]) -> None:
        with run_folder.writing(self._path):
            self._csv.writerow(cells)
            self._file.flush()

    def close(self) -> None:
        self._file.close()
