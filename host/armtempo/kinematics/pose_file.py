"""A text file of poses: one pose a line, numbers separated by blanks or commas, ``#`` starts a comment."""

from __future__ import annotations

from pathlib import Path

from armtempo.errors import InputError
from armtempo.kinematics.geometry import Array
from armtempo.kinematics.pose import from_numbers


def read(path: Path | str) -> list[Array]:
    """Return the poses of a file, (4, 4) each; InputError names the file and the line that is wrong."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as text ({error})") from error
    poses = []
    for number, line in enumerate(text.splitlines(), 1):
        content = line.split("#")[0].replace(",", " ")
        if content.strip():
            poses.append(parse(content, f"{path}, line {number}"))
    if not poses:
        raise InputError(f"{path}: no pose in it; write one a line, for instance: x y z roll pitch yaw")
    return poses


def parse(text: str, what: str) -> Array:
    """Return the pose that ``text`` writes as 6, 7, 12 or 16 numbers."""
    numbers = []
    for word in text.replace(",", " ").split():
        try:
            numbers.append(float(word))
        except ValueError:
            raise InputError(f"{what}: {word!r} is not a number") from None
    return from_numbers(numbers, what)
