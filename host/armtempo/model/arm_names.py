"""Names in an arm file: what uses the name of a posture, frame or tool, giving it another name, and removing it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import tomlkit

from armtempo.basics import toml_table
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError
from armtempo.model import frame, posture, taught, tool
from armtempo.model.arm import Arm

POSTURE = "posture"
KINDS = (POSTURE, frame.KIND, tool.KIND)
"""Tables [KIND.NAME] of an arm file that can get another name."""
_USES = {POSTURE: (POSTURE, "goto"), frame.KIND: (frame.KIND,), tool.KIND: (tool.KIND,)}
"""Keys of arm files, jobs and sequences whose value is a name of each kind."""
_HEADER = re.compile(r"\s*\[\[?[^\[\],]+\]\]?\s*(#.*)?")


def uses(content: Mapping[str, Any], kind: str, name: str) -> list[str]:
    """Where the content of a TOML file uses a name, as its keys are written: ``via[1].frame``."""
    return [where for where, _ in _places(content, kind, name)]


def users(file: Path, folder: Path, kind: str, name: str) -> list[str]:
    """The other tables of an arm file, and the jobs, sequences and programs of a folder, that use a name.

    Files that cannot be read are left out. Raises InputError if the arm file cannot be read.
    """
    found = [
        where.rpartition(".")[0] for where in uses(taught.parsed(taught.read_text(file), file), kind, name)
    ]
    for path in sorted([*folder.glob("*.toml"), *folder.glob("*.py")]):
        if path.resolve() != file.resolve() and _is_used_in(path, kind, name):
            found.append(path.name)
    return found


def _is_used_in(path: Path, kind: str, name: str) -> bool:
    try:
        text = taught.read_text(path)
        return bool(re.search(rf"[\"']{re.escape(name)}[\"']", text)) and (
            path.suffix == ".py" or bool(uses(taught.content(text), kind, name))
        )
    except (InputError, ValueError):
        return False


def rename(file: Path, kind: str, name: str, new: str) -> Arm:
    """Give a table another name, also where the arm file uses it; what other files say stays.

    Everything else in the arm file stays as it is written. Raises InputError, without writing, for a name that is
    not allowed or taken, or a table that is written in another way than [KIND.NAME].
    """
    _check_name(kind, new)
    if new in taught.names(file, kind):
        raise InputError(f"there is a {kind} {new!r} already", "choose another name")
    text = taught.read_text(file)
    document = tomlkit.parse(text.removeprefix(taught.MARK))
    for _, change in list(_places(document, kind, name)):
        change(new)
    header = re.compile(rf"(?m)^(\s*\[\s*{kind}\s*\.\s*)([\"']?){re.escape(name)}\2(?=\s*[\].])")
    changed = header.sub(rf"\g<1>{new}", tomlkit.dumps(document))
    wanted = taught.parsed(text, file)
    for _, change in list(_places(wanted, kind, name)):
        change(new)
    tables = wanted[kind]
    wanted[kind] = {new if key == name else key: value for key, value in tables.items()}
    return _write(file, text, changed, wanted, f"{kind} {name!r}")


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
    return _write(file, text, _without(text, kind, name), wanted, f"{kind} {name!r}")


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


def _write(file: Path, before: str, changed: str, wanted: dict[str, Any], what: str) -> Arm:
    try:
        same = _filled(taught.content(changed)) == _filled(wanted)
    except ValueError:
        same = False
    if not same:
        raise InputError(
            f"{file}: its {what} is written in a way that cannot be changed here", "edit the file"
        )
    arm = Arm.of_table(toml_table.parse(changed.removeprefix(taught.MARK), str(file)))
    mark = taught.MARK if before.startswith(taught.MARK) else ""
    replace_text(file, mark + changed.removeprefix(taught.MARK), newline="")
    return arm


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
