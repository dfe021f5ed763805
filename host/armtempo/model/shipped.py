"""The arm files that ship with armtempo, by name."""

from __future__ import annotations

from pathlib import Path

from armtempo.errors import InputError
from armtempo.model.arm import Arm, default_path, load_arm

PAPER = "paper"
"""Name of the paper's 1:5 arm, which is taken where none is named."""


def shipped() -> dict[str, Path]:
    """The arm file of each name: the paper's arm first, then by alphabet."""
    others = sorted((default_path().parent / "arms").glob("*.toml"))
    return {PAPER: default_path(), **{path.stem: path for path in others}}


def load_shipped(name: str) -> Arm:
    """The shipped arm of that name.

    Raises InputError where there is none, naming those there are.
    """
    files = shipped()
    if name not in files:
        raise InputError(f"no arm {name!r} ships with armtempo; there are: {', '.join(files)}")
    return load_arm(files[name])


def find(given: Path | str) -> tuple[Path, bool]:
    """The arm file that a user means, and whether it is a shipped one: a path wins over a name.

    Raises InputError where it is neither.
    """
    path, files = Path(given), shipped()
    if path.exists():
        return path, False
    if str(given) in files:
        return files[str(given)], True
    raise InputError(
        f"{given}: there is no such file, and no arm of that name ships; those that do: {', '.join(files)}"
    )
