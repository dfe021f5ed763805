"""What was taught, as text: a table in an arm file, of which everything else is unchanged; a job of via points."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from armtempo_shared.limits import MAX_NAME

from armtempo.basics.atomic_file import os_reason, replace_text
from armtempo.basics.errors import InputError
from armtempo.model import posture as named
from armtempo.model.arm import Arm

_HEADER = re.compile(r"\s*\[\[?[\w.\"' -]+\]\]?\s*(#.*)?")
_LIST = r"(?m)^(\s*{key}\s*=\s*)\[[^\]]*\]"
_POSTURE = "posture"
MARK = "\ufeff"
"""The mark of the byte order, which some editors write first."""
_HEAD = """\
# Via points that were taught with 'armtempo teach'; every key: armtempo help files
name = "{name}"
"""
_VIA = """
[[via]]
{key} = [{angles}]
"""


def save(path: Path, arm: Arm, name: str, angles_deg: list[float], replace: bool) -> None:
    """Write ``[posture.NAME]`` into the file of ``arm``, atomically, keeping its comments and layout.

    Raises InputError if the name is invalid, the arm cannot take the posture, the file has it and ``replace``
    is false, or the file cannot be read, written, or changed in this one place.
    """
    if problem := named.name_problem(name):
        raise InputError(f"posture {name!r}: {problem}", "choose another name")
    if problem := arm.angles_problem(angles_deg):
        raise InputError(f"posture {name!r}: {problem}", "move the arm into its ranges")
    save_table(path, (_POSTURE, name), {arm.texts.list_key("angles_deg"): angles_deg}, replace)


def save_table(path: Path, place: tuple[str, str], values: Mapping[str, Any], replace: bool) -> None:
    """Write the table ``[KIND.NAME]`` into an arm file, atomically, keeping its comments and layout.

    ``place``: kind and name; ``values``: its keys. Raises InputError if the file has it and ``replace`` is false, or
    cannot be read, written, or changed in this one place.
    """
    text = read_text(path)
    check_free(path, place, replace)
    replace_text(path, with_table(text, place, values, path), newline="")


def names(path: Path, kind: str) -> list[str]:
    """The names of the tables ``[KIND.NAME]`` of a file; raises InputError if it cannot be read."""
    return list(parsed(read_text(path), path).get(kind, {}))


def check_free(path: Path, place: tuple[str, str], replace: bool) -> None:
    """Raise InputError if the file has the table ``[KIND.NAME]`` already and ``replace`` is false."""
    kind, name = place
    if name in names(path, kind) and not replace:
        raise InputError(
            f"{path} already has a {kind} {name!r}",
            "choose another name, or replace it with --replace",
        )


def read_text(path: Path) -> str:
    """A file with the ends of its lines as they are; raises InputError if it cannot be read."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return file.read()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {os_reason(error)}", "check the path") from None


def digits(arm: Arm, angles_deg: list[float]) -> list[float]:
    """The angles with the fewest digits that give the same steps of all motors, within their ranges."""
    gears, found = arm.transmission, list(angles_deg)
    steps = gears.whole_steps(angles_deg)
    for index, (joint, angle) in enumerate(zip(arm.driven, angles_deg, strict=True)):
        low, high = joint.range_deg
        for places in range(2, 12):
            found[index] = min(max(round(angle, places), low), high) + 0.0
            if gears.whole_steps(found) == steps:
                break
        else:
            found[index] = angle
    return found


def with_table(text: str, place: tuple[str, str], values: Mapping[str, Any], path: Path) -> str:
    """The text of an arm file with the table; raises InputError if that would change anything else."""
    end = "\r\n" if "\r\n" in text else "\n"
    kind, name = place
    written = {key: _value(value) for key, value in values.items()}
    before = parsed(text, path)
    wanted = {**before, kind: {**before.get(kind, {}), name: dict(values)}}
    try:
        changed = _changed(text, place, written, end)
        same = content(changed) == wanted
    except ValueError:
        same = False
    if not same:
        raise InputError(
            f"{path}: its {kind}s are written in a way that cannot be changed here",
            f"write it yourself: [{kind}.{name}] {', '.join(f'{key} = {said}' for key, said in written.items())}",
        )
    return changed


def table_of(path: Path, place: tuple[str, str]) -> dict[str, Any]:
    """The keys of the table ``[KIND.NAME]`` of a file as they are written; none if there is no such table."""
    kind, name = place
    return dict(parsed(read_text(path), path).get(kind, {}).get(name, {}))


def _value(value: str | float | Sequence[float]) -> str:
    if isinstance(value, int | float):
        return f"{value:.12g}"
    return json.dumps(value) if isinstance(value, str) else f"[{', '.join(f'{one:.12g}' for one in value)}]"


def _changed(text: str, place: tuple[str, str], values: Mapping[str, str], end: str) -> str:
    lines = text.splitlines(keepends=True)
    found = _place(lines, *place)
    if found is None:
        gap = "" if not text else end if text.endswith("\n") else 2 * end
        return f"{text}{gap}[{'.'.join(place)}]{end}" + "".join(_lines(values, end))
    head, tail = found
    return "".join([*lines[: head + 1], *_replaced(lines[head + 1 : tail], values, end), *lines[tail:]])


def _lines(values: Mapping[str, str], end: str) -> list[str]:
    return [f"{key} = {value}{end}" for key, value in values.items()]


def _place(lines: list[str], kind: str, name: str) -> tuple[int, int] | None:
    """The first line of the table, and the line after its last; None if there is no such table."""
    header = re.compile(rf"\s*\[\s*{kind}\s*\.\s*[\"']?{re.escape(name)}[\"']?\s*\]\s*(#.*)?")
    heads = [number for number, line in enumerate(lines) if header.fullmatch(line.rstrip("\r\n"))]
    for head in heads[:1]:
        for tail in range(head + 1, len(lines)):
            if _HEADER.fullmatch(lines[tail].rstrip("\r\n")) and _is_whole(lines[:tail]):
                return head, tail
        return head, len(lines)
    return None


def _is_whole(lines: list[str]) -> bool:
    try:
        content("".join(lines))
    except ValueError:
        return False
    return True


def _replaced(table: list[str], values: Mapping[str, str], end: str) -> list[str]:
    """The lines of a table with new values; comments are kept."""
    text = "".join(table)
    keys = tomllib.loads(text.replace("\r\n", "\n"))
    if keys.keys() == values.keys():
        for key, value in values.items():  # texts and numbers are the same as before
            text = re.sub(_LIST.format(key=key), rf"\g<1>{value}", text, count=1)
        return [text]
    plain = [
        number for number, line in enumerate(table) if line.strip() and not line.lstrip().startswith("#")
    ]
    first, last = (plain[0], plain[-1]) if plain else (0, -1)
    comments = [line for line in table[first : last + 1] if line.lstrip().startswith("#")]
    return [*table[:first], *comments, *_lines(values, end), *table[last + 1 :]]


def content(text: str) -> dict[str, Any]:
    """What a TOML text says, whatever its lines end with; raises ValueError if it is none."""
    return tomllib.loads(text.removeprefix(MARK).replace("\r\n", "\n"))


def parsed(text: str, path: Path) -> dict[str, Any]:
    """What a TOML text says; raises InputError, with the path, if it is none."""
    try:
        return content(text)
    except ValueError as error:
        raise InputError(f"{path}: not valid TOML: {error}", "correct that place") from None


def name_of(path: Path) -> str:
    """A valid job name made from the file's name."""
    name = "".join(
        letter if letter.isascii() and (letter.isalnum() or letter in "-_") else "-" for letter in path.stem
    )
    return name[:MAX_NAME].strip("-") or "taught"


def of_points(name: str, points_deg: Sequence[Sequence[float]], arm: Arm) -> str:
    """The text of a job of the arm through via points, each (J,); raises InputError for fewer than two."""
    if len(points_deg) < 2:
        raise InputError(
            f"{len(points_deg)} via point{'' if len(points_deg) == 1 else 's'} are no motion, so no job was written",
            "store at least 2 points with different postures",
        )
    key = arm.texts.list_key("angles_deg")
    vias = [_VIA.format(key=key, angles=", ".join(f"{angle:.12g}" for angle in row)) for row in points_deg]
    return "".join([_HEAD.format(name=name), *vias])
