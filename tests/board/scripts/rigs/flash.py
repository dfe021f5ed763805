"""A flash in memory that loses power, fails or is full at the n-th change, to put under the store.

Like FAT behind a cache: a file that was open when the power went is empty afterwards, and so is one that was not
synced; what was made, renamed or removed since the last sync is done or undone. Renaming over an existing file first
removes that one. A cut leaves the change it hits undone.
"""

ENOENT, EIO, ENOSPC = 2, 5, 28
BLOCK = 512


class PowerCut(BaseException):
    """The power fails now."""


class Flash:
    """Takes the place of ``os`` and ``open`` in the store; ``error`` None cuts the power at ``fail_at``.

    ``undone``: whether a cut undoes what the folder went through since the last sync.
    """

    def __init__(self, undone=False):
        self.root = ""
        self.files = {}
        self.opened = []
        self.unsynced = []
        self.changes = 0
        self.fail_at = 0
        self.error = None
        self.free_blocks = 1 << 11
        self.undone = undone
        self._lasting = {}

    def change(self):
        """Count a change; fail if the test wants it."""
        self.changes += 1
        if self.changes == self.fail_at:
            if self.error is None:
                raise PowerCut
            raise OSError(self.error)

    def power_up(self):
        """After a cut: what was being written or was not synced is empty, or has never been there."""
        for name in self.opened + self.unsynced:
            self.files[name] = b""
        if self.undone:
            self.files = dict(self._lasting)
        self.opened, self.unsynced = [], []
        self._lasting = dict(self.files)
        self.fail_at = 0

    # os

    def mkdir(self, path):
        self.root = path

    def listdir(self, path):
        return [name[len(path) + 1 :] for name in self.files]

    def ilistdir(self, path):
        return [(name, 0x8000, 0) for name in self.listdir(path)]

    def stat(self, path):
        if path == self.root:
            return (0x4000,)
        if path not in self.files:
            raise OSError(ENOENT)
        return (0, 0, 0, 0, 0, 0, len(self.files[path]))

    def statvfs(self, path):
        return (BLOCK, BLOCK, self.free_blocks, self.free_blocks, self.free_blocks)

    def take(self, blocks):
        """Take blocks, or give back if below 0."""
        if blocks > self.free_blocks:
            raise OSError(ENOSPC)
        self.free_blocks -= blocks

    def remove(self, path):
        self.stat(path)
        self.change()
        self.take(-_blocks(self.files.pop(path)))
        self._forget(path)

    def rename(self, old, new):
        self.stat(old)
        if new in self.files:
            self.remove(new)
        self.change()
        self.files[new] = self.files.pop(old)
        if old in self.unsynced:
            self._forget(old)
            self.unsynced.append(new)

    def sync(self):
        self.change()
        self.unsynced = []
        self._lasting = dict(self.files)

    def _forget(self, path):
        self.unsynced = [name for name in self.unsynced if name != path]

    # open

    def open(self, path, mode):
        if "w" in mode:
            self.change()
            self.take(-_blocks(self.files.get(path, b"")))
            self.files[path] = b""
            self._forget(path)
            self.opened.append(path)
        elif path not in self.files:
            raise OSError(ENOENT)
        return File(self, path, "w" in mode)


def _blocks(data):
    return -(-len(data) // BLOCK)


class File:
    def __init__(self, flash, path, writing):
        self.flash = flash
        self.path = path
        self.writing = writing
        self.at = 0

    def write(self, data):
        self.flash.change()
        before = self.flash.files[self.path]
        self.flash.take(_blocks(before + bytes(data)) - _blocks(before))
        self.flash.files[self.path] += bytes(data)
        return len(data)

    def read(self, count=-1):
        data = self.flash.files[self.path][self.at :]
        data = data if count < 0 else data[:count]
        self.at += len(data)
        return data

    def readinto(self, buffer):
        data = self.read(len(buffer))
        buffer[: len(data)] = data
        return len(data)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()

    def seek(self, at):
        self.at = at

    def close(self):
        if self.writing and self.path in self.flash.opened:
            self.flash.change()
            self.flash.opened.remove(self.path)
            self.flash.unsynced.append(self.path)
            self.writing = False
