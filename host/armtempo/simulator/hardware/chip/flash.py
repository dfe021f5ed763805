"""The board's flash: a folder of the host, seen as ``/flash``, with the chip's size, write times and failures.

A second folder may be an SD card, seen as ``/sd``: without limits of size, and without failures.

Each change (a file opened for writing, a piece written, a close, a rename, a removal, a new folder) is one
flash operation. A power cut can be injected at the n-th of them: it leaves that operation half done (a
piece of the data written; a rename over an existing file stopped after the old one is gone, as FAT does it),
files still open for writing empty, and files that were closed but not synced since, whatever their name now; and the
board starts again. The chip writes through a cache: only ``sync`` makes what was written last.
"""

import os

from machine_state import Reset

BLOCK = 512
BLOCKS = 190
"""Of an STM32F4DISC's 224 blocks (112 KB) those that FAT12 has for files and folders; it takes 34 itself: one for the
boot sector, one for the table, 32 for the root folder."""
_WRITE_MS = 1
_CLOSE_MS = 60
_FORMAT_MS = 2000
_POWER_ON = 1
_DIRECTORY = 0x4000
_ENTRY = 32  # bytes in a folder for a short name, and for each 13 letters of one that is not short
_EPERM, _ENOENT, _EIO, _EEXIST, _EISDIR, _EINVAL, _ENOSPC = 1, 2, 5, 17, 21, 22, 28
NO_FILE_SYSTEM, UNREADABLE = "no file system", "unreadable"
"""Kinds of damage: the firmware finds no file system; it mounts one in which nothing can be read or written."""


class FlashFolder:
    """The folder ``root`` of ``size`` blocks; ``stall(ms)`` lets time pass while the flash is busy.

    ``programs``: folders of the host that hold a program which is not deployed to the flash; read only.
    ``damage``: a kind of damage, or "". ``mounts``: folder of the host by mount point.
    """

    def __init__(self, root, size, programs, stall, cut_at=0, damage=""):
        self.root = root
        self.damage = damage
        self.mounts = {"/flash": root}
        self.size = size
        self._programs = programs
        self.cwd = "/flash"
        self.operations = 0
        self._stall = stall
        self.busy_ms = 0  # an injected fault: each operation takes longer
        self._cut_at = cut_at
        self._writing = []
        self._unsynced = []
        self.renamed = None

    def real(self, path):
        """Where a path of the board is on the host; OSError if nothing is mounted, or can be read."""
        for program in self._programs:
            if path.startswith(program):
                return path
        path = self.absolute(path)
        point = path[: (path + "/").find("/", 1)]
        if point not in self.mounts:
            raise OSError(_ENOENT)
        if self.damage and point == "/flash":
            raise OSError(_EIO)
        return self.mounts[point] + path[len(point) :]

    def absolute(self, path):
        """A path of the board, without dots, from its root."""
        parts = []
        for point, root in self.mounts.items():
            if path.startswith(root + "/"):  # a module's __file__
                path = point + path[len(root) :]
        whole = path if path.startswith("/") else self.cwd + "/" + path
        for part in whole.split("/"):
            if part == "..":
                parts = parts[:-1]
            elif part not in ("", "."):
                parts.append(part)
        return "/" + "/".join(parts)

    def operation(self, ms=_WRITE_MS):
        """Count a change; True if the power fails during it."""
        self.operations += 1
        self._stall(ms + self.busy_ms)
        return self.operations == self._cut_at

    def power_fails(self):
        """Files that were being written, or were not synced, are left empty; the board starts again."""
        for file in self._writing:
            file.cut()
        for path in self._unsynced:
            real_open(path, "wb").close()
        self._writing = []
        self._unsynced = []
        raise Reset(_POWER_ON)

    def blocks(self, path):
        """Blocks that a file takes, or a folder with all that is in it."""
        if not is_folder(path):
            return -(-os.stat(path)[6] // BLOCK)
        names = os.listdir(path)
        own = 0 if path == self.root else 2 * _ENTRY + sum([_entry_bytes(name) for name in names])
        return -(-own // BLOCK) + sum([self.blocks(path + "/" + name) for name in names])

    def free_blocks(self):
        """Blocks that are free."""
        return max(0, self.size - self.blocks(self.root))

    def mount(self, point):
        """Mount the flash there."""
        if point in self.mounts:
            raise OSError(_EPERM)
        self.mounts[point] = self.root

    def umount(self, point):
        """Unmount what is mounted."""
        if point not in self.mounts:
            raise OSError(_EINVAL)
        del self.mounts[point]
        self.cwd = "/"

    def format(self):
        """Make a fresh, empty file system."""
        self._stall(_FORMAT_MS)
        self.damage = ""
        for name in os.listdir(self.root):
            remove_all(self.root + "/" + name)

    def open(self, path, mode="r", **options):
        """As the built-in ``open``."""
        real = path if isinstance(path, int) else self.real(path)
        if not ("w" in mode or "a" in mode or "+" in mode):
            return real_open(real, mode)
        if self.operation():
            self.power_fails()
        file = Written(self, real_open(real, mode), real)
        self._writing.append(file)
        return file

    def closed(self, file):
        """A written file was closed."""
        if file in self._writing:
            if self.operation(_CLOSE_MS):
                self.power_fails()
            self._writing.remove(file)
            self._unsynced.append(file.path)

    def sync(self):
        """What was written lasts."""
        self._unsynced = []

    def rename(self, old, new):
        """As FAT does it: an existing file of the new name is removed first."""
        old, new = self.real(old), self.real(new)
        os.stat(old)
        if exists(new) and old != new:
            if is_folder(new):
                raise OSError(_EEXIST)
            if self.operation():
                self.power_fails()
            os.remove(new)
            self._unsynced = [path for path in self._unsynced if path != new]
        if self.operation():
            self.power_fails()
        os.rename(old, new)
        self._unsynced = [new if path == old else path for path in self._unsynced]
        if self.renamed:
            self.renamed()

    def change(self, function, path):
        """A change of one path by ``function``."""
        real = self.real(path)
        if function is not os.mkdir:
            os.stat(real)
        if self.operation():
            self.power_fails()
        function(real)
        self._unsynced = [path for path in self._unsynced if exists(path)]


class Written:
    """A file open for writing."""

    def __init__(self, flash, file, path):
        self._flash = flash
        self._file = file
        self.path = path

    def write(self, data):
        """Write; OSError(ENOSPC) if the flash is full."""
        if self._flash.operation():
            self._file.write(data[: len(data) // 2])
            self._flash.power_fails()
        self._file.flush()
        size = os.stat(self.path)[6]
        needed = -(-(size + len(data)) // BLOCK) - -(-size // BLOCK)
        if self.path.startswith(self._flash.root + "/") and needed > self._flash.free_blocks():
            raise OSError(_ENOSPC)
        return self._file.write(data)

    def cut(self):
        """The power failed: the directory still has the length 0."""
        self._file.close()
        real_open(self.path, "wb").close()

    def close(self):
        """Finish the file."""
        self._flash.closed(self)
        self._file.close()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()

    def __getattr__(self, name):
        return getattr(self._file, name)


real_open = open


def _entry_bytes(name):
    """What a name takes in a folder."""
    base, _, extension = name.partition(".")
    fits = len(base) <= 8 and len(extension) <= 3 and "." not in extension
    one_case = all([part in (part.lower(), part.upper()) for part in (base, extension)])
    return _ENTRY * (1 if fits and one_case else 1 + -(-len(name) // 13))


def is_folder(path):
    """Whether a path of the host is a folder."""
    return bool(os.stat(path)[0] & _DIRECTORY)


def exists(path):
    """Whether a path of the host is there."""
    try:
        os.stat(path)
    except OSError:
        return False
    return True


def remove_all(path):
    """Remove a file, or a folder with all that is in it, of the host."""
    if is_folder(path):
        for name in os.listdir(path):
            remove_all(path + "/" + name)
        os.rmdir(path)
    else:
        os.remove(path)
