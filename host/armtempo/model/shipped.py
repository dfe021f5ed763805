"""The shipped files: arms by name, the paper's job."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from armtempo.basics.errors import InputError

_DATA = Path(__file__).parents[1] / "data"
PAPER = "paper"
"""Name of the paper's 1:5 arm, the default arm."""


@dataclass(frozen=True)
class ArmFile:
    """An arm file, and whether it is a shipped one."""

    path: Path
    ships: bool
    """Whether it was found by the name of a shipped arm."""


def arm_path() -> Path:
    """The arm file of the paper's 1:5 arm."""
    return _DATA / "paper_arm.toml"


def job_path() -> Path:
    """The job file of the paper's feeding motion."""
    return _DATA / "feeding.toml"


def files() -> dict[str, Path]:
    """The arm files by name, the paper's arm first, then in alphabetical order."""
    paper = arm_path()
    return {PAPER: paper, **{path.stem: path for path in sorted((paper.parent / "arms").glob("*.toml"))}}


def find(given: Path | str) -> ArmFile:
    """The arm file of a path or of a shipped arm's name; a file has precedence.

    Raises InputError, with the names of the shipped arms, if there is neither.
    """
    path, shipped = Path(given), files()
    named = str(given) in shipped
    if path.exists() and not (named and path.is_dir()):
        return ArmFile(path, False)
    if named:
        return ArmFile(shipped[str(given)], True)
    raise InputError(
        f"{given}: neither a file nor the name of a shipped arm",
        f"check the path, or give a shipped arm: {', '.join(shipped)}",
    )
