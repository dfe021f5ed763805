"""Becomes ``/flash/lib/armtempo_archive.mpy``: finds the program's modules in one file, each deflated.

For MicroPython's own firmware, in whose flash they have no room otherwise; ``boot.py`` imports it. The file begins with
the length of its index in two bytes, then the index, a line "PACKAGE/MODULE OFFSET" for each, the package without
"armtempo_". It is written by ``deploy/archive.py`` on the host.
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
    """As MicroPython wants a file system, as far as imports need it."""

    def mount(self, readonly: bool, mkfs: bool) -> None:
        """Nothing to do."""

    def umount(self) -> None:
        """The same."""

    def stat(self, path: str) -> "tuple[int, ...]":
        """Whether a module or a folder is there; OSError."""
        return (_REGULAR if self.find(path) else _FOLDER,) + (0,) * 9

    def open(self, path: str, mode: str) -> "Any":
        """A module's bytes."""
        offset = self.find(path)
        file = open(_FILE, "rb")  # noqa: SIM115  the import closes it
        file.seek(offset)
        return deflate.DeflateIO(file, deflate.ZLIB, 0, True)

    def find(self, path: str) -> int:
        """Where a module begins, 0: a folder; OSError. The index is read each time, as it would take heap."""
        with open(_FILE, "rb") as file:
            index = file.read(int.from_bytes(file.read(_LENGTH_BYTES), "little"))
        is_module = path.endswith(_ENDING)
        name = "\n" + (path[_BEFORE : -len(_ENDING)] + " " if is_module else path[_BEFORE:] + "/")
        begin = index.find(name.encode())
        if begin < 0:
            raise OSError(_ENOENT)
        begin += len(name)
        return int(index[begin : index.find(b"\n", begin)]) if is_module else 0


try:
    vfs.umount(_POINT)
except OSError:  # it is not mounted, which it may be on a virtual board
    pass
vfs.mount(Archive(), _POINT)
sys.path.append(_POINT)
