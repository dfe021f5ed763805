"""A stored program, read from its file when it starts."""

from armtempo_shared.program import ProgramRecord

from armtempo_board.storage.motion_file import stated_crc


class ProgramFile(ProgramRecord):
    """The program in the file ``path`` of ``length`` bytes; ``crc``: its checksum.

    Raises ProgramError or MotionError if the record is incomplete, damaged or of an unknown kind, OSError if the flash
    fails.
    """

    def __init__(self, path: str, length: int) -> None:
        self._path = path
        super().__init__(length)
        self.crc = stated_crc(path, length)

    def check(self) -> None:
        """Raise ValueError if its table is none."""
        self.table()

    def part(self, offset: int, size: int) -> bytes:
        """See ``ProgramRecord``."""
        with open(self._path, "rb") as file:
            file.seek(offset)
            found: bytes = file.read(size)
            return found
