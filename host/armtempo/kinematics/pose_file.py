"""A text file of poses: one a line, numbers separated by blanks or commas, ``-`` for what is free, ``#`` a comment."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from armtempo.basics.atomic_file import os_reason
from armtempo.basics.errors import InputError
from armtempo.model.pose import LARGEST, checked, from_quaternion
from armtempo.model.tool_pose import WHOLE, Pose

FORMS = {
    3: "x y z: position only",
    6: "x y z roll pitch yaw, with - for an angle that is free",
    7: "x y z and quaternion w x y z",
    12: "3 rows of a matrix",
    16: "4 rows of a matrix",
}
"""How many numbers make a pose."""

FREE = "-"


def read(path: Path | str) -> list[Pose]:
    """Return the poses of a file; InputError names the file and the line that is wrong."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path}: cannot be read as text ({os_reason(error)})",
            "check the path, and that it is plain text in UTF-8",
        ) from error
    poses = []
    for number, line in enumerate(text.splitlines(), 1):
        content = line.split("#")[0]
        if content.strip():
            poses.append(parse(content, f"{path}, line {number}"))
    if not poses:
        raise InputError(f"{path}: no pose in it", "write one a line, for instance: x y z roll pitch yaw")
    return poses


def parse(text: str, what: str, counts: tuple[int, ...] = tuple(FORMS)) -> Pose:
    """Return the pose that ``text`` writes in as many numbers as ``counts`` allows."""
    words = text.replace(",", " ").split()
    if len(words) not in counts:
        allowed = ", ".join(f"{count} ({FORMS[count]})" for count in counts)
        raise InputError(f"{what}: {len(words)} numbers are not a pose", f"give {allowed}")
    if len(words) in (3, 6):
        position = numbers(" ".join(words[:3]), what)
        fixed = {name: word for name, word in zip(WHOLE, words[3:], strict=False) if word != FREE}
        angles = dict(zip(fixed, numbers(" ".join(fixed.values()), what), strict=True))
        return Pose.of_angles(position, angles, what)
    found = numbers(text, what)
    if len(words) == 7:
        return Pose.of_matrix(from_quaternion(found[:3], found[3:], what))
    return Pose.of_matrix(checked(np.reshape(found, (-1, 4)), what))


def numbers(text: str, what: str) -> list[float]:
    """Return the numbers of ``text``, separated by blanks or commas; InputError for anything else."""
    found = []
    for word in text.replace(",", " ").split():
        try:
            found.append(float(word))
        except ValueError:
            raise InputError(f"{what}: {word!r} is not a number", "write it like 12.5 or 1e-3") from None
        if not abs(found[-1]) <= LARGEST:
            raise InputError(
                f"{what}: {word!r} is not a finite number of at most {LARGEST:g}",
                "correct it; units are mm and degrees",
            )
    return found
