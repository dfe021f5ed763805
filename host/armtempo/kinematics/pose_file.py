"""A text file of poses: one pose a line, numbers separated by blanks or commas, ``#`` starts a comment."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from armtempo.errors import InputError
from armtempo.formats.atomic_file import why
from armtempo.kinematics.geometry import Array
from armtempo.model.pose import LARGEST, checked, from_quaternion, from_rpy

FORMS = {
    6: "x y z roll pitch yaw",
    7: "x y z and quaternion w x y z",
    12: "3 rows of a matrix",
    16: "4 rows of a matrix",
}
"""How many numbers make a pose."""


def read(path: Path | str) -> list[Array]:
    """Return the poses of a file, (4, 4) each; InputError names the file and the line that is wrong."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as text ({why(error)})") from error
    poses = []
    for number, line in enumerate(text.splitlines(), 1):
        content = line.split("#")[0]
        if content.strip():
            poses.append(parse(content, f"{path}, line {number}"))
    if not poses:
        raise InputError(f"{path}: no pose in it; write one a line, for instance: x y z roll pitch yaw")
    return poses


def parse(text: str, what: str, counts: tuple[int, ...] = (6, 7, 12, 16)) -> Array:
    """Return the pose that ``text`` writes in as many numbers as ``counts`` allows."""
    found = numbers(text, what)
    if len(found) not in counts:
        allowed = ", ".join(f"{count} ({FORMS[count]})" for count in counts)
        raise InputError(f"{what}: {len(found)} numbers are no pose; give {allowed}")
    if len(found) == 6:
        return from_rpy(found[:3], found[3:], what)
    if len(found) == 7:
        return from_quaternion(found[:3], found[3:], what)
    return checked(np.reshape(found, (-1, 4)), what)


def numbers(text: str, what: str) -> list[float]:
    """Return the numbers of ``text``, separated by blanks or commas; InputError for anything else."""
    found = []
    for word in text.replace(",", " ").split():
        try:
            found.append(float(word))
        except ValueError:
            raise InputError(f"{what}: {word!r} is not a number") from None
        if not abs(found[-1]) <= LARGEST:
            raise InputError(f"{what}: {word!r} is not a finite number of at most {LARGEST:g}")
    return found
