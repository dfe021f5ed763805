"""Becomes ``/flash/lib/armtempo_archive.mpy``: finds the program's modules in one file, most of them deflated.

For MicroPython's own firmware, in whose flash they have no room otherwise; ``boot.py`` imports it. The file begins with
the length of its index in two bytes, then the index, a line "PATH OFFSET" for each module, the offset below 0 where it
is not deflated. It is written by ``deploy/archive.py`` on the host.
"""

import sys

import deflate
import vfs
from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_FILE = "/flash/lib/armtempo.z"
_POINT = "/armtempo"
_WINDOW_BITS = const(10)
_FOLDER = const(0x4000)
_REGULAR = const(0x8000)
_ENOENT = const(2)
_LENGTH_BYTES = const(2)


class Archive:
    """As MicroPython wants a file system, as far as imports need it."""

    def __init__(self) -> None:
        with open(_FILE, "rb") as file:
            self._index = file.read(int.from_bytes(file.read(_LENGTH_BYTES), "little"))

    def mount(self, readonly: bool, mkfs: bool) -> None:
        """Nothing to do."""

    def umount(self) -> None:
        """The same."""

    def stat(self, path: str) -> "tuple[int, ...]":
        """Whether a module or a folder is there; OSError."""
        kind = _REGULAR if self._find(path + " ") >= 0 else _FOLDER
        if kind == _FOLDER and self._find(path + "/") < 0:
            raise OSError(_ENOENT)
        return (kind,) + (0,) * 9

    def open(self, path: str, mode: str) -> "Any":
        """A module's bytes."""
        at = self._find(path + " ")
        if at < 0:
            raise OSError(_ENOENT)
        begin = at + len(path) + 1
        offset = int(self._index[begin : self._index.find(b"\n", begin)])
        file = open(_FILE, "rb")
        file.seek(abs(offset))
        if offset < 0:
            return file
        return deflate.DeflateIO(file, deflate.RAW, _WINDOW_BITS, True)

    def _find(self, text: str) -> int:
        """Where a line of the index begins so."""
        return self._index.find(b"\n" + text.encode()) + 1 or -1


try:
    vfs.umount(_POINT)
except OSError:  # it is not mounted, which it may be on a virtual board
    pass
vfs.mount(Archive(), _POINT)
sys.path.append(_POINT)
