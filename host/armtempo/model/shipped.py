"""The files that ship with armtempo: arms by name, the paper's job."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from armtempo.basics.errors import InputError

_DATA = Path(__file__).parents[1] / "data"
PAPER = "paper"
"""Name of the paper's 1:5 arm, which is taken where none is named."""


@dataclass(frozen=True)
class ArmFile:
    """An arm file that was asked for."""

    path: Path
    ships: bool
    """Whether it was found by the name of an arm that ships."""


def arm_path() -> Path:
    """The arm file of the paper's 1:5 arm."""
    return _DATA / "paper_arm.toml"


def job_path() -> Path:
    """The job file of the paper's feeding motion."""
    return _DATA / "feeding.toml"


def files() -> dict[str, Path]:
    """The arm file of each name: the paper's arm first, then by alphabet."""
    paper = arm_path()
    return {PAPER: paper, **{path.stem: path for path in sorted((paper.parent / "arms").glob("*.toml"))}}


def find(given: Path | str) -> ArmFile:
    """The arm file that a user means by a path or a name; a file of that name wins over an arm that ships.

    Raises InputError if there is neither, naming the arms that ship.
    """
    path, shipped = Path(given), files()
    named = str(given) in shipped
    if path.exists() and not (named and path.is_dir()):
        return ArmFile(path, False)
    if named:
        return ArmFile(shipped[str(given)], True)
    raise InputError(
        f"{given}: no such file, and no arm of that name ships with armtempo",
        f"check the path, or give one of those that do: {', '.join(shipped)}",
    )
