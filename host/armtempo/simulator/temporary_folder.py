"""A virtual board's temporary folder: kept while its launcher or its process lives, else removed by a later one."""

from __future__ import annotations

import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

PREFIX = "armtempo-virtual-"
_LOCK = "lock"


class TemporaryFolder:
    """A new folder; ``lock`` is a file descriptor that keeps it, also in a process that inherits it.

    Making one removes those whose owners were killed.
    """

    def __init__(self) -> None:
        import fcntl  # of POSIX, and so are virtual boards

        _sweep()
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
        unlocked = self.path / "new"
        self.lock = os.open(unlocked, os.O_CREAT | os.O_RDWR, 0o600)
        fcntl.flock(self.lock, fcntl.LOCK_EX)
        unlocked.rename(self.path / _LOCK)  # under this name it is always locked, or abandoned

    def remove(self) -> None:
        """Remove it with all that is in it; nothing happens the second time."""
        if self.lock >= 0:
            shutil.rmtree(self.path, ignore_errors=True)
            os.close(self.lock)
            self.lock = -1


def _sweep() -> None:
    import fcntl

    for lock in Path(tempfile.gettempdir()).glob(f"{PREFIX}*/{_LOCK}"):
        try:
            descriptor = os.open(lock, os.O_RDWR)
        except OSError:  # another user's, or just removed
            continue
        with suppress(OSError):  # it is in use
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(lock.parent, ignore_errors=True)
        os.close(descriptor)
