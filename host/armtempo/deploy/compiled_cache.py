"""The compiled program, kept in the user's cache folder: making it takes seconds, and only versions change it."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import sys
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from armtempo.basics import atomic_file
from armtempo.basics.errors import InputError

Files = Mapping[str, bytes]
"""By the path on the board, below the library folder."""


def fetch(name: str, key: str, make: Callable[[], Files]) -> Files:
    """The files that were kept under ``name``, if they were made for ``key`` and are undamaged; else ``make()``.

    If the folder cannot be written, nothing is kept. ``key``: as of ``key_of``.
    """
    path = _folder() / f"{name}.json"
    with suppress(OSError, ValueError, KeyError, TypeError):
        kept = json.loads(path.read_text(encoding="utf-8"))
        files = {place: base64.b64decode(text) for place, text in kept["files"].items()}
        if kept["key"] == key and kept["check"] == _check(files):
            return files
    files = dict(make())
    texts = {place: base64.b64encode(data).decode() for place, data in files.items()}
    with suppress(OSError, InputError):
        path.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"key": key, "check": _check(files), "files": texts}, indent=1)
        atomic_file.replace_text(path, text + "\n")
    return files


def key_of(folders: Iterable[Path], *also: str) -> str:
    """What all files in the folders hold, and ``also``, as one checksum."""
    found = hashlib.sha256(repr((sys.version_info[:2], also)).encode())
    for folder in folders:
        for path in sorted(folder.rglob("*")):
            if path.is_file() and path.suffix != ".pyc":
                data = path.read_bytes()
                found.update(f"{path.relative_to(folder).as_posix()} {len(data)} ".encode() + data)
    return found.hexdigest()


def _check(files: Files) -> str:
    found = hashlib.sha256()
    for place in sorted(files):
        found.update(f"{place} {len(files[place])} ".encode() + files[place])
    return found.hexdigest()


def _folder() -> Path:
    """Where programs of this user keep what can be made again (XDG Base Directory Specification on Linux)."""
    if os.name == "nt":
        base = os.environ.get("LOCALAPPDATA")
    elif sys.platform == "darwin":
        base = os.path.expanduser("~/Library/Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return Path(base or os.path.expanduser("~")) / "armtempo"
