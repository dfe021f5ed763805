"""Writing a file whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from armtempo.errors import InputError


def replace_text(path: Path, text: str) -> None:
    """Write a file aside and put it in place of the old one, so that it is never half there.

    A link stays one; a pipe or a device, such as /dev/stdout, is written to. Raises InputError where it
    cannot be written; what was there before stays.
    """
    try:
        if path.exists() and not path.is_file():
            path.write_text(text, encoding="utf-8")
        else:
            _replace(path.resolve(), text)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {why(error)}", "choose another place") from None


def why(error: Exception) -> str:
    """The reason as the operating system or a decoder gives it, without the path."""
    return getattr(error, "strerror", None) or str(error)


def _replace(path: Path, text: str) -> None:
    aside = path.with_name(f".{path.name}.{os.getpid()}.new")
    try:
        aside.write_text(text, encoding="utf-8")
        os.replace(aside, path)
    except OSError:
        if aside.is_file():
            aside.unlink()
        raise
