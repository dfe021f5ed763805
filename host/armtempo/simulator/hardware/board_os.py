"""The board program's ``os``: MicroPython's functions, on the virtual flash."""

import os as _own

import machine_state
from chip import flash as _flash


def getcwd():
    return machine_state.flash.cwd


def chdir(path):
    absolute = machine_state.flash.absolute(path)
    if absolute != "/" and not _flash.is_folder(machine_state.flash.real(path)):
        raise OSError(2)
    machine_state.flash.cwd = absolute


def listdir(path=""):
    if machine_state.flash.absolute(path) == "/":
        return [point[1:] for point in machine_state.flash.mounts]
    return sorted(_own.listdir(machine_state.flash.real(path)))


def ilistdir(path=""):
    """(name, type, inode 0, size) of each entry."""
    if machine_state.flash.absolute(path) == "/":
        for name in listdir("/"):
            yield (name, 0x4000, 0, 0)
        return
    real = machine_state.flash.real(path)
    for name in listdir(path):
        status = _own.stat(real + "/" + name)
        yield (name, status[0] & 0xF000, 0, status[6])


def stat(path):
    """Type, size and times."""
    if machine_state.flash.absolute(path) == "/":
        return (0x4000, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    status = _own.stat(machine_state.flash.real(path))
    kind = status[0] & 0xF000
    return (kind, 0, 0, 0, 0, 0, 0 if kind == 0x4000 else status[6], 0, 0, 0)


def statvfs(path):
    """Block size, fragment size, blocks, free blocks, …"""
    if machine_state.flash.absolute(path) != "/":
        machine_state.flash.real(path)
    free = machine_state.flash.free_blocks()
    return (_flash.BLOCK, _flash.BLOCK, machine_state.flash.size, free, free, 0, 0, 0, 0, 255)


def rename(old, new):
    """Rename; an existing file is replaced."""
    machine_state.flash.rename(old, new)


def remove(path):
    machine_state.flash.change(_own.remove, path)


unlink = remove


def mkdir(path):
    machine_state.flash.change(_own.mkdir, path)


def rmdir(path):
    machine_state.flash.change(_own.rmdir, path)


def sync():
    """Bring the flash up to date."""
    machine_state.flash.sync()
    machine_state.board.spend(100)


class VfsFat:
    """The flash's file system."""

    @staticmethod
    def mkfs(device):
        """Make a new one, without files."""
        machine_state.flash.format()


def mount(device, point):
    """Mount the flash."""
    machine_state.flash.mount(point)


def umount(point):
    machine_state.flash.umount(point)


def dupterm(stream, index=0):
    """Attach the REPL to the serial port (None: detach it); returns the previous stream."""
    before = machine_state.port if machine_state.serial.attached else None
    machine_state.serial.attached = stream is not None
    return before


def urandom(count):
    """Random bytes; on the chip from its hardware generator."""
    return _own.urandom(count)


def uname():
    """System, release, version and machine."""
    return ("pyboard", "pyboard", "1.25.0", "virtual board", machine_state.options["machine"])
