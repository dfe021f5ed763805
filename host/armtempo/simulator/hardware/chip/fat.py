"""Which blocks the file system (FatFs as in MicroPython, FAT12) writes in each operation; it holds no data.

FatFs keeps one block in memory, its window: a block that changes there is written when another one is needed, whole
blocks of a file are written past it, and an operation ends with a flush of all. The order decides how often the cache
below changes its sector. A test runs the same operations on MicroPython's own file system.
"""

BLOCK = 512
_TABLE = 1  # the block of the table
_ROOT = 2  # the first one of the root folder,
_ROOT_BLOCKS = 32
_DATA = _ROOT + _ROOT_BLOCKS  # and of the data; a cluster is one block
_SLOTS = 16  # entries in a block of a folder
_DOTS = 2  # entries of a new folder
_NONE = -1


class _Folder:
    def __init__(self, clusters):
        self.clusters = clusters  # None: the root folder
        self.slots = []  # True: taken

    def block(self, slot):
        if self.clusters is None:
            return _ROOT + slot // _SLOTS
        return _DATA + self.clusters[slot // _SLOTS]


class _Entry:
    def __init__(self, folder, first, count):
        self.folder = folder
        self.slots = range(first, first + count)  # of its long name and, the last one, of itself
        self.clusters = []
        self.size = 0
        self.at = 0  # where the open file is written next,
        self.block = _NONE  # and its block in the window, if it was written there

    def own_block(self):
        return self.folder.block(self.slots[-1])


class Fat:
    """``cache``: takes the blocks that are written, with ``write`` and ``flush``; ``clusters``: of the flash."""

    def __init__(self, cache, clusters):
        self.cache = cache
        self._window = _NONE
        self._changed = False
        self._used = bytearray(clusters)
        self._last = -1  # the cluster that was allocated last
        self._folders = {"": _Folder(None)}
        self._entries = {}

    def open(self, path):
        """Make a file, or empty the one that is there."""
        entry = self._find(path)
        if entry is None:
            self._entries[path] = self._register(path)
            return
        self._change(entry.own_block())
        if entry.clusters:
            self._last = entry.clusters[0] - 1
            self._free(entry)
            self._look(entry.own_block())
        entry.size = entry.at = 0
        entry.block = _NONE

    def write(self, path, count):
        """Write bytes at the end of an open file."""
        entry = self._entries[path]
        while count > 0:
            place = entry.at % BLOCK
            part = min(count, BLOCK - place)
            if place == 0:
                if entry.at == BLOCK * len(entry.clusters):
                    self._extend(entry.clusters)
                if self._window == entry.block:
                    self._write_window()
                block = _DATA + entry.clusters[entry.at // BLOCK]
                if part == BLOCK:
                    self.cache.write(block)
                    if self._window == block:
                        self._changed = False
                else:
                    self._write_window()
                    self._window = entry.block = block
            if part < BLOCK:
                self._change(entry.block)
            entry.at += part
            entry.size = max(entry.size, entry.at)
            count -= part

    def close(self, path):
        """Close a file that was written."""
        self._change(self._entries[path].own_block())
        self._flush()

    def rename(self, old, new):
        """Rename; a file of the new name is there no longer."""
        entry = self._find(old)
        self._find(new)
        fresh = self._register(new)
        self._unregister(entry)
        self._flush()
        fresh.clusters, fresh.size = entry.clusters, entry.size
        self._entries[new] = fresh
        del self._entries[old]
        for path in [path for path in self._folders if path == old or path.startswith(old + "/")]:
            self._folders[new + path[len(old) :]] = self._folders.pop(path)
        for path in [path for path in self._entries if path.startswith(old + "/")]:
            self._entries[new + path[len(old) :]] = self._entries.pop(path)

    def remove(self, path):
        """Remove a file or an empty folder."""
        entry = self._find(path)
        self._unregister(entry)
        if entry.clusters:
            self._free(entry)
        self._flush()
        del self._entries[path]
        self._folders.pop(path, None)

    def mkdir(self, path):
        """Make a folder."""
        self._find(path)
        clusters = []
        self._extend(clusters)
        self._write_window()
        self.cache.write(_DATA + clusters[0])
        self._window = _DATA + clusters[0]
        self._changed = True
        entry = self._register(path)
        entry.clusters = clusters
        self._flush()
        self._entries[path] = entry
        self._folders[path] = _Folder(clusters)
        self._folders[path].slots = [True] * _DOTS

    def format(self):
        """A new, empty file system: all but the data are written."""
        self.__init__(self.cache, len(self._used))
        for block in range(_DATA):
            self.cache.write(block)
        self.cache.flush()

    def knows(self, path):
        """Whether there is such a file or folder."""
        return path in self._entries

    def _look(self, block):
        """Bring a block into the window."""
        if self._window != block:
            self._write_window()
            self._window = block

    def _change(self, block):
        self._look(block)
        self._changed = True

    def _write_window(self):
        if self._changed:
            self._changed = False
            self.cache.write(self._window)

    def _flush(self):
        self._write_window()
        self.cache.flush()

    def _find(self, path):
        """The entry of a path, or None; reads the folders on the way."""
        at = 0
        while True:
            end = path.find("/", at)
            name = path if end < 0 else path[:end]
            folder = self._folders[_parent(name)]
            entry = self._entries.get(name)
            last = entry.slots[-1] if entry else len(folder.slots)
            for slot in range(0, last + 1, _SLOTS):
                if folder.clusters is None or slot // _SLOTS < len(folder.clusters):
                    self._look(folder.block(slot))
            if entry:
                self._look(entry.own_block())
            if end < 0:
                return entry
            at = end + 1

    def _register(self, path):
        folder = self._folders[_parent(path)]
        wanted = entries_of(path[path.rfind("/") + 1 :])
        first = 0
        while any(folder.slots[first : first + wanted]):
            first += 1
        entry = _Entry(folder, first, wanted)
        while len(folder.slots) < entry.slots[-1] + 1:
            folder.slots.append(False)
        if folder.clusters is not None and entry.slots[-1] // _SLOTS >= len(folder.clusters):
            self._extend(folder.clusters)
            self._write_window()
            self.cache.write(_DATA + folder.clusters[-1])
        for slot in entry.slots:
            folder.slots[slot] = True
            self._change(folder.block(slot))
        return entry

    def _unregister(self, entry):
        for slot in entry.slots:
            entry.folder.slots[slot] = False
            self._change(entry.folder.block(slot))

    def _extend(self, clusters):
        """Allocate one more cluster."""
        self._look(_TABLE)
        found = (clusters[-1] + 1) % len(self._used) if clusters else self._last
        if not clusters or self._used[found]:
            found = self._last
            for _ in range(len(self._used)):
                found = (found + 1) % len(self._used)
                if not self._used[found]:
                    break
        self._used[found] = 1
        self._change(_TABLE)
        self._last = found
        clusters.append(found)

    def _free(self, entry):
        self._change(_TABLE)
        for cluster in entry.clusters:
            self._used[cluster] = 0
        entry.clusters = []


def _parent(path):
    return path[: max(path.rfind("/"), 0)]


def entries_of(name):
    """Entries of a name in a folder: one, and one for each 13 characters of a long one."""
    base, _, extension = name.partition(".")
    fits = len(base) <= 8 and len(extension) <= 3 and "." not in extension
    one_case = all([part in (part.lower(), part.upper()) for part in (base, extension)])
    return 1 if fits and one_case else 1 + -(-len(name) // 13)
