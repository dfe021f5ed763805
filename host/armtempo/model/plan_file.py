"""The JSON files of plans, of a job or of a sequence, with all that is needed to run them and to plan them again.

Each has a checksum of its content, independent of white space; trajectory files of version 1 have none.
"""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from armtempo.basics import json_codec, json_text
from armtempo.basics.arrays import Array
from armtempo.basics.atomic_file import check_replaceable, os_reason, replace_text
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.leg import Search, SequenceRow
from armtempo.splines.extremes import Extremes
from armtempo.splines.trajectory import Trajectory

AGAIN = "plan it again"
RUN = "run.json"
"""File next to that of the plan in a run folder."""
LOG = logging.getLogger("armtempo")


@dataclass(frozen=True, eq=False)
class JobContent:
    """The content of a job's file."""

    arm: Arm
    job: Job
    via_deg: Array
    notes: tuple[str, ...]
    trajectory: Trajectory
    searches: tuple[Search, ...]
    extremes: tuple[Extremes, ...]
    versions: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class SequenceContent:
    """The content of a sequence's file."""

    arm: Arm
    name: str
    legs: tuple[Trajectory, ...]
    rows: tuple[SequenceRow, ...]
    counters: tuple[str, ...]
    versions: Mapping[str, str]
    loads: tuple[str, ...] = field(default=(), metadata=json_codec.ADDED)
    """Of each leg."""
    notes: tuple[str, ...] = field(default=(), metadata=json_codec.ADDED)
    frames: tuple[str, ...] = field(default=(), metadata=json_codec.ADDED)
    tools: tuple[str, ...] = field(default=(), metadata=json_codec.ADDED)
    """Of each leg; (): that of ``arm`` in all."""
    pallets: tuple[str, ...] = field(default=(), metadata=json_codec.ADDED)


Content = JobContent | SequenceContent


@dataclass(frozen=True)
class Kind:
    """A kind of file."""

    content: type[Content]
    format: str
    key: str
    """Of the content."""
    what: str
    made_by: str
    """Command that makes one."""
    rule: str
    """Which file is replaced without being asked for."""
    names: Callable[[Any], Any]
    """Of a content as in JSON: those that are the same in a file that may be replaced."""
    versions: tuple[int, ...]
    """Those that are read, the last is written; version 1 has no checksum."""

    def fits(self, file: Any) -> bool:
        return isinstance(file, dict) and file.get("format") == self.format


OF_JOB = Kind(
    JobContent,
    "armtempo trajectory",
    "plan",
    "a trajectory file",
    "armtempo plan",
    "a trajectory file is replaced by one of the same job, by its name, for an arm of the same name",
    lambda content: (content["job"]["name"], content["arm"]["name"]),
    (1, 2),
)
OF_SEQUENCE = Kind(
    SequenceContent,
    "armtempo sequence",
    "sequence",
    "a planned sequence",
    "armtempo plan SEQUENCE.toml",
    "a sequence's plan is replaced by one of a sequence of the same name",
    lambda content: content["name"],
    (2,),
)


def save(path: Path | str, content: Content, force: bool = False) -> None:
    """Write a file, atomically; raises as ``check``, and InputError if it cannot be written."""
    check(path, content, force)
    kind = _kind_of(content)
    replace_text(Path(path), _text(kind, json_codec.encode(content)))


def check(path: Path | str, content: Content, force: bool = False) -> None:
    """Raise InputError if a file must not be replaced by that of a plan.

    It may be with ``force``, or if it is unaltered and of the same job or sequence.
    """
    kind, ours = _kind_of(content), json_codec.encode(content)
    check_replaceable(Path(path), _text(kind, ours), force or _is_earlier(Path(path), kind, ours), kind.rule)


def read(path: Path | str, altered: bool = False) -> Content:
    """The content of a file of either kind.

    ``altered``: accept a file that was altered after it had been written. Raises InputError for a file that is
    missing, damaged, altered, of another format or version, or has an unknown key, value or shape.
    """
    file = _json(path)
    kind = OF_SEQUENCE if OF_SEQUENCE.fits(file) else OF_JOB
    if not kind.fits(file):
        raise InputError(f"{path}: is not {kind.what}", f"make one with: {kind.made_by}")
    version = file.get("version")
    if version not in kind.versions:
        known = " and ".join(map(str, kind.versions))
        raise InputError(f"{path}: has version {version!r}, this program reads {known}", AGAIN)
    expected = {"format", "version", kind.key} | ({"sha256"} if version > 1 else set())
    if file.keys() != expected:
        raise InputError(f"{path}: unknown or missing key besides {', '.join(sorted(expected))}", AGAIN)
    if version == 1:
        LOG.warning(
            f"{path} was written before trajectory files had a checksum: whether it was altered is not known"
        )
    elif file["sha256"] != checksum(file[kind.key]):
        if not altered:
            raise InputError(
                f"{path} was altered after it had been written: its checksum does not fit", _cure(path)
            )
        LOG.warning(f"{path} was altered after it had been written; accepted with --altered")
    found: Content = json_codec.decode(kind.content, file[kind.key], f"{path}: {kind.key}")
    return found


def _kind_of(content: Content) -> Kind:
    return OF_JOB if isinstance(content, JobContent) else OF_SEQUENCE


def _is_earlier(path: Path, kind: Kind, ours: Any) -> bool:
    try:
        file = _json(path)
        before = file[kind.key]
        unaltered = file["version"] == 1 or file["sha256"] == checksum(before)
        return bool(kind.fits(file) and unaltered and kind.names(before) == kind.names(ours))
    except (InputError, LookupError, TypeError):
        return False


def _text(kind: Kind, content: Any) -> str:
    head = {"format": kind.format, "version": kind.versions[-1], "sha256": checksum(content)}
    return json.dumps({**head, kind.key: content}, indent=1, allow_nan=False) + "\n"


def _json(path: Path | str) -> Any:
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(
            f"{path}: no such file", f"check the path, or make it with: {OF_JOB.made_by} -o {path}"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {os_reason(error)}", "check its permissions") from None
    try:
        return json_text.loads(text)
    except ValueError as error:
        raise InputError(f"{path}: damaged or cut: {error}", "plan it again or copy it again") from None


def checksum(content: Any) -> str:
    """The sha256 of a plan's content, in hex."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _cure(path: Path | str) -> str:
    if (Path(path).parent / RUN).exists():
        return "it no longer says what was run: bring the original back, or move it out of the run folder"
    return "plan it again; or, if you know what was altered, take it with --altered"
