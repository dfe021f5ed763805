"""The run folder: what was run and what was measured; readable at any time during the run.

A run is a list of legs, the motions that the board replayed: one for a motion, all of them for a sequence.

::

    run.json          what ran, when, on which board; legs and rows; how each repetition ended; meaning of the columns
    trajectory.json   the plan of a motion, if known
    sequence.json     the plan of a sequence, if known
    arm.json          without a plan: the arm
    leg-01.bin        the records that the board replayed, one per leg
    samples-01.csv    one file per repetition, one line per sample (see ``columns``)
    rows-01.csv       of a sequence: one line per row, written when it begins (see ``ROW_COLUMNS``)

``run.json`` is replaced as a whole; lines are flushed one by one, so that an interrupted run is readable up to its
last complete line, and after a power failure shows how far a sequence was.
"""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from armtempo_shared import limits
from armtempo_shared.sequence import ENDINGS, FINISHED, MOVE

from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError, RunFolderError
from armtempo.basics.installation import installed_version
from armtempo.link.board_messages import Positions, RowBegun, Sample, SequenceState
from armtempo.link.follow import Gap
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import DEG, PRISMATIC, REVOLUTE, JointUnit, of_type
from armtempo.model.leg import SequenceRow, only_row
from armtempo.model.transmission import Transmission

FORMAT = "armtempo run"
VERSION = 2
META = "run.json"
TRAJECTORY = "trajectory.json"
SEQUENCE = "sequence.json"
PLANS = TRAJECTORY, SEQUENCE
"""The file of the plan: of a job, or of a sequence."""
ARM = "arm.json"
RUNNING, COMPLETE, INTERRUPTED, FAULT, BROKEN = "running", "complete", "interrupted", "fault", "broken"
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
    """File name of a leg's record; ``number`` from 1."""
    return f"leg-{number:02d}.bin"


@dataclass(frozen=True)
class RunLeg:
    """A motion of the run: its name on the board, and the file of its record."""

    name: str
    file: str


@dataclass(frozen=True)
class RunRow:
    """A row of what was run; a motion has one."""

    step: int
    """Step of the sequence file, from 1."""
    leg: int
    """Number of the leg that it runs, from 1; 0 for none."""
    words: str
    """What it does."""


def run_row(row: SequenceRow) -> RunRow:
    """The same row of a plan."""
    return RunRow(row.step, row.number + 1 if row.op == MOVE else 0, row.words)


@dataclass(frozen=True)
class JointScale:
    """Scales of the steps and counts of a joint's motor; ``counts_per_deg`` 0: no encoder."""

    name: str
    steps_per_deg: float
    counts_per_deg: float
    coupling: tuple[float, ...] = ()
    """Of a motor that other joints turn too: its angle by those of all joints."""
    type: str = REVOLUTE
    """Of ``joint_unit.TYPES``; the scales of a sliding joint are per mm."""

    @property
    def unit(self) -> JointUnit:
        """Of its position."""
        return of_type(self.type)

    @property
    def measured_column(self) -> str:
        """What its column of positions by the encoders is called, after its number."""
        return f"{self.unit.what}_{self.unit.name}"

    @property
    def commanded_column(self) -> str:
        """The same of its commanded positions."""
        return f"commanded_{self.unit.name}"

    @property
    def values(self) -> dict[str, Any]:
        """The entry of run.json."""
        found = {name: value for name, value in vars(self).items() if name != "coupling" or value}
        if self.unit is DEG:
            del found["type"]
        return found


def scales(arm: Arm) -> tuple[JointScale, ...]:
    """The scales of an arm's driven joints."""
    rows = arm.coupling or [()] * len(arm.driven)
    return tuple(
        JointScale(
            joint.name,
            joint.motor.steps_per_deg,
            joint.counts_per_deg,
            tuple(row),
            PRISMATIC if joint.slides else REVOLUTE,
        )
        for joint, row in zip(arm.driven, rows, strict=True)
    )


def transmission(joints: Sequence[JointScale]) -> Transmission:
    """From the joints' angles to steps and counts, and back."""
    return Transmission(
        tuple(joint.steps_per_deg for joint in joints),
        tuple(joint.counts_per_deg for joint in joints),
        tuple(joint.coupling for joint in joints) if any(joint.coupling for joint in joints) else (),
    )


def columns(joints: Sequence[JointScale]) -> dict[str, str]:
    """Columns of a sample file in order: meaning and unit by name."""
    found = {
        "index": "number of the sample in its repetition, from 0",
        "ticks": f"motion clock of the board, ticks of 1/{limits.TICK_HZ} s",
        "time_s": "the same in seconds",
        "path_s": "the motion's own time in seconds: behind the clock where the speed was below 100 %",
    }
    measured = transmission(joints).measured
    for number, (joint, seen) in enumerate(zip(joints, measured, strict=True), start=1):
        same = (
            f"{joint.unit.what} of the joint by the steps of all motors"
            if joint.coupling
            else f"the same in {joint.unit.word} of the joint"
        )
        of_motor = " of its motor" if joint.coupling else ""
        found |= {
            f"j{number}_commanded_steps": f"{joint.name}: step pulses made{of_motor}, signed",
            f"j{number}_{joint.commanded_column}": f"{joint.name}: {same}",
        }
        if joint.counts_per_deg:
            found[f"j{number}_counts"] = f"{joint.name}: encoder counts{of_motor}"
        if seen:
            same = same.replace("steps of all motors", "encoders of all motors")
            found[f"j{number}_{joint.measured_column}"] = f"{joint.name}: {same}"
    return found | {
        "run": "the board's number of the motion's run",
        "row": "number of its row in run.json, from 0; empty if the row was not reported",
    }


def cells(sample: Sample, joints: Sequence[JointScale], row: int | None) -> list[str]:
    """One line of a sample file."""
    found = [str(sample.index), str(sample.ticks), f"{sample.ticks / limits.TICK_HZ:.9f}"]
    found.append(f"{sample.path_ticks / limits.TICK_HZ:.9f}")
    gears, positions = transmission(joints), sample.positions
    commanded_deg = gears.angles_of_steps(positions.commanded_steps)
    measured_deg = gears.angles_of_counts(positions.counts)
    for number, joint in enumerate(joints):
        found += [str(positions.commanded_steps[number]), f"{commanded_deg[number]:.6f}"]
        if joint.counts_per_deg:
            found.append(str(positions.counts[number]))
        if gears.measured[number]:
            found.append(f"{measured_deg[number]:.6f}")
    return [*found, str(sample.run), "" if row is None else str(row)]


@dataclass
class Repetition:
    """A repetition in run.json: one start of the motion or sequence."""

    file: str
    state: str = RUNNING
    samples: int = 0
    lost: tuple[Gap, ...] = ()
    """Lost samples."""
    duration_s: float = 0.0
    fault: str = ""
    commanded_steps: tuple[int, ...] = ()
    counts: tuple[int, ...] = ()
    notices: tuple[str, ...] = ()
    """Texts from the board."""
    rows: str = ""
    """File of a sequence's rows; "" for a motion."""
    ended: dict[str, Any] = field(default_factory=dict)
    """Of a sequence: ``step``, ``cycle`` and ``counters`` at its end; empty if the host did not receive it."""

    @property
    def complete(self) -> bool:
        """Whether the motion or sequence reached its end."""
        return self.state in (COMPLETE, ENDINGS[FINISHED])

    def end(self, state: str, fault: str, ticks: int, positions: Positions, lost: tuple[Gap, ...]) -> None:
        """Store the end of a motion."""
        self.state, self.fault, self.lost = state, fault, lost
        self.duration_s = ticks / limits.TICK_HZ
        self.commanded_steps, self.counts = positions.commanded_steps, positions.counts

    def end_rows(
        self,
        state: SequenceState,
        fault: str,
        counters: dict[str, int],
        duration_s: float,
        lost: tuple[Gap, ...],
    ) -> None:
        """Store the end of a sequence."""
        self.state, self.fault, self.duration_s, self.lost = state.ending, fault, duration_s, lost
        self.ended = {"step": state.step, "cycle": state.cycle, "counters": counters}


@dataclass
class RunFolder:
    """A run folder that is being written."""

    path: Path
    name: str
    joints: tuple[JointScale, ...]
    origin: dict[str, Any] = field(default_factory=dict)
    """More entries of run.json: port, board, arm."""
    started: str = field(default_factory=lambda: now())
    legs: tuple[str, ...] = ()
    """Names of the motions on the board; none given: one motion, ``name``."""
    rows: tuple[RunRow, ...] = ()
    """Of a sequence; none given: the motion's."""
    repetitions: list[Repetition] = field(default_factory=list)

    def __post_init__(self) -> None:
        if not self.rows:
            self.legs, self.rows = (self.name,), (run_row(only_row(self.name)),)

    def write(self) -> None:
        """Write run.json again."""
        meta = {
            "format": FORMAT,
            "version": VERSION,
            "armtempo": installed_version(),
            "name": self.name,
            "started": self.started,
            "written": now(),
            "joints": [joint.values for joint in self.joints],
            "legs": [{"name": name, "file": leg_file(number)} for number, name in enumerate(self.legs, 1)],
            "rows": [vars(row) for row in self.rows],
            "columns": columns(self.joints),
            "row_columns": ROW_COLUMNS,
            **self.origin,
            "repetitions": [vars(repetition) for repetition in self.repetitions],
        }
        replace_text(self.path / META, json.dumps(meta, indent=2, ensure_ascii=False) + "\n")

    def write_legs(self, records: Iterable[bytes]) -> None:
        """Write the records that the board replays; raises RunFolderError if that fails."""
        for number, data in enumerate(records, 1):
            path = self.path / leg_file(number)
            with writing(path):
                path.write_bytes(data)

    def begin_repetition(self, with_rows: bool = False) -> Recording:
        """A new sample file, and one for the rows of a sequence, to be used as a context."""
        number = len(self.repetitions) + 1
        rows = f"rows-{number:02d}.csv" if with_rows else ""
        recording = Recording(self, Repetition(f"samples-{number:02d}.csv", rows=rows))
        self.repetitions.append(recording.repetition)
        self.write()
        return recording


class RowFile:
    """A new table in a run folder, whose rows are readable as soon as they are added."""

    def __init__(self, path: Path, columns: Iterable[str]) -> None:
        """Raises RunFolderError if it cannot be written, as ``add`` does."""
        self._path = path
        with writing(path):
            self._file = path.open("x", newline="", encoding="utf-8")
        self._csv = csv.writer(self._file, lineterminator="\n")
        self.add(columns)

    def add(self, cells: Iterable[str]) -> None:
        """Add a row."""
        with writing(self._path):
            self._csv.writerow(cells)
            self._file.flush()

    def close(self) -> None:
        """Close the file; ``add`` has reported what failed."""
        with suppress(OSError):
            self._file.close()


class Recording:
    """The files of a running repetition; leaving the context stores how it ended."""

    def __init__(self, folder: RunFolder, repetition: Repetition) -> None:
        self.repetition = repetition
        self._folder = folder
        with ExitStack() as files:
            self._samples = self._begun(repetition.file, columns(folder.joints), files)
            self._rows = self._begun(repetition.rows, ROW_COLUMNS, files) if repetition.rows else None
            self._files = files.pop_all()

    def _begun(self, name: str, head: Iterable[str], files: ExitStack) -> RowFile:
        file = RowFile(self._folder.path / name, head)
        files.callback(file.close)
        return file

    def append(self, sample: Sample, row: int | None = 0) -> None:
        """Add a sample of a ``row``; raises RunFolderError if it cannot be written, as ``begin_row`` does."""
        self._samples.add(cells(sample, self._folder.joints, row))
        self.repetition.samples += 1

    def begin_row(self, row: RowBegun, time_s: float) -> None:
        """A row of the sequence has begun."""
        rows = self._folder.rows
        words = rows[row.row].words if row.row < len(rows) else ""
        numbers = (row.run, row.row, row.step, row.cycle, row.value)
        if self._rows is not None:
            self._rows.add([str(row.passed), f"{time_s:.3f}", *map(str, numbers), words])

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._files.close()
        if self.repetition.state == RUNNING:
            interrupted = kind is not None and issubclass(kind, KeyboardInterrupt)
            self.repetition.state = INTERRUPTED if interrupted else BROKEN
        try:
            self._folder.write()
        except InputError:
            if value is None:  # otherwise it says more
                raise


@contextmanager
def new_folder(parent: Path, name: str) -> Iterator[Path]:
    """A new folder ``parent/name-001`` (or the next free number), to be filled within this context.

    It is removed again if that fails, for example on a full disk: no folder is left that is none of a run.
    Raises InputError if it cannot be made.
    """
    path = _made(parent, name)
    try:
        yield path
    except BaseException:
        shutil.rmtree(path, ignore_errors=True)
        raise


def _made(parent: Path, name: str) -> Path:
    try:
        for number in range(1, 10_000):
            path = parent / f"{name}-{number:03d}"
            with suppress(FileExistsError):  # another run may make it at this moment
                path.mkdir(parents=True)
                return path
    except OSError as error:
        raise InputError(
            f"{parent}: the run folder cannot be made: {error.strerror}",
            "choose another place with --out",
        ) from error
    raise InputError(f"{parent} holds 9999 runs of {name!r}", "move some away")


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Convert OSError of writing ``path`` to RunFolderError."""
    try:
        yield
    except OSError as error:
        raise RunFolderError(
            f"{path}: cannot be written: {error.strerror}; what came before is kept",
            "free disk space, then run again",
        ) from None


def now() -> str:
    """Date and time, UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")
