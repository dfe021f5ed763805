"""A stored sequence, read from its file row by row, so it takes no memory during motions."""

from armtempo_shared import codes
from armtempo_shared.sequence import OtherVersionError, SequenceRecord
from armtempo_shared.sequence_check import check

from armtempo_board.errors import Refused
from armtempo_board.storage.motion_file import stated_crc


class SequenceFile(SequenceRecord):
    """The sequence in the file ``path`` of ``length`` bytes; ``crc``: its checksum.

    Raises SequenceError or MotionError if the record is incomplete, damaged or of an unknown kind, Refused if
    it is of another version, OSError if the flash fails.
    """

    def __init__(self, path: str, length: int) -> None:
        self._path = path
        try:
            super().__init__(length)
        except OtherVersionError:
            raise Refused(codes.OTHER_VERSION)
        self.crc = stated_crc(path, length)

    def check(self) -> None:
        """Raise SequenceError, with the row, if it is invalid."""
        check(self)

    def part(self, offset: int, size: int) -> bytes:
        """See ``SequenceRecord``."""
        with open(self._path, "rb") as file:
            file.seek(offset)
            found: bytes = file.read(size)
            return found
