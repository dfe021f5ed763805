"""Reading run folders."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.errors import RunFolderError
from armtempo.basics.text import visible
from armtempo.link.follow import Gap
from armtempo.report.run_folder import FORMAT, META, TRAJECTORY, VERSION, JointScale, Repetition
from armtempo.report.sequence_folder import FORMAT as SEQUENCE_FORMAT

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
    meta = _meta(path / META)
    try:
        joints = tuple(scale(**joint) for joint in meta["joints"])
        entries = tuple(_entry(entry) for entry in meta["repetitions"])
        meta |= {key: visible(str(meta[key])) for key in ("name", "started")}
    except (KeyError, TypeError, ValueError) as error:
        raise RunFolderError(
            f"{path / META}: {error} is missing or wrong",
            "restore the folder from a copy, or run again",
        ) from error
    repetitions = tuple(_samples(path / entry.file, entry.state, joints) for entry in entries)
    return RunData(path, meta, joints, repetitions, entries)


def scale(name: str, steps_per_deg: float, counts_per_deg: float) -> JointScale:
    """A joint's scales from run.json."""
    return JointScale(visible(str(name)), float(steps_per_deg), float(counts_per_deg))


def _entry(values: dict[str, Any]) -> Repetition:
    """A repetition of run.json; keys of another version that do not fit are ignored."""
    known = {key.name: values[key.name] for key in fields(Repetition) if key.name in values}
    known |= {key: visible(str(values[key])) for key in ("file", "state")}
    known["lost"] = tuple(Gap(int(first), int(number)) for first, number in known.get("lost", ()))
    known |= {key: tuple(map(int, known[key])) for key in ("commanded_steps", "counts") if key in known}
    return Repetition(**known)


def _meta(path: Path) -> dict[str, Any]:
    try:
        meta = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RunFolderError(
            f"{path.parent} is not a run folder: {path.name}: {error.strerror}",
            "give a folder that 'armtempo run' or 'armtempo fetch' wrote",
        ) from error
    except ValueError as error:
        raise RunFolderError(
            f"{path}: damaged: {error}", "restore the folder from a copy, or run again"
        ) from error
    if isinstance(meta, dict) and meta.get("format") == SEQUENCE_FORMAT:
        raise RunFolderError(
            f"{path.parent} is the run of a sequence, not of one motion",
            "'armtempo report' writes its page; read it with SequenceRun.load",
        )
    if not isinstance(meta, dict) or meta.get("format") != FORMAT:
        raise RunFolderError(
            f"{path}: not the description of an armtempo run",
            "give a folder that 'armtempo run' or 'armtempo fetch' wrote",
        )
    if meta.get("version") != VERSION:
        raise RunFolderError(
            f"{path}: version {meta.get('version')}; this armtempo reads {VERSION}",
            "update armtempo, or read it with the version that wrote it",
        )
    return meta


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
    table = {name: [row[name] or "" for row in rows] for name in (rows[0] if rows else ())}

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
    for number, joint in enumerate(joints):
        if joint.counts_per_deg:
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
    """The complete lines of a sample file, without an incomplete last one."""
    text = path.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]
    return list(csv.DictReader(whole.splitlines()))
