"""Makes the image of a flash with a FAT file system: IMAGE, its number of blocks of 512 bytes, folder to copy."""

import os
import sys

import vfs


class Blocks:
    """A block device in memory."""

    def __init__(self, count):
        self.data = bytearray(512 * count)

    def readblocks(self, number, buffer):
        """Read whole blocks."""
        buffer[:] = self.data[512 * number : 512 * number + len(buffer)]

    def writeblocks(self, number, buffer):
        """Write whole blocks."""
        self.data[512 * number : 512 * number + len(buffer)] = buffer

    def ioctl(self, request, argument):
        """How many blocks there are, and their size."""
        return {4: len(self.data) // 512, 5: 512}.get(request)


def copy(source, target):
    """Copy a folder's content."""
    for name in os.listdir(source):
        if os.stat(source + "/" + name)[0] & 0x4000:
            os.mkdir(target + "/" + name)
            copy(source + "/" + name, target + "/" + name)
        else:
            with open(source + "/" + name, "rb") as old, open(target + "/" + name, "wb") as new:
                new.write(old.read())


blocks = Blocks(int(sys.argv[2]))
vfs.VfsFat.mkfs(blocks)
vfs.mount(vfs.VfsFat(blocks), "/image")
copy(sys.argv[3], "/image")
vfs.umount("/image")
with open(sys.argv[1], "wb") as file:
    file.write(blocks.data)
