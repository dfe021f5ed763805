"""The files of claims: their folders and format.

A file has one field of ``claim.PortClaim`` per line, in its order; line ends in a field are escaped. This
module imports little, because ``armtempo stop`` reads claims first.
"""

from __future__ import annotations

import os
import stat

TYPE_CHECKING = False  # as in "typing", whose import takes longer than the rest of a stop
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

VERSION = 1
"""Version of the file and of the socket's messages."""
SUFFIX = ".claim"
_LONGEST_SOCKET_PATH = 100
"""Bytes; operating systems allow 104 to 108."""
_TEMPORARY = ("/tmp", "/var/tmp")


def folders() -> Iterator[str]:
    """The folders for claims, best first: new ones are in the first that only this user can access."""
    runtime = os.environ.get("XDG_RUNTIME_DIR") or (os.environ.get("LOCALAPPDATA") if os.name == "nt" else "")
    if runtime and os.path.isdir(runtime):
        yield from _short(os.path.join(runtime, "armtempo"))
    user = str(os.getuid()) if hasattr(os, "getuid") else os.environ.get("USERNAME", "")
    yield os.path.join(_temporary(), f"armtempo-{user}")
    # Another user may have made that one
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    yield from _short(os.path.join(cache, "armtempo", _machine()))


def _short(folder: str) -> list[str]:
    """The folder, if the path of a socket in it is not too long."""
    return (
        [folder] if len(os.fsencode(folder)) + len("/0123456789abcdef.socket") <= _LONGEST_SOCKET_PATH else []
    )


def _machine() -> str:
    """Name of this machine: several may share a home folder, but no sockets."""
    return os.uname().nodename if hasattr(os, "uname") else os.environ.get("COMPUTERNAME", "")


def is_private(folder: str) -> bool:
    """Whether the folder exists and only this user can access it."""
    try:
        found = os.lstat(folder)
    except OSError:
        return False
    if not stat.S_ISDIR(found.st_mode):
        return False
    return not hasattr(os, "getuid") or (found.st_uid == os.getuid() and not found.st_mode & 0o077)


def paths() -> Iterator[str]:
    """The files of all claims of this user's programs."""
    for folder in folders():
        for name in sorted(os.listdir(folder)) if is_private(folder) else ():
            if name.endswith(SUFFIX):
                yield os.path.join(folder, name)


def text(fields: Iterable[str]) -> str:
    """The content of a claim's file."""
    return "".join(field.encode("unicode_escape").decode() + "\n" for field in fields)


def read(path: str) -> list[str]:
    """The fields in a file; empty if it is missing, damaged or of another version."""
    try:
        with open(path, "rb") as file:
            fields = [line.decode("unicode_escape") for line in file.read().split(b"\n")[:-1]]
    except (OSError, UnicodeError):
        return []
    return fields if fields[-1:] == [str(VERSION)] else []


def _temporary() -> str:
    """The folder for temporary files as ``tempfile`` chooses it, without the time for importing that."""
    wanted = [os.environ.get(name, "") for name in ("TMPDIR", "TEMP", "TMP")]
    if os.name == "posix":
        wanted += _TEMPORARY
    for place in wanted:
        if place and os.path.isdir(place) and os.access(place, os.W_OK | os.X_OK):
            return os.path.abspath(place)
    import tempfile

    return tempfile.gettempdir()
