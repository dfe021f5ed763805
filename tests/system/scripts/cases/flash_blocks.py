"""The virtual board's file system beside MicroPython's own: the same blocks in the same order, for random operations.

Argument: a seed. Only where MicroPython has its file system (``vfs``).
"""

# all cases: not emulated, not on CPython

import os
import random
import sys

import cases
import vfs
from chip.fat import BLOCK, Fat
from chip.flash_cache import SECTOR_BLOCKS, FlashCache

CLUSTERS = 190
NAMES = [
    "armtempo/" + name
    for name in ("feed.atm", "feed.atm.new", "arm.ata", "a-very-long-name.atm", "Feed2.atm", "default.txt")
]
FACTORY = (("boot.py", 454), ("main.py", 34), ("README.txt", 526), ("pybcdc.inf", 2597))
SIZES = (34, 100, 252, 300, BLOCK, BLOCK, BLOCK, 1000)
FLUSH = "flush"


class Logged:
    """What is written to a cache, and the erasures that this takes."""

    def __init__(self):
        self.log = []
        self.erased = {}
        self._cache = FlashCache(self._count)

    def _count(self, sector, ms):
        self.erased[sector] = self.erased.get(sector, 0) + 1

    def write(self, block):
        self.log.append(block)
        self._cache.write(block)

    def flush(self):
        self.log.append(FLUSH)
        self._cache.flush()


class Device:
    """The block device of MicroPython's file system."""

    def __init__(self, logged):
        self._logged = logged
        self._data = bytearray(BLOCK * sum(SECTOR_BLOCKS))

    def readblocks(self, number, buffer):
        buffer[:] = self._data[BLOCK * number : BLOCK * number + len(buffer)]

    def writeblocks(self, number, buffer):
        for more in range(len(buffer) // BLOCK):
            self._logged.write(number + more)
        self._data[BLOCK * number : BLOCK * number + len(buffer)] = buffer

    def ioctl(self, request, argument):
        if request == 3:
            self._logged.flush()
        return {3: 0, 4: len(self._data) // BLOCK, 5: BLOCK}.get(request)


class Both:
    """Does everything on both."""

    def __init__(self):
        self._real, self._modelled = Logged(), Logged()
        device = Device(self._real)
        vfs.VfsFat.mkfs(device)
        vfs.mount(vfs.VfsFat(device), "/both")
        self._fat = Fat(self._modelled, CLUSTERS)
        self._real.log.clear()
        self._real.erased.clear()
        self._names = set()

    def _compare(self, *what):
        assert self._real.log == self._modelled.log, (what, self._real.log, self._modelled.log)
        assert self._real.erased == self._modelled.erased
        self._real.log.clear()
        self._modelled.log.clear()

    def mkdir(self, path):
        os.mkdir("/both/" + path)
        self._fat.mkdir(path)
        self._compare("mkdir", path)

    def write(self, path, sizes):
        with open("/both/" + path, "wb") as file:
            self._fat.open(path)
            for size in sizes:
                file.write(bytes(size))
                self._fat.write(path, size)
        self._fat.close(path)
        self._names.add(path)
        self._compare("write", path, sizes)

    def remove(self, path):
        os.remove("/both/" + path)
        self._fat.remove(path)
        self._names.discard(path)
        self._compare("remove", path)

    def rename(self, old, new):
        os.rename("/both/" + old, "/both/" + new)
        if new in self._names:
            self._fat.remove(new)
        self._fat.rename(old, new)
        self._names.discard(old)
        self._names.add(new)
        self._compare("rename", old, new)

    def anything(self):
        name = random.choice(NAMES)
        if name not in self._names or random.getrandbits(1):
            self.write(name, [random.choice(SIZES) for _ in range(random.randint(1, 12))])
        elif random.getrandbits(1):
            self.remove(name)
        else:
            other = random.choice(NAMES)
            if other != name:
                self.rename(name, other)


def case_the_same_blocks_in_the_same_order():
    seed = int(sys.argv[1])
    print("seed", seed)
    random.seed(seed)
    both = Both()
    both.mkdir("armtempo")
    for name, size in FACTORY:
        both.write(name, [size])
    for _ in range(600):
        both.anything()


cases.run(globals())
