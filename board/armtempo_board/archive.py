"""Becomes ``/flash/lib/armtempo_archive.mpy``: finds the program's modules in one file, most of them deflated.

For MicroPython's own firmware, in whose flash they have no room otherwise; ``boot.py`` imports it. The file begins with
the length of its index in two bytes, then the index, a line "PACKAGE/MODULE OFFSET" for each, the package without
"armtempo_", the offset below 0 if the module is not deflated. It is written by ``deploy/archive.py`` on the host.
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
_FOLDER = const(0x4000)
_REGULAR = const(0x8000)
_ENOENT = const(2)
_LENGTH_BYTES = const(2)
_BEFORE = const(10)  # letters of "/armtempo_"
_ENDING = ".mpy"


class Archive:
    """As MicroPython wants a file system, as far as imports need it.

    The names of the rest are such as MicroPython has anyway: others would take heap.
    """

    def __init__(self) -> None:
        with open(_FILE, "rb") as file:
            self.index = file.read(int.from_bytes(file.read(_LENGTH_BYTES), "little"))

    def mount(self, readonly: bool, mkfs: bool) -> None:
        """Nothing to do."""

    def umount(self) -> None:
        """The same."""

    def stat(self, path: str) -> "tuple[int, ...]":
        """Status of a module or folder; raises OSError if it does not exist."""
        if self.seek(path):
            return (_REGULAR,) + (0,) * 9
        if self.find(path[_BEFORE:] + "/") < 0:
            raise OSError(_ENOENT)
        return (_FOLDER,) + (0,) * 9

    def open(self, path: str, mode: str) -> "Any":
        """A module's bytes."""
        offset = self.seek(path)
        if not offset:
            raise OSError(_ENOENT)
        file = open(_FILE, "rb")  # noqa: SIM115  the import closes it
        file.seek(abs(offset))
        if offset < 0:
            return file
        return deflate.DeflateIO(file, deflate.ZLIB, 0, True)

    def seek(self, path: str) -> int:
        """Offset of a module; 0: it does not exist."""
        name = path[_BEFORE : -len(_ENDING)] + " "
        at = self.find(name)
        if at < 0 or not path.endswith(_ENDING):
            return 0
        begin = at + len(name)
        return int(self.index[begin : self.index.find(b"\n", begin)])

    def find(self, text: str) -> int:
        """Place of a line of the index with this beginning, or -1."""
        at = self.index.find(b"\n" + text.encode())
        return at + 1 if at >= 0 else -1


try:
    vfs.umount(_POINT)
except OSError:  # it is not mounted, which it may be on a virtual board
    pass
vfs.mount(Archive(), _POINT)
sys.path.append(_POINT)
