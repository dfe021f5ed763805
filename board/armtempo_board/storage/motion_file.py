"""A stored motion, read from its file in pieces, so it need not fit into memory."""

import struct
from binascii import crc32

from armtempo_shared.motion import HEAD_SIZE, MotionError, MotionHead
from micropython import const

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import BinaryIO

_PIECE = const(256)
_CRC_BYTES = const(4)


class MotionFile(MotionHead):
    """The motion in the file ``path`` of ``length`` bytes; ``crc``: its checksum.

    Raises MotionError if the record is incomplete, damaged or of an unknown kind, OSError if the flash fails.
    """

    def __init__(self, path: str, length: int) -> None:
        with open(path, "rb") as file:
            super().__init__(file.read(HEAD_SIZE), length)
        self.crc = stated_crc(path, length)
        self._path = path

    def stream(self, offset: int) -> "BinaryIO":
        """See ``MotionHead``."""
        file: BinaryIO = open(self._path, "rb")  # noqa: SIM115  who asked closes it
        file.seek(offset)
        return file


def stated_crc(path: str, length: int) -> int:
    """The crc32 at the end of a record of ``length`` bytes; raises MotionError if it is wrong."""
    piece = memoryview(bytearray(_PIECE))
    crc = 0
    left = length - _CRC_BYTES
    with open(path, "rb") as file:
        while left > 0:
            count = file.readinto(piece[: min(left, _PIECE)])
            if not count:
                raise MotionError("too short")
            crc = crc32(piece[:count], crc)
            left -= count
        if file.read(_CRC_BYTES) != struct.pack("<I", crc):
            raise MotionError("checksum")
    return crc
