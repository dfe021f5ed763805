"""The board's flash: a folder of the host used as ``/flash``, with the chip's size, write times, wear and failures.

A second folder may be used as an SD card, ``/sd``, of unlimited size and without failures.

Each change (open for writing, write, close, rename, remove, mkdir) is one flash operation. A power cut can be
injected at the n-th one. It leaves

- that operation incomplete: part of the data is written; of a rename over an existing file, as in FAT, only the
  old file is gone;
- files empty that are open for writing, or were not synced since their close (the chip writes through a
  cache), also after a rename.

Then the board restarts.
"""

import json
import os

from machine_state import Reset

from chip.fat import BLOCK, Fat, entries_of
from chip.flash_cache import FlashCache

BLOCKS = 190
"""Blocks for files and folders: an STM32F4DISC's 224 (112 KB) less the 34 of FAT12's boot sector (1), table (1)
and root folder (32)."""
_POWER_ON = 1
_DIRECTORY = 0x4000
_ENTRY = 32  # bytes in a folder for a short name, and for each 13 characters of a long one
_EPERM, _ENOENT, _EIO, _EEXIST, _EISDIR, _EINVAL, _ENOSPC = 1, 2, 5, 17, 21, 22, 28
ERASURES = ".erasures"
"""Suffix of the file next to the folder with the erasures of each sector."""
_NO_FOLDER = "."
"""A board without files of its own (``bare_board``)."""
NO_FILE_SYSTEM, UNREADABLE = "no file system", "unreadable"
"""Kinds of damage: the firmware finds no file system, or mounts one in which every access fails."""


class FlashFolder:
    """The folder ``root``, with ``size`` blocks; ``stall(ms)`` is called while the flash is busy.

    ``programs``: folders of the host with a program that is not deployed to the flash; read only.
    ``damage``: a kind of damage, or "". ``mounts``: folder of the host by mount point.
    """

    def __init__(self, root, size, programs, stall, cut_at=0, damage=""):
        self.erasures = _counted(root)
        self.root = root
        self.damage = damage
        self.mounts = {"/flash": root}
        self.size = size
        self._programs = programs
        self.cwd = "/flash"
        self.operations = 0
        self.stall = stall
        self.busy_ms = 0  # an injected fault: each operation takes longer
        self._cut_at = cut_at
        self._writing = []
        self._unsynced = []
        self.renamed = None
        self.sectors = None
        self._fat = None  # from the first change on

    def real(self, path):
        """The host's path of a path on the board; OSError if nothing is mounted there, or it is unreadable."""
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
        """An absolute path on the board, without dots."""
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

    def operation(self):
        """Count a change; True if the power fails during it."""
        self.operations += 1
        self.stall(self.busy_ms)
        return self.operations == self._cut_at

    def erased(self, sector, ms):
        """A sector was erased and written, which takes ``ms``: count it, and stand still."""
        key = str(sector)
        self.erasures[key] = self.erasures.get(key, 0) + 1
        if self.root != _NO_FOLDER:
            with real_open(self.root + ERASURES, "w") as file:
                json.dump(self.erasures, file)
        self.stall(ms)

    def _file_system(self):
        if self._fat is None:
            self._fat = Fat(FlashCache(self.erased), self.size)
            self._learn("")
        return self._fat

    def _learn(self, path):
        """Know a file or folder of the host's folder, as if it had long been in the flash."""
        cache, self._fat.cache = self._fat.cache, _Unwritten()
        real = self.root + "/" + path if path else self.root
        if exists(real) and is_folder(real):
            if path:
                self._fat.mkdir(path)
            for name in sorted(os.listdir(real)):
                self._learn(path + "/" + name if path else name)
        elif exists(real):
            self._fat.open(path)
            self._fat.write(path, os.stat(real)[6])
            self._fat.close(path)
        self._fat.cache = cache

    def in_fat(self, real):
        """A path of the host in the file system; "" if it is on a card."""
        if not real.startswith(self.root + "/"):
            return ""
        self._file_system()
        path = real[len(self.root) + 1 :]
        at = path.find("/")
        while at >= 0:
            self._know(path[:at])
            at = path.find("/", at + 1)
        self._know(path)
        return path

    def _know(self, path):
        """What the host has put there since the start."""
        if not self._fat.knows(path) and exists(self.root + "/" + path):
            self._learn(path)

    def power_fails(self):
        """Empty the files that are open for writing or not synced, and restart the board."""
        for file in self._writing:
            file.cut()
        for path in self._unsynced:
            real_open(path, "wb").close()
        self._writing = []
        self._unsynced = []
        raise Reset(_POWER_ON)

    def blocks(self, path):
        """Blocks of a file, or of a folder with its contents."""
        if not is_folder(path):
            return -(-os.stat(path)[6] // BLOCK)
        names = os.listdir(path)
        own = 0 if path == self.root else 2 * _ENTRY + sum([_ENTRY * entries_of(name) for name in names])
        return -(-own // BLOCK) + sum([self.blocks(path + "/" + name) for name in names])

    def free_blocks(self):
        """Blocks that are free."""
        return max(0, self.size - self.blocks(self.root))

    def mount(self, point):
        """Mount the flash at ``point``."""
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
        """Make a new, empty file system."""
        self._file_system().format()
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
        path = self.in_fat(real)
        file = Written(self, real_open(real, mode), real, self._fat if path else None, path)
        if path and ("w" in mode or not self._fat.knows(path)):
            self._fat.open(path)
        self._writing.append(file)
        return file

    def closed(self, file):
        """A written file was closed."""
        if file in self._writing:
            if self.operation():
                self.power_fails()
            self._writing.remove(file)
            self._unsynced.append(file.path)

    def sync(self):
        """Make all closed files durable."""
        if self._fat:
            self._fat.cache.flush()
        self._unsynced = []

    def rename(self, old, new):
        """As in FAT: an existing file of the new name is removed first."""
        old, new = self.real(old), self.real(new)
        os.stat(old)
        if exists(new) and old != new:
            if is_folder(new):
                raise OSError(_EEXIST)
            if self.operation():
                self.power_fails()
            self.in_fat(new)
            os.remove(new)
            self._unsynced = [path for path in self._unsynced if path != new]
        if self.operation():
            self.power_fails()
        old_path, new_path = self.in_fat(old), self.in_fat(new)
        os.rename(old, new)
        if old_path and new_path and old != new:
            if self._fat.knows(new_path):
                self._fat.remove(new_path)
            self._fat.rename(old_path, new_path)
        self._unsynced = [new if path == old else path for path in self._unsynced]
        if self.renamed:
            self.renamed()

    def change(self, function, path):
        """Change a path with ``function``."""
        real = self.real(path)
        if function is not os.mkdir:
            os.stat(real)
        if self.operation():
            self.power_fails()
        path = self.in_fat(real)
        function(real)
        if path:
            (self._fat.mkdir if function is os.mkdir else self._fat.remove)(path)
        self._unsynced = [path for path in self._unsynced if exists(path)]


class Written:
    """A file open for writing."""

    def __init__(self, flash, file, path, fat, fat_path):
        self._flash = flash
        self._file = file
        self.path = path
        self._fat = fat  # None: on a card
        self._fat_path = fat_path

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
        if self._fat:
            self._fat.write(self._fat_path, len(data))
        return self._file.write(data)

    def cut(self):
        """The power failed: the directory entry still has length 0."""
        self._file.close()
        real_open(self.path, "wb").close()

    def close(self):
        """Finish the file."""
        self._flash.closed(self)
        self._file.close()
        if self._fat:
            self._fat.close(self._fat_path)
            self._fat = None

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()

    def __getattr__(self, name):
        return getattr(self._file, name)


class _Unwritten:
    """Takes what is in the flash already."""

    def write(self, block):
        """Nothing to do."""

    def flush(self):
        """Nothing to do."""


real_open = open


def _counted(root):
    """Erasures by sector until now."""
    try:
        with real_open(root + ERASURES) as file:
            return dict(json.load(file))
    except (OSError, ValueError, TypeError):
        return {}


def is_folder(path):
    """Whether a path of the host is a folder."""
    return bool(os.stat(path)[0] & _DIRECTORY)


def exists(path):
    """Whether a path of the host exists."""
    try:
        os.stat(path)
    except OSError:
        return False
    return True


def remove_all(path):
    """Remove a file, or a folder with its contents, of the host."""
    if is_folder(path):
        for name in os.listdir(path):
            remove_all(path + "/" + name)
        os.rmdir(path)
    else:
        os.remove(path)
