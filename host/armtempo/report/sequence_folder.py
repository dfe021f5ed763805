"""The run folder of a sequence: what ran, its rows, and its samples.

::

    run.json        what ran, when, on which board; description of the rows; how it ended; meaning of the columns
    sequence.json   the plan, if known
    arm.json        without a plan: the arm
    leg-01.bin      the records that the board replayed, one per motion
    rows.csv        one line per row, written when it begins
    samples.csv     one line per sample

As in ``run_folder`` lines are flushed one by one: after a power failure they show how far the sequence was.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from armtempo.link.board_messages import RowBegun, Sample, SequenceState
from armtempo.report import run_folder
from armtempo.report.run_folder import RUNNING, JointScale, RowFile

FORMAT = "armtempo sequence run"
VERSION = 1
SEQUENCE = "sequence.json"
ROWS, SAMPLES = "rows.csv", "samples.csv"
ROW_COLUMNS = {
    "passed": "number of rows begun since the start, including this one; a jump means lost rows",
    "time_s": "when it was reported, by the host's clock, seconds since the start",
    "run": "the board's run number of the last motion; of this row's, if it moves",
    "row": "number of the row in run.json, from 0",
    "step": "number of the step in the sequence file, from 1",
    "cycle": "finished passes of the outermost repeats",
    "value": "value of the counter, if the row counts",
    "words": "what it does",
}


def leg_file(number: int) -> str:
    """File name of a motion; ``number`` from 1."""
    return f"leg-{number:02d}.bin"


def sample_columns(joints: Sequence[JointScale]) -> dict[str, str]:
    """Columns of the sample file in order: meaning and unit by name."""
    return {
        "run": "the board's number of the motion's run",
        "row": "number of its row in run.json; empty if the row was not reported",
        **run_folder.columns(joints),
        "index": "number of the sample in its motion, from 0",
    }


@dataclass
class SequenceFolder:
    """The folder of a running sequence; the end of the context stores how it ended."""

    path: Path
    name: str
    joints: tuple[JointScale, ...]
    words: tuple[str, ...]
    """Description of each row."""
    steps: tuple[int, ...]
    """The step of the sequence file of each row."""
    motions: tuple[int, ...]
    """Number of each row's motion, from 1; 0 for rows without motion."""
    origin: dict[str, Any] = field(default_factory=dict)
    """More entries of run.json: port, board, arm, names of the motions."""
    started: str = field(default_factory=run_folder.now)
    state: str = RUNNING
    ended: dict[str, Any] = field(default_factory=dict)

    def __enter__(self) -> Self:
        """Open the files and write their headers."""
        self.write()
        self._files = ExitStack()
        self._rows = self._begun(ROWS, ROW_COLUMNS)
        self._samples = self._begun(SAMPLES, sample_columns(self.joints))
        return self

    def _begun(self, name: str, columns: Iterable[str]) -> RowFile:
        file = RowFile(self.path / name, columns)
        self._files.callback(file.close)
        return file

    def add_row(self, row: RowBegun, time_s: float) -> None:
        """A row has begun; raises RunFolderError if it cannot be written."""
        words = self.words[row.row] if row.row < len(self.words) else ""
        numbers = (row.run, row.row, row.step, row.cycle, row.value)
        self._rows.add([str(row.passed), f"{time_s:.3f}", *map(str, numbers), words])

    def add_sample(self, sample: Sample, row: int | None) -> None:
        """A sample has arrived; raises RunFolderError if it cannot be written."""
        cells = ["" if row is None else str(row), *run_folder.row(sample, self.joints)]
        self._samples.add([str(sample.run), *cells])

    def end(self, state: SequenceState, fault: str, counters: dict[str, int]) -> None:
        """Store how it ended."""
        self.state = state.ending
        self.ended = {"step": state.step, "cycle": state.cycle, "code": fault, "counters": counters}

    def write(self) -> None:
        """Write run.json again."""
        meta = {
            "format": FORMAT,
            "version": VERSION,
            **run_folder.written_head(self.name, self.started),
            "state": self.state,
            "ended": self.ended,
            "joints": [joint.values for joint in self.joints],
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
            self.state = run_folder.end_without_board(kind)
        with run_folder.unless(value):
            self.write()
