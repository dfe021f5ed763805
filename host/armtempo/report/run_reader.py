"""Reading run folders, also those of version 1, which has another layout for motions than for sequences."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armtempo.basics import json_text
from armtempo.basics.arrays import Array
from armtempo.basics.errors import RunFolderError
from armtempo.basics.text import visible
from armtempo.link.follow import Gap
from armtempo.model.joint_unit import REVOLUTE, TYPES
from armtempo.model.leg import only_row
from armtempo.model.transmission import coupling_problem
from armtempo.report.run_folder import (
    FORMAT,
    META,
    PLANS,
    VERSION,
    JointScale,
    Repetition,
    RunLeg,
    RunRow,
    leg_file,
    run_row,
    transmission,
)

_FORMAT_1 = "armtempo sequence run"
"""Format of a sequence's run folder of version 1."""
_UNKNOWN = -1
RESTORE = "restore the folder from a copy, or run again"
_LARGEST = 2.0**53
"""Integers beyond this are not exact as doubles."""
_LONGEST_S = 86_400.0
"""A day; longer than any motion on the board."""


@dataclass(frozen=True)
class RowPassed:
    """A row of a sequence that has begun."""

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


@dataclass(frozen=True)
class RepetitionData:
    """One repetition: N samples of J joints."""

    file: str
    state: str
    """How it ended, see ``run_folder``."""
    index: NDArray[np.int64]
    """(N,), from 0 in each run of a motion; a jump means lost samples."""
    time_s: Array
    """(N,)"""
    path_s: Array
    """(N,), the motion's own time; less than ``time_s`` if the speed was below 100 %."""
    commanded_steps: NDArray[np.int64]
    """(N, J)"""
    commanded_deg: Array
    """(N, J)"""
    angle_deg: Array
    """(N, J), from the encoders; NaN for a joint without one."""
    run: NDArray[np.int64]
    """(N,), the board's number of the motion's run."""
    row: NDArray[np.int64]
    """(N,), the row in run.json; -1 if it was not reported."""
    rows: tuple[RowPassed, ...] = ()
    """The rows of a sequence in the order of their beginning."""
    problem: str = ""
    """Why a file could not be read."""

    def part(self, chosen: NDArray[np.int64], file: str, state: str) -> RepetitionData:
        """Those of its samples that ``chosen`` indexes."""
        return RepetitionData(
            file,
            state,
            self.index[chosen],
            self.time_s[chosen],
            self.path_s[chosen],
            self.commanded_steps[chosen],
            self.commanded_deg[chosen],
            self.angle_deg[chosen],
            self.run[chosen],
            self.row[chosen],
        )


@dataclass(frozen=True)
class RunData:
    """A run folder's content."""

    path: Path
    meta: dict[str, Any]
    joints: tuple[JointScale, ...]
    repetitions: tuple[RepetitionData, ...]
    entries: tuple[Repetition, ...]
    """The repetitions in run.json."""
    legs: tuple[RunLeg, ...] = ()
    rows: tuple[RunRow, ...] = ()

    @property
    def plan_path(self) -> Path | None:
        """The file of the plan, if there is one."""
        return next((path for name in PLANS if (path := self.path / name).is_file()), None)


def load(path: Path) -> RunData:
    """Read a run folder, also of an interrupted run; raises RunFolderError if it is none or inconsistent.

    A repetition whose file is missing or damaged has no samples; ``problem`` says why.
    """
    meta = description(path)
    try:
        joints = scales(meta)
        legs = tuple(_leg(entry) for entry in meta["legs"])
        rows = tuple(_row(entry, len(legs)) for entry in meta["rows"])
        entries = tuple(entry(values) for values in meta["repetitions"])
        meta |= {key: visible(str(meta[key])) for key in ("name", "started")}
    except (LookupError, TypeError, ValueError) as error:
        raise _wrong(path / META, error) from error
    repetitions = tuple(_repetition(path, entry, joints, len(rows)) for entry in entries)
    return RunData(path, meta, joints, repetitions, entries, legs, rows)


def folders(runs: Path) -> list[Path]:
    """The run folders in a folder, the one that was written last first; empty if there is none."""
    found = [(file.stat().st_mtime_ns, file.parent) for file in runs.glob(f"*/{META}")]
    return [folder for _, folder in sorted(found, reverse=True)]


def description(folder: Path) -> dict[str, Any]:
    """The content of a folder's run.json, as of this version.

    Raises RunFolderError if it has none, or it is damaged or of a later version.
    """
    path = folder / META
    try:
        meta = json_text.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RunFolderError(
            f"{folder} is not a run folder: {META}: {error.strerror}",
            "give a folder that 'armtempo run' or 'armtempo fetch' wrote",
        ) from error
    except ValueError as error:
        raise RunFolderError(f"{path}: damaged: {error}", RESTORE) from error
    if not isinstance(meta, dict) or meta.get("format") not in (FORMAT, _FORMAT_1):
        raise RunFolderError(
            f"{path}: not the description of an armtempo run",
            "give a folder that 'armtempo run' or 'armtempo fetch' wrote",
        )
    version = meta.get("version")
    try:
        if version == 1:
            return meta | (_of_sequence_1(meta) if meta["format"] == _FORMAT_1 else _of_motion_1(meta))
    except (LookupError, TypeError, ValueError) as error:
        raise _wrong(path, error) from error
    if version != VERSION:
        raise RunFolderError(
            f"{path}: version {version!r:.20}; this armtempo reads 1 and {VERSION}",
            "update armtempo, or read it with the version that wrote it",
        )
    return meta


def _of_motion_1(meta: Mapping[str, Any]) -> dict[str, Any]:
    """The entries of version 2 for a motion of version 1."""
    name = str(meta["name"])
    return {"legs": [{"name": name, "file": "motion.bin"}], "rows": [vars(run_row(only_row(name)))]}


def _of_sequence_1(meta: Mapping[str, Any]) -> dict[str, Any]:
    """The entries of version 2 for a sequence of version 1."""
    rows = [{"step": row["step"], "leg": row["motion"], "words": row["words"]} for row in meta["rows"]]
    names = meta.get("motions", ())
    legs = [{"name": name, "file": leg_file(number)} for number, name in enumerate(names, 1)]
    ended = dict(meta["ended"])
    entry = {
        "file": "samples.csv",
        "rows": "rows.csv",
        "state": meta["state"],
        "fault": ended.pop("code", ""),
    }
    return {"legs": legs, "rows": rows, "repetitions": [{**entry, "ended": ended}]}


def _wrong(where: Path, error: Exception) -> RunFolderError:
    """The error for content that does not fit: a missing key, or a wrong value."""
    if isinstance(error, KeyError):
        return RunFolderError(f"{where}: {error} is missing", RESTORE)
    what = "a value of the wrong kind: " if isinstance(error, TypeError) else ""
    return RunFolderError(f"{where}: {what}{error}", RESTORE)


def scales(meta: Mapping[str, Any]) -> tuple[JointScale, ...]:
    """The joints' scales in run.json; raises LookupError, TypeError or ValueError if they are wrong."""
    found = tuple(map(_scale, meta["joints"]))
    coupling = tuple(joint.coupling for joint in found if joint.coupling)
    problem = coupling_problem(coupling, [joint.name for joint in found]) if coupling else None
    if problem:
        raise ValueError(problem[0])
    return found


def _scale(joint: Mapping[str, Any]) -> JointScale:
    name = visible(str(joint["name"]))
    row = tuple(map(_finite, joint.get("coupling", ())))
    kind = joint.get("type", REVOLUTE)
    if kind not in TYPES:
        raise ValueError(f"the type of {name!r} is not known")
    found = JointScale(name, _finite(joint["steps_per_deg"]), _finite(joint["counts_per_deg"]), row, kind)
    if not found.steps_per_deg:
        raise ValueError("steps_per_deg is 0")
    return found


def _finite(value: Any) -> float:
    """A number from a file; raises ValueError if it is not finite, or too large to be exact, or none."""
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not abs(number) <= _LARGEST:
        raise ValueError(f"{value!r:.20} is no number that a run can have")
    return number


def _whole(value: Any) -> int:
    """A whole number from a file; raises ValueError if it is too large to be exact, or none."""
    number = _finite(value)
    if number != int(number):
        raise ValueError(f"{value!r:.20} is no whole number")
    return int(number)


def entry(values: Mapping[str, Any]) -> Repetition:
    """A repetition of run.json; raises LookupError, TypeError or ValueError if it is wrong."""
    found = Repetition(_file(values["file"]), visible(str(values["state"])))
    found.rows = _file(values["rows"]) if values.get("rows") else ""
    found.ended = _ended(values.get("ended", {}))
    found.samples = _whole(values.get("samples", 0))
    found.lost = tuple(Gap(_whole(first), _whole(number)) for first, number in values.get("lost", ()))
    found.duration_s = _finite(values.get("duration_s", 0.0))
    found.fault = visible(str(values.get("fault", "")))
    found.commanded_steps = tuple(map(_whole, values.get("commanded_steps", ())))
    found.counts = tuple(map(_whole, values.get("counts", ())))
    if len(found.counts) != len(found.commanded_steps):
        raise ValueError("a repetition has not as many counts as commanded_steps")
    found.notices = tuple(visible(str(text)) for text in values.get("notices", ()))
    return found


def _ended(ended: Mapping[str, Any]) -> dict[str, Any]:
    """The end of a sequence; empty if the host did not receive it."""
    if not ended:
        return {}
    counters = {visible(name): _whole(value) for name, value in dict(ended["counters"]).items()}
    return {"step": _whole(ended["step"]), "cycle": _whole(ended["cycle"]), "counters": counters}


def _leg(values: Mapping[str, Any]) -> RunLeg:
    return RunLeg(visible(str(values["name"])), _file(values["file"]))


def _row(values: Mapping[str, Any], legs: int) -> RunRow:
    found = RunRow(_whole(values["step"]), _whole(values["leg"]), visible(str(values["words"])))
    if not 0 <= found.leg <= legs:
        raise ValueError(f"there is no leg {found.leg}")
    return found


def _file(value: Any) -> str:
    """The name of a file in the folder."""
    found = visible(str(value))
    if Path(found).name != found:
        raise ValueError(f"{found!r} is not the name of a file in the folder")
    return found


def _repetition(folder: Path, entry: Repetition, joints: tuple[JointScale, ...], rows: int) -> RepetitionData:
    """The samples and rows of a repetition."""
    problems = []
    lines: list[dict[str, str]] = []
    passed: tuple[RowPassed, ...] = ()
    try:
        if entry.rows:
            passed = tuple(map(_passed, _whole_lines(folder / entry.rows)))
    except OSError as error:
        problems.append(f"{entry.rows} is missing ({error.strerror})")
    except (LookupError, ValueError) as error:
        problems.append(f"{entry.rows} is damaged ({error})")
    try:
        lines = _whole_lines(folder / entry.file)
        return _parsed(entry, joints, lines, rows, passed, "; ".join(problems))
    except OSError as error:
        problems.append(f"missing ({error.strerror})")
    except ValueError as error:
        problems.append(f"damaged ({error})")
    return _parsed(entry, joints, [], rows, passed, "; ".join(problems))


def _parsed(
    entry: Repetition,
    joints: tuple[JointScale, ...],
    lines: list[dict[str, str]],
    rows: int,
    passed: tuple[RowPassed, ...],
    problem: str,
) -> RepetitionData:
    """The samples in the lines of a file; raises ValueError for a value that is missing, no number, or impossible."""
    table = {name: [line[name] for line in lines] for name in (lines[0] if lines else ())}

    def column(name: str, largest: float) -> Array:
        if lines and name not in table:
            raise ValueError(f"column {name} is missing")
        values = np.array(table.get(name, []), dtype=float)
        if not np.all(np.abs(values) <= largest):
            raise ValueError(f"column {name} has values that no run can have")
        return values

    def joint_columns(names: Sequence[str]) -> Array:
        found = [column(f"j{number}_{name}", _LARGEST) for number, name in enumerate(names, 1)]
        return np.array(found).reshape(len(joints), len(lines)).T

    angle_deg = np.full((len(lines), len(joints)), np.nan)
    for number, seen in enumerate(transmission(joints).measured):
        if seen:
            angle_deg[:, number] = column(f"j{number + 1}_{joints[number].measured_column}", _LARGEST)
    for name in {"run", "row"} - table.keys():  # a motion of version 1
        table[name] = ["0"] * len(lines)
    table["row"] = [text or str(_UNKNOWN) for text in table["row"]]
    row = column("row", _LARGEST).astype(np.int64)
    if row.size and not _UNKNOWN <= row.min() <= row.max() < rows:
        raise ValueError("a sample of a row that does not exist")
    return RepetitionData(
        entry.file,
        entry.state,
        column("index", _LARGEST).astype(np.int64),
        column("time_s", _LONGEST_S),
        column("path_s" if "path_s" in table else "time_s", _LONGEST_S),
        joint_columns(["commanded_steps"] * len(joints)).astype(np.int64),
        joint_columns([joint.commanded_column for joint in joints]),
        angle_deg,
        column("run", _LARGEST).astype(np.int64),
        row,
        passed,
        problem,
    )


def _passed(cells: Mapping[str, str]) -> RowPassed:
    """A line of the file of rows."""
    run, row, step, cycle, value = (_whole(cells[name]) for name in ("run", "row", "step", "cycle", "value"))
    time_s, words = _finite(cells["time_s"]), visible(cells["words"])
    return RowPassed(_whole(cells["passed"]), time_s, run, row, step, cycle, value, words)


def _whole_lines(path: Path) -> list[dict[str, str]]:
    """The rows of a file of the run by column, without an incomplete last line.

    Raises ValueError for a row that has not a cell for each column.
    """
    text = path.read_text(encoding="utf-8")
    rows = csv.reader(text[: text.rfind("\n") + 1].splitlines())
    found = []
    try:
        head = next(rows, [])
        for cells in rows:
            if len(cells) != len(head):
                raise ValueError(f"line {rows.line_num}: {len(cells)} cells instead of {len(head)}")
            found.append(dict(zip(head, cells, strict=True)))
    except csv.Error as error:
        raise ValueError(f"line {rows.line_num}: {error}") from None
    return found
