"""The run folder: what was run and what was measured; readable at any time during the run.

::

    run.json          what ran, when, on which board; how each repetition ended; meaning of the columns
    trajectory.json   the plan, if known
    arm.json          without a plan: the arm
    motion.bin        the record that the board replayed
    samples-01.csv    one file per repetition, one line per sample (see ``columns``)

``run.json`` is replaced as a whole; sample lines are flushed one by one, so that an interrupted run is readable
up to its last complete line.
"""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from armtempo_shared import limits

from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError, RunFolderError
from armtempo.basics.installation import installed_version
from armtempo.link.board_messages import Positions, Sample
from armtempo.link.follow import Gap
from armtempo.model.arm import Arm
from armtempo.model.transmission import Transmission

FORMAT = "armtempo run"
VERSION = 1
META = "run.json"
TRAJECTORY = "trajectory.json"
ARM = "arm.json"
MOTION = "motion.bin"
RUNNING, COMPLETE, INTERRUPTED, FAULT, BROKEN = "running", "complete", "interrupted", "fault", "broken"


@dataclass(frozen=True)
class JointScale:
    """Scales of the steps and counts of a joint's motor; ``counts_per_deg`` 0: no encoder."""

    name: str
    steps_per_deg: float
    counts_per_deg: float
    coupling: tuple[float, ...] = ()
    """Of a motor that other joints turn too: its angle by those of all joints."""

    @property
    def values(self) -> dict[str, Any]:
        """The entry of run.json."""
        return {name: value for name, value in vars(self).items() if name != "coupling" or value}


def scales(arm: Arm) -> tuple[JointScale, ...]:
    """The scales of an arm's driven joints."""
    rows = arm.coupling or [()] * len(arm.driven)
    return tuple(
        JointScale(joint.name, joint.motor.steps_per_deg, joint.counts_per_deg, tuple(row))
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
            "angle of the joint by the steps of all motors"
            if joint.coupling
            else "the same in degrees of the joint"
        )
        of_motor = " of its motor" if joint.coupling else ""
        found |= {
            f"j{number}_commanded_steps": f"{joint.name}: step pulses made{of_motor}, signed",
            f"j{number}_commanded_deg": f"{joint.name}: {same}",
        }
        if joint.counts_per_deg:
            found[f"j{number}_counts"] = f"{joint.name}: encoder counts{of_motor}"
        if seen:
            same = same.replace("steps of all motors", "encoders of all motors")
            found[f"j{number}_angle_deg"] = f"{joint.name}: {same}"
    return found


def row(sample: Sample, joints: Sequence[JointScale]) -> list[str]:
    """One line of a sample file."""
    cells = [str(sample.index), str(sample.ticks), f"{sample.ticks / limits.TICK_HZ:.9f}"]
    cells.append(f"{sample.path_ticks / limits.TICK_HZ:.9f}")
    gears, positions = transmission(joints), sample.positions
    commanded_deg = gears.angles_of_steps(positions.commanded_steps)
    measured_deg = gears.angles_of_counts(positions.counts)
    for number, joint in enumerate(joints):
        cells += [str(positions.commanded_steps[number]), f"{commanded_deg[number]:.6f}"]
        if joint.counts_per_deg:
            cells.append(str(positions.counts[number]))
        if gears.measured[number]:
            cells.append(f"{measured_deg[number]:.6f}")
    return cells


@dataclass
class Repetition:
    """A repetition in run.json."""

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

    def end(self, state: str, fault: str, ticks: int, positions: Positions, lost: tuple[Gap, ...]) -> None:
        """Store the end of the motion."""
        self.state, self.fault, self.lost = state, fault, lost
        self.duration_s = ticks / limits.TICK_HZ
        self.commanded_steps, self.counts = positions.commanded_steps, positions.counts


@dataclass
class RunFolder:
    """A run folder that is being written."""

    path: Path
    name: str
    joints: tuple[JointScale, ...]
    origin: dict[str, Any] = field(default_factory=dict)
    """More entries of run.json: port, board, arm, checksum of the motion."""
    started: str = field(default_factory=lambda: now())
    repetitions: list[Repetition] = field(default_factory=list)

    def write(self) -> None:
        """Write run.json again."""
        meta = {
            "format": FORMAT,
            "version": VERSION,
            **written_head(self.name, self.started),
            "joints": [joint.values for joint in self.joints],
            "columns": columns(self.joints),
            **self.origin,
            "repetitions": [vars(repetition) for repetition in self.repetitions],
        }
        write_meta(self.path, meta)

    def write_motion(self, data: bytes) -> None:
        """Write the record that the board replays; raises RunFolderError if that fails."""
        with writing(self.path / MOTION):
            (self.path / MOTION).write_bytes(data)

    def begin_repetition(self) -> SampleFile:
        """A new sample file, to be used as a context."""
        repetition = Repetition(f"samples-{len(self.repetitions) + 1:02d}.csv")
        file = SampleFile(self, repetition)
        self.repetitions.append(repetition)
        self.write()
        return file


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


def end_without_board(error: type[BaseException] | None) -> str:
    """The state of what ended before the board said how, by the ``error`` that ended it."""
    return INTERRUPTED if error is not None and issubclass(error, KeyboardInterrupt) else BROKEN


class SampleFile:
    """The sample file of a running repetition; leaving the context stores how it ended."""

    def __init__(self, folder: RunFolder, repetition: Repetition) -> None:
        self.repetition = repetition
        self._folder = folder
        self._rows = RowFile(folder.path / repetition.file, columns(folder.joints))

    def append(self, sample: Sample) -> None:
        """Add a sample; raises RunFolderError if it cannot be written."""
        self._rows.add(row(sample, self._folder.joints))
        self.repetition.samples += 1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._rows.close()
        if self.repetition.state == RUNNING:
            self.repetition.state = end_without_board(kind)
        with unless(value):
            self._folder.write()


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
def unless(error: BaseException | None) -> Iterator[None]:
    """Suppress an InputError after an earlier ``error``, which says more."""
    try:
        yield
    except InputError:
        if error is None:
            raise


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


def written_head(name: str, started: str) -> dict[str, Any]:
    """The entries of any run.json after its format: version, name, start."""
    return {"armtempo": installed_version(), "name": name, "started": started, "written": now()}


def write_meta(folder: Path, meta: dict[str, Any]) -> None:
    """Write run.json into a run folder, atomically."""
    replace_text(folder / META, json.dumps(meta, indent=2, ensure_ascii=False) + "\n")


def now() -> str:
    """Date and time, UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")
