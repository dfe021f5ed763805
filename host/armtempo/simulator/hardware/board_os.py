"""The board program's ``os``: MicroPython's functions, on the virtual flash."""

import os as _own

from simulator import flash as _flash
from simulator import the


def getcwd():
    """Current folder."""
    return the.flash.cwd


def chdir(path):
    """Change the current folder."""
    absolute = the.flash.absolute(path)
    if absolute != "/" and not _flash.is_folder(the.flash.real(path)):
        raise OSError(2)
    the.flash.cwd = absolute


def listdir(path=""):
    """Names in a folder."""
    if the.flash.absolute(path) == "/":
        return [point[1:] for point in the.flash.mounts]
    return sorted(_own.listdir(the.flash.real(path)))


def ilistdir(path=""):
    """(name, type, inode 0, size) of each entry."""
    if the.flash.absolute(path) == "/":
        for name in listdir("/"):
            yield (name, 0x4000, 0, 0)
        return
    real = the.flash.real(path)
    for name in listdir(path):
        status = _own.stat(real + "/" + name)
        yield (name, status[0] & 0xF000, 0, status[6])


def stat(path):
    """Type, size and times."""
    if the.flash.absolute(path) == "/":
        return (0x4000, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    status = _own.stat(the.flash.real(path))
    kind = status[0] & 0xF000
    return (kind, 0, 0, 0, 0, 0, 0 if kind == 0x4000 else status[6], 0, 0, 0)


def statvfs(path):
    """Block size, fragment size, blocks, free blocks, …"""
    if the.flash.absolute(path) != "/":
        the.flash.real(path)
    free = the.flash.free_blocks()
    return (_flash.BLOCK, _flash.BLOCK, the.flash.size, free, free, 0, 0, 0, 0, 255)


def rename(old, new):
    """Rename; an existing file is replaced."""
    the.flash.rename(old, new)


def remove(path):
    """Remove a file."""
    the.flash.change(_own.remove, path)


unlink = remove


def mkdir(path):
    """Make a folder."""
    the.flash.change(_own.mkdir, path)


def rmdir(path):
    """Remove an empty folder."""
    the.flash.change(_own.rmdir, path)


def sync():
    """Bring the flash up to date."""
    the.board.spend(100)


class VfsFat:
    """The kind of file system that the flash has."""

    @staticmethod
    def mkfs(device):
        """Make a fresh one, without files."""
        the.flash.format()


def mount(device, point):
    """Mount the flash."""
    the.flash.mount(point)


def umount(point):
    """Unmount a file system."""
    the.flash.umount(point)


def dupterm(stream, index=0):
    """Attach the REPL to the serial port, or with None detach it; returns what was attached."""
    before = the.port if the.serial.attached else None
    the.serial.attached = stream is not None
    return before


def urandom(count):
    """Random bytes; of the hardware generator on the chip."""
    return _own.urandom(count)


def uname():
    """What runs where."""
    return ("pyboard", "pyboard", "1.25.0", "virtual board", the.options["machine"])
