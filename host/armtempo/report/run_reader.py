"""Reading run folders."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armtempo.basics import json_text
from armtempo.basics.arrays import Array
from armtempo.basics.errors import RunFolderError
from armtempo.basics.text import visible
from armtempo.link.follow import Gap
from armtempo.model.transmission import coupling_problem
from armtempo.report.run_folder import FORMAT, META, TRAJECTORY, VERSION, JointScale, Repetition, transmission
from armtempo.report.sequence_folder import FORMAT as SEQUENCE_FORMAT

RESTORE = "restore the folder from a copy, or run again"
_LARGEST = 2.0**53
"""Integers beyond this are not exact as doubles."""
_LONGEST_S = 86_400.0
"""A day; longer than any motion on the board."""


@dataclass(frozen=True)
class RepetitionData:
    """One repetition: N samples of J joints."""

    file: str
    state: str
    """How it ended, see ``run_folder``."""
    index: NDArray[np.int64]
    """(N,), from 0; a jump means lost samples."""
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
    problem: str = ""
    """Why the file could not be read."""


@dataclass(frozen=True)
class RunData:
    """A run folder's content."""

    path: Path
    meta: dict[str, Any]
    joints: tuple[JointScale, ...]
    repetitions: tuple[RepetitionData, ...]
    entries: tuple[Repetition, ...]
    """The repetitions in run.json."""

    @property
    def trajectory_path(self) -> Path | None:
        """The file of the plan, if there is one."""
        path = self.path / TRAJECTORY
        return path if path.is_file() else None


def load(path: Path) -> RunData:
    """Read a run folder, also of an interrupted run; raises RunFolderError if it is none or inconsistent.

    A repetition whose file is missing or damaged has no samples; ``problem`` says why.
    """
    meta = description(path)
    if meta.get("format") == SEQUENCE_FORMAT:
        raise RunFolderError(
            f"{path} is the run of a sequence, not of one motion",
            "'armtempo report' writes its page; read it with SequenceRun.load",
        )
    check_version(path, meta, FORMAT, VERSION)
    try:
        joints = scales(meta)
        entries = tuple(_entry(entry) for entry in meta["repetitions"])
        meta |= {key: visible(str(meta[key])) for key in ("name", "started")}
    except (LookupError, TypeError, ValueError) as error:
        raise wrong(path / META, error) from error
    repetitions = tuple(_samples(path / entry.file, entry.state, joints) for entry in entries)
    return RunData(path, meta, joints, repetitions, entries)


def description(folder: Path) -> dict[str, Any]:
    """The content of a folder's run.json; raises RunFolderError if it has none, or it is damaged."""
    path = folder / META
    try:
        found = json_text.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RunFolderError(
            f"{folder} is not a run folder: {META}: {error.strerror}",
            "give a folder that 'armtempo run' or 'armtempo fetch' wrote",
        ) from error
    except ValueError as error:
        raise RunFolderError(f"{path}: damaged: {error}", RESTORE) from error
    return found if isinstance(found, dict) else {}


def check_version(folder: Path, meta: Mapping[str, Any], form: str, version: int) -> None:
    """Raise RunFolderError if a ``description`` is of another format or version."""
    path = folder / META
    if meta.get("format") != form:
        raise RunFolderError(
            f"{path}: not the description of an armtempo run",
            "give a folder that 'armtempo run' or 'armtempo fetch' wrote",
        )
    if meta.get("version") != version:
        raise RunFolderError(
            f"{path}: version {meta.get('version')!r:.20}; this armtempo reads {version}",
            "update armtempo, or read it with the version that wrote it",
        )


def wrong(where: Path, error: Exception) -> RunFolderError:
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
    row = tuple(map(finite, joint.get("coupling", ())))
    found = JointScale(name, finite(joint["steps_per_deg"]), finite(joint["counts_per_deg"]), row)
    if not found.steps_per_deg:
        raise ValueError("steps_per_deg is 0")
    return found


def finite(value: Any) -> float:
    """A number from a file; raises ValueError if it is not finite, or too large to be exact, or none."""
    number = float(value)
    if not abs(number) <= _LARGEST:
        raise ValueError(f"{value!r:.20} is no number that a run can have")
    return number


def whole(value: Any) -> int:
    """A whole number from a file; raises ValueError if it is too large to be exact, or none."""
    number = int(value)
    if abs(number) > _LARGEST or number != float(value):
        raise ValueError(f"{value!r:.20} is no whole number that a run can have")
    return number


def _entry(values: dict[str, Any]) -> Repetition:
    """A repetition of run.json; keys of another version that do not fit are ignored."""
    found = Repetition(visible(str(values["file"])), visible(str(values["state"])))
    if Path(found.file).name != found.file:
        raise ValueError(f"{found.file!r} is not the name of a file in the folder")
    found.samples = whole(values.get("samples", 0))
    found.lost = tuple(Gap(whole(first), whole(number)) for first, number in values.get("lost", ()))
    found.duration_s = finite(values.get("duration_s", 0.0))
    found.fault = visible(str(values.get("fault", "")))
    found.commanded_steps = tuple(map(whole, values.get("commanded_steps", ())))
    found.counts = tuple(map(whole, values.get("counts", ())))
    if len(found.counts) != len(found.commanded_steps):
        raise ValueError("a repetition has not as many counts as commanded_steps")
    found.notices = tuple(visible(str(text)) for text in values.get("notices", ()))
    return found


def _samples(path: Path, state: str, joints: tuple[JointScale, ...]) -> RepetitionData:
    try:
        return parsed(path, state, joints, whole_lines(path))
    except OSError as error:
        problem = f"missing ({error.strerror})"
    except ValueError as error:
        problem = f"damaged ({error})"
    return replace(parsed(path, state, joints, []), problem=problem)


def parsed(
    path: Path, state: str, joints: tuple[JointScale, ...], rows: list[dict[str, str]]
) -> RepetitionData:
    """The samples in the rows of a file; raises ValueError for a value that is missing, not a number, or impossible."""
    table = {name: [row[name] for row in rows] for name in (rows[0] if rows else ())}

    def column(name: str, largest: float) -> Array:
        if rows and name not in table:
            raise ValueError(f"column {name} is missing")
        values = np.array(table.get(name, []), dtype=float)
        if not np.all(np.abs(values) <= largest):
            raise ValueError(f"column {name} has values that no run can have")
        return values

    def joint_columns(name: str) -> Array:
        cells = [column(f"j{number}_{name}", _LARGEST) for number in range(1, len(joints) + 1)]
        return np.array(cells).reshape(len(joints), len(rows)).T

    angle_deg = np.full((len(rows), len(joints)), np.nan)
    for number, seen in enumerate(transmission(joints).measured):
        if seen:
            angle_deg[:, number] = column(f"j{number + 1}_angle_deg", _LARGEST)
    return RepetitionData(
        path.name,
        state,
        column("index", _LARGEST).astype(np.int64),
        column("time_s", _LONGEST_S),
        column("path_s" if "path_s" in table else "time_s", _LONGEST_S),
        joint_columns("commanded_steps").astype(np.int64),
        joint_columns("commanded_deg"),
        angle_deg,
    )


def whole_lines(path: Path) -> list[dict[str, str]]:
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
