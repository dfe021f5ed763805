"""Names in an arm file: what uses the name of a posture, frame or tool, giving it another name, and removing it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit

from armtempo.basics import toml_table
from armtempo.basics.atomic_file import replace_text, replace_texts
from armtempo.basics.errors import InputError
from armtempo.model import frame, posture, taught, tool
from armtempo.model.arm import Arm

POSTURE = "posture"
KINDS = (POSTURE, frame.KIND, tool.KIND)
"""Tables [KIND.NAME] of an arm file that can get another name."""
_USES = {POSTURE: (POSTURE, "goto", "start"), frame.KIND: (frame.KIND,), tool.KIND: (tool.KIND,)}
"""Keys of arm files, jobs and sequences whose value is a name of each kind."""
_HEADER = re.compile(r"\s*\[\[?[^\[\],]+\]\]?\s*(#.*)?")


def uses(content: Mapping[str, Any], kind: str, name: str) -> list[str]:
    """Where the content of a TOML file uses a name, as its keys are written: ``via[1].frame``."""
    return [where for where, _ in _places(content, kind, name)]


@dataclass(frozen=True)
class Use:
    """A line that uses a name."""

    file: Path
    line: int
    """From 1; 0 for what is edited and not saved."""
    text: str
    """Of the line."""
    follows: bool
    """Whether ``rename`` changes it; not in a program, or a file that cannot be read as TOML."""


def uses_in_files(file: Path, folder: Path, kind: str, name: str) -> list[Use]:
    """The lines of an arm file, and of the jobs, sequences and programs of a folder, that use a name.

    Other arms have names of their own and are left out. Raises InputError if the arm file cannot be read.
    """
    taught.parsed(taught.read_text(file), file)
    return [one for path in (file, *_others(file, folder)) for one in _uses_in(path, kind, name)]


def _others(file: Path, folder: Path) -> list[Path]:
    """The files of a folder that may use a name of an arm file."""
    paths = sorted([*folder.glob("*.toml"), *folder.glob("*.py")])
    return [path for path in paths if path.resolve() != file.resolve() and not _is_of_another_arm(path, file)]


def _is_of_another_arm(path: Path, file: Path) -> bool:
    """Whether a file is an arm, or a sequence that names one, other than ``file``."""
    content = _content(path)
    named = content.get("arm")
    if not isinstance(named, str):
        return "joint" in content
    beside = path.parent / named
    return (beside if beside.is_file() else Path(named)).resolve() != file.resolve()


def _content(path: Path) -> dict[str, Any]:
    """What a TOML file says; nothing for what is none."""
    try:
        return taught.content(taught.read_text(path)) if path.suffix == ".toml" else {}
    except (InputError, ValueError):
        return {}


def _uses_in(path: Path, kind: str, name: str) -> list[Use]:
    try:
        text = taught.read_text(path)
    except InputError:
        return []
    quoted = re.compile(rf"[\"']{re.escape(name)}[\"']")
    if not quoted.search(text):
        return []
    lines = text.splitlines()
    try:
        changed = renamed(text, kind, name, f"{name}-").splitlines() if path.suffix == ".toml" else []
    except InputError:
        changed = []
    follows = len(changed) == len(lines)
    marked = zip(lines, changed, strict=True) if follows else ((line, quoted.sub("", line)) for line in lines)
    return [
        Use(path, number, line.strip(), follows)
        for number, (line, other) in enumerate(marked, 1)
        if line != other
    ]


def renamed(text: str, kind: str, name: str, new: str) -> str:
    """A TOML text with another name where it uses ``name``; everything else as it is written.

    Raises InputError if it is no TOML, or written in a way that cannot be changed.
    """
    try:
        wanted = taught.content(text)
        changed = _changed(text, kind, name, new)
        for _, change in list(_places(wanted, kind, name)):
            change(new)
        same = taught.content(changed) == wanted
    except ValueError:
        same = False
    if not same:
        raise InputError(f"the {kind} {name!r} is used in a way that cannot be changed here", "edit the file")
    return changed


def _changed(text: str, kind: str, name: str, new: str) -> str:
    mark = taught.MARK if text.startswith(taught.MARK) else ""
    document = tomlkit.parse(text.removeprefix(taught.MARK))
    places = list(_places(document, kind, name))
    for _, change in places:
        change(new)
    return mark + tomlkit.dumps(document) if places else text


def rename(file: Path, kind: str, name: str, new: str, folder: Path | None = None) -> Arm:
    """Give a table another name, also where the arm file uses it.

    With a ``folder`` its jobs and sequences follow: ``Use.follows`` says which lines; the others stay. Everything else
    stays as it is written, and all files are written, or none. Raises InputError, without writing, for a name that is
    not allowed or taken, a table that is written in another way than [KIND.NAME], or a file that cannot be written.
    """
    _check_name(kind, new)
    if new in taught.names(file, kind):
        raise InputError(f"there is a {kind} {new!r} already", "choose another name")
    for path in _others(file, folder or file.parent):
        own = _content(path).get(POSTURE)
        if kind == POSTURE and isinstance(own, Mapping) and new in own:
            raise InputError(f"{path.name} has a posture {new!r} of its own", "choose another name")
    text = taught.read_text(file)
    header = re.compile(rf"(?m)^(\s*\[\s*{kind}\s*\.\s*)([\"']?){re.escape(name)}\2(?=\s*[\].])")
    changed = header.sub(rf"\g<1>{new}", _changed(text, kind, name, new))
    wanted = taught.parsed(text, file)
    for _, change in list(_places(wanted, kind, name)):
        change(new)
    tables = wanted[kind]
    wanted[kind] = {new if key == name else key: value for key, value in tables.items()}
    arm = _checked(file, changed, wanted, f"{kind} {name!r}")
    texts = {file: changed}
    for path in _others(file, folder) if folder else ():
        if any(one.follows for one in _uses_in(path, kind, name)):
            texts[path] = renamed(taught.read_text(path), kind, name, new)
    replace_texts(texts, newline="")
    return arm


def remove(file: Path, kind: str, name: str) -> Arm:
    """Remove a table with the comments in it and right above it; everything else stays as it is written.

    Raises InputError, without writing, if something else of the arm file uses it, or it is written in another way
    than [KIND.NAME].
    """
    text = taught.read_text(file)
    wanted = taught.parsed(text, file)
    if places := uses(wanted, kind, name):
        raise InputError(f"{', '.join(places)}: uses the {kind} {name!r}", "change that first")
    wanted[kind] = {key: value for key, value in wanted[kind].items() if key != name}
    changed = _without(text, kind, name)
    arm = _checked(file, changed, wanted, f"{kind} {name!r}")
    replace_text(file, changed, newline="")
    return arm


def _without(text: str, kind: str, name: str) -> str:
    """The text without the table and its subtables."""
    ours = re.compile(rf"\s*\[\s*{kind}\s*\.\s*([\"']?){re.escape(name)}\1\s*(\.[^\]]*)?\]\s*(#.*)?")
    lines = text.splitlines(keepends=True)
    kept: list[str] = []
    gone = False
    for at, line in enumerate(lines):
        if _HEADER.fullmatch(line.rstrip("\r\n")) or _is_above_header(lines, at):
            header = next(one for one in lines[at:] if _HEADER.fullmatch(one.rstrip("\r\n")))
            gone = bool(ours.fullmatch(header.rstrip("\r\n")))
        if not gone:
            kept.append(line)
    return "".join(kept)


def _is_above_header(lines: list[str], at: int) -> bool:
    """Whether a line is one of the comments right above a header."""
    while at < len(lines) and lines[at].lstrip().startswith("#"):
        at += 1
        if at < len(lines) and _HEADER.fullmatch(lines[at].rstrip("\r\n")):
            return True
    return False


def _checked(file: Path, changed: str, wanted: dict[str, Any], what: str) -> Arm:
    """The arm of a changed text; raises InputError if it does not say what is wanted."""
    try:
        same = _filled(taught.content(changed)) == _filled(wanted)
    except ValueError:
        same = False
    if not same:
        raise InputError(
            f"{file}: its {what} is written in a way that cannot be changed here", "edit the file"
        )
    return Arm.of_table(toml_table.parse(changed.removeprefix(taught.MARK), str(file)))


def _filled(content: dict[str, Any]) -> dict[str, Any]:
    """Without empty tables of names."""
    return {key: value for key, value in content.items() if key not in KINDS or value}


def _check_name(kind: str, name: str) -> None:
    if kind == POSTURE:
        if problem := posture.name_problem(name):
            raise InputError(f"posture {name!r}: {problem}", "choose another name")
    else:
        (frame if kind == frame.KIND else tool).check_name(name)


def _places(content: Any, kind: str, name: str, where: str = "") -> Iterator[tuple[str, Any]]:
    """Where a name is used in tables and lists, and what sets another one there."""
    rows = content.items() if isinstance(content, Mapping) else enumerate(content)
    for key, value in list(rows):
        at = f"{where}[{key}]" if isinstance(key, int) else f"{where}.{key}" if where else key
        if isinstance(value, Mapping | list):
            yield from _places(value, kind, name, at)
        elif key in _USES[kind] and value == name:
            yield at, lambda new, key=key: content.__setitem__(key, new)
