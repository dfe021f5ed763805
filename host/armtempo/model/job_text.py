"""A taught job as text: its via points one by one, in a file that plans at once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armtempo_shared.limits import MAX_NAME

from armtempo.basics.errors import InputError

_HEAD = """\
# Via points that were taught with 'armtempo teach'; every key: armtempo help files
name = "{name}"
"""
_VIA = """
[[via]]
angles_deg = [{angles}]
"""


def name_of(path: Path) -> str:
    """The name of a job in a file, made of the file's."""
    name = "".join(
        letter if letter.isascii() and (letter.isalnum() or letter in "-_") else "-" for letter in path.stem
    )
    return name[:MAX_NAME].strip("-") or "taught"


def of_points(name: str, points_deg: Sequence[Sequence[float]]) -> str:
    """The job through via points, each (J,) in degrees; InputError for fewer than two."""
    if len(points_deg) < 2:
        raise InputError(
            f"{len(points_deg)} via point{'' if len(points_deg) == 1 else 's'} make no motion, so no job was written",
            "take at least 2, where the arm stands differently",
        )
    vias = [_VIA.format(angles=", ".join(f"{angle:.12g}" for angle in row)) for row in points_deg]
    return "".join([_HEAD.format(name=name), *vias])
