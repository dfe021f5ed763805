"""Writing a file completely or not at all, without overwriting files that should be kept."""

from __future__ import annotations

import errno
import os
import shutil
import threading
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from armtempo.basics.errors import InputError

_CANNOT_SYNC = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP)


def replace_text(path: Path, text: str, newline: str | None = None) -> None:
    """Write a temporary file and rename it, so that the file is never incomplete, not even after a power failure.

    ``newline``: as in ``open``. A symbolic link is followed; a pipe or a device, such as /dev/stdout, is
    written directly. Raises InputError if it cannot be written; the old file is kept.
    """
    try:
        if path.exists() and not path.is_file():
            path.write_text(text, encoding="utf-8", newline=newline)
        else:
            _replace(path.resolve(), text, newline)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {os_reason(error)}", "choose another place") from None


def replace_texts(texts: Mapping[Path, str], newline: str | None = None) -> None:
    """Give files new texts: all of them, or none if one cannot be written.

    Each file is complete at any time, as with ``replace_text``; if the power fails in between, some are new and some
    old. ``newline``: as in ``open``. Raises InputError if one cannot be written; all old files are kept.
    """
    new: dict[Path, Path] = {}
    old: dict[Path, Path] = {}
    at = Path()
    try:
        for at, text in texts.items():
            file = at.resolve()
            new[file] = _aside(file, "new")
            _write(new[file], text, newline)
            old[file] = _aside(file, "old")
            shutil.copy2(file, old[file])  # going back must not need space on the disk
        for at in list(new):
            os.replace(new[at], at)
            del new[at]
            _sync_folder(at.parent)
    except OSError as error:
        for file, before in old.items():
            if file not in new:
                os.replace(before, file)
        raise InputError(
            f"{at}: cannot be written: {os_reason(error)}; no file was changed", "make it writable"
        ) from None
    finally:
        for left in (*new.values(), *old.values()):
            left.unlink(missing_ok=True)


def check_not_input(target: Path, inputs: Iterable[Path | str]) -> None:
    """Raise InputError if ``target`` is one of the ``inputs``: inputs are never overwritten."""
    for file in inputs:
        with suppress(OSError):
            if file and target.exists() and os.path.samefile(target, file):
                raise InputError(
                    f"{target} is an input of this command and is not overwritten", "choose another name"
                )


def check_replaceable(target: Path, text: str, force: bool, rule: str = "") -> None:
    """Raise InputError if ``target`` exists with content other than ``text``, unless ``force``.

    ``rule``: when it is replaced without ``force``, for the message.
    """
    if force or not target.is_file() or _holds(target, text):
        return
    kept = f" ({rule})" if rule else ""
    raise InputError(
        f"{target} exists with other content and is not replaced{kept}",
        "choose another name, or replace it with --force",
    )


def _holds(path: Path, text: str) -> bool:
    try:
        return path.read_text(encoding="utf-8") == text
    except (OSError, UnicodeDecodeError):
        return False


def os_reason(error: Exception) -> str:
    """The reason as the operating system or a decoder gives it, without the path."""
    return getattr(error, "strerror", None) or str(error)


def _replace(path: Path, text: str, newline: str | None) -> None:
    aside = _aside(path, "new")
    try:
        _write(aside, text, newline)
        os.replace(aside, path)
        _sync_folder(path.parent)
    except OSError:
        if aside.is_file():
            aside.unlink()
        raise


def _aside(path: Path, kind: str) -> Path:
    """The name of a temporary file beside another, of this thread alone."""
    return path.with_name(f".{path.name}.{os.getpid()}.{threading.get_ident()}.{kind}")


def _write(path: Path, text: str, newline: str | None) -> None:
    with path.open("w", encoding="utf-8", newline=newline) as file:
        file.write(text)
        file.flush()
        _sync(file.fileno())  # otherwise the name may reach the disk before the content does


def _sync(file: int) -> None:
    """Have a file's content on the disk; some file systems, as of network drives, cannot do that."""
    try:
        os.fsync(file)
    except OSError as error:
        if error.errno not in _CANNOT_SYNC:
            raise


def _sync_folder(folder: Path) -> None:
    """Have the new name on the disk, too, where the system can do that; the content is there in any case."""
    with suppress(OSError):
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)
