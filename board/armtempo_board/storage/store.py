"""Records in flash: motions, the arm record, the default by name and checksum; written atomically.

A record is written to ``NAME.new``, read back, synced and renamed. If a power cut leaves a ``.new`` file,
``recover`` uses it if the old file is gone and the new one is complete, and removes it otherwise.

A record has the name of its motion, sequence or program, or ``ARM_RECORD_NAME``; its first bytes give its kind. No file
is read or written during a motion.
"""

import os
from binascii import crc32, hexlify

from armtempo_shared import armrecord, codes
from armtempo_shared.limits import MAX_MOTION_BYTES, MAX_NAME
from armtempo_shared.messages import ARM_RECORD_NAME, MOTION, PROGRAM, SEQUENCE
from micropython import const

from armtempo_board import features
from armtempo_board.errors import Refused
from armtempo_board.storage import motion_file

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

_MOTION = ".atm"
_ARM = "arm.ata"
_DEFAULT = "default.txt"
_NEW = ".new"
_ENOSPC = const(28)
_ERRNO = const(0)  # of an exception's arguments
_NAME, _KIND = const(0), const(1)  # of an entry of os.ilistdir
_FOLDER = const(0x4000)  # the kind of a folder, which somebody else made
_ST_SIZE = const(6)  # of os.stat
_F_BSIZE = const(0)  # of os.statvfs
_F_BAVAIL = const(3)
_CRC_BYTES = const(4)
_KIND_BYTES = const(3)  # of a record's magic, of every version
_BLOCK = const(512)
_0, _9, _A, _Z = const(0x30), const(0x39), const(0x61), const(0x7A)  # letters, small
_SMALL = const(0x20)
_MOST_FREE = const(0x3FFFFFFF)


def _file_name(name: str) -> str:
    """The file of a record."""
    return _ARM if name == ARM_RECORD_NAME else _motion_file(name)


def _motion_file(name: str) -> str:
    """The file of a motion; raises Refused for an invalid name."""
    if not 0 < len(name) <= MAX_NAME:
        raise Refused(codes.BAD_NAME)
    for byte in name.encode():  # letters as strings would each be a name that MicroPython keeps
        if not (_A <= byte | _SMALL <= _Z or _0 <= byte <= _9 or byte in b"-_"):
            raise Refused(codes.BAD_NAME)
    return name + _MOTION


def _sync() -> None:
    sync = getattr(os, "sync", None)
    if sync:
        sync()


def _check_crc(data: bytes, crc: int) -> None:
    if int.from_bytes(data[-_CRC_BYTES:], "little") != crc or crc32(memoryview(data)[:-_CRC_BYTES]) != crc:
        raise Refused(codes.BAD_CHECKSUM)


class Store:
    """The folder ``root``; every method raises Refused with FLASH_ERROR or FLASH_FULL if the flash fails."""

    def __init__(self, root: str, recover: bool = True) -> None:
        """``recover``: recover from a power cut; only if no other object has an upload in progress."""
        self._root = root
        self._file: "Any" = None  # the upload in progress,
        self._target = ""  # its file name,
        self._size = 0  # bytes announced
        self._received = 0  # and received so far
        self._block = bytearray(0)  # with the bytes after the last whole block of the flash,
        self._filled = 0  # as many as these
        if recover:
            self.recover()

    def recover(self) -> None:
        """Make the folder if it is missing; finish or undo an upload that a power cut interrupted."""
        for function in (os.stat, os.mkdir):  # a folder that is there costs no write
            try:
                function(self._root)
                break
            except OSError:
                pass
        for name in self._files():
            if name.endswith(_NEW):
                self._recover(name[: -len(_NEW)])

    def free(self) -> int:
        """Bytes free in the flash, at most the largest small integer."""
        try:
            stat = os.statvfs(self._root)
        except OSError:
            return 0
        return min(stat[_F_BSIZE] * stat[_F_BAVAIL], _MOST_FREE)

    def names(self) -> "list[str]":
        """Names of the stored motions and sequences, sorted."""
        found = []
        try:
            entries: "Any" = os.ilistdir(
                self._root
            )  # with their kinds: to ask for each would search the folder
            for entry in entries:
                name = entry[_NAME]
                if name.endswith(_MOTION) and entry[_KIND] != _FOLDER:
                    found.append(name[: -len(_MOTION)])
        except OSError:
            pass
        return sorted(found)

    def begin(self, name: str, size: int) -> None:
        """Begin an upload; aborts one in progress."""
        file_name = _file_name(name)
        self.abandon()
        if size > MAX_MOTION_BYTES:
            raise Refused(codes.TOO_LONG, value=MAX_MOTION_BYTES)
        if size + _BLOCK > self.free():
            raise Refused(codes.FLASH_FULL, value=self.free())
        self._other_case(file_name)
        self._file = self._guard(open, self._path(file_name + _NEW), "wb")
        self._target = file_name
        self._size = size
        self._received = 0
        self._block = bytearray(_BLOCK)
        self._filled = 0

    def write(self, offset: int, data: bytes) -> int:
        """Add a piece; a repeated one is ignored. Returns the offset of the next.

        Whole blocks are written: for each part of a block FAT would write its table too, and erase two sectors.
        """
        if not self._file or not offset <= self._received or offset + len(data) > self._size:
            raise Refused(codes.BAD_OFFSET, value=self._received)
        fresh = data[self._received - offset :]
        if fresh:
            try:
                self._fill(fresh)
            except Refused:
                self.abandon()
                raise
            self._received += len(fresh)
        return self._received

    def _fill(self, data: bytes) -> None:
        block = self._block
        for at in range(0, len(data), _BLOCK):
            part = data[at : at + _BLOCK]
            taken = min(len(part), _BLOCK - self._filled)
            block[self._filled : self._filled + taken] = part[:taken]
            self._filled += taken
            if self._filled == _BLOCK:
                self._put(self._file, block)
                self._filled = len(part) - taken
                block[: self._filled] = part[taken:]

    def commit(self, crc: int) -> str:
        """Check the upload in the flash and rename it; returns the record's name.

        An arm record is not renamed before it is checked: see ``take_arm``.
        """
        if not self._file or self._received != self._size:
            raise Refused(codes.BAD_OFFSET, value=self._received)
        name = self._target
        try:
            self._close()
            if name == _ARM:
                _check_crc(self._read(name + _NEW), crc)
            else:
                self._check_motion(name + _NEW, crc)
        except Refused:
            self._discard(name + _NEW)
            raise
        if name == _ARM:
            return ARM_RECORD_NAME
        self._replace(name)
        return name[: -len(_MOTION)]

    def new_arm(self) -> bytes:
        """The uploaded arm record, before its check."""
        return self._read(_ARM + _NEW)

    def take_arm(self, is_fit: bool) -> None:
        """Rename the uploaded arm record, or drop it."""
        if is_fit:
            self._replace(_ARM)
        else:
            self._discard(_ARM + _NEW)

    def abandon(self) -> None:
        """Abort the upload in progress, if any."""
        if self._file:
            try:
                self._file.close()
            except OSError:
                pass
            self._file = None
            self._discard(self._target + _NEW)

    def read(self, name: str) -> bytes:
        """All bytes of a small record; refuses with NOT_FOUND, or TOO_LONG if it does not fit into memory."""
        return self._read(_file_name(name))

    def motion(
        self, name: str, kind: "Any" = motion_file.MotionFile, *arguments: object
    ) -> motion_file.MotionFile:
        """A stored motion, with head and checksum checked; ``kind``: of the object, with its further arguments."""
        return self._motion(_motion_file(name), kind, *arguments)

    if features.SEQUENCES:

        def kind(self, name: str) -> int:
            """The kind of the record of this name; refuses with NOT_FOUND."""
            if not name:
                raise Refused(codes.NOT_FOUND)
            return self._kind(_motion_file(name))

        def opened(self, name: str, kind: int) -> "Any":
            """A stored sequence or program, with head and checksum checked."""
            return self._opened(_motion_file(name), kind)

        def _opened(self, file_name: str, kind: int) -> "Any":
            path, size = self._path(file_name), self._size_of(file_name)
            try:
                # here, as only these need the memory
                if kind == SEQUENCE:
                    from armtempo_board.storage import sequence_file

                    return self._guard(sequence_file.SequenceFile, path, size)
                from armtempo_board.storage import program_file

                return self._guard(program_file.ProgramFile, path, size)
            except ValueError:  # of the record, or MotionError for its checksum
                raise Refused(codes.BAD_RECORD)

    def size_of(self, name: str) -> int:
        """Bytes of a record; NOT_FOUND."""
        return self._size_of(_file_name(name))

    def part(self, name: str, offset: int, length: int) -> "tuple[int, bytes]":
        """(size of the record, bytes from offset on)."""
        file_name = _file_name(name)
        size = self._size_of(file_name)
        file = self._guard(open, self._path(file_name), "rb")
        try:
            self._guard(file.seek, min(offset, size))
            return size, self._guard(file.read, length)
        finally:
            file.close()

    def remove(self, name: str) -> None:
        """Remove a motion."""
        file_name = _motion_file(name)
        self._size_of(file_name)
        self._guard(os.remove, self._path(file_name))
        self._guard(_sync)

    def rename(self, old: str, new: str) -> None:
        """Give a motion another name; a default stays the default."""
        old_file, new_file = _motion_file(old), _motion_file(new)
        self._size_of(old_file)
        if new.lower() in [name.lower() for name in self.names() if name != old] or new == old:
            raise Refused(codes.EXISTS)
        was_default = self.default() == old
        if was_default:
            crc = self._crc(old)
            self._write_default(new + crc + "\n" + old + crc)
        self._guard(os.rename, self._path(old_file), self._path(new_file))
        self._guard(_sync)
        if was_default:
            self._write_default(new + crc)

    def default(self) -> str:
        """Name of the default motion; "" if there is none, or its record has changed."""
        try:
            lines = self._read(_DEFAULT).decode().split("\n")
        except (Refused, UnicodeError):
            return ""
        names = self.names()
        for line in lines:
            name, _, _ = line.partition(" ")
            if name in names and line == name + self._crc(name):
                return name
        return ""

    def set_default(self, name: str) -> None:
        """Make a stored motion the default; "" for none."""
        if name:
            name += self._crc(name)
        self._write_default(name)

    def _crc(self, name: str) -> str:
        """A motion's checksum, from its last bytes, after a blank."""
        size = self._size_of(_motion_file(name))
        _, crc = self.part(name, max(0, size - 4), 4)
        return " " + hexlify(crc).decode()

    def _write_default(self, text: str) -> None:
        try:
            if self._read(_DEFAULT).decode() == text + "\n":
                return
        except (Refused, UnicodeError):
            pass
        file = self._guard(open, self._path(_DEFAULT + _NEW), "wb")
        try:
            self._put(file, text.encode() + b"\n")
        except Refused:
            file.close()
            self._discard(_DEFAULT + _NEW)
            raise
        self._guard(file.close)
        self._guard(_sync)  # before the rename, which removes the old file
        self._replace(_DEFAULT)

    def _other_case(self, file_name: str) -> None:
        """Refuse a name that differs from another only in case, as FAT ignores case."""
        for name in self._files():
            if name != file_name and name.lower() == file_name.lower():
                raise Refused(codes.EXISTS)

    def _files(self) -> "list[str]":
        try:
            return os.listdir(self._root)
        except OSError:
            return []

    def _size_of(self, file_name: str) -> int:
        """Bytes of a file; NOT_FOUND."""
        try:
            return os.stat(self._path(file_name))[_ST_SIZE]
        except OSError:
            raise Refused(codes.NOT_FOUND)

    def _path(self, file_name: str) -> str:
        return self._root + "/" + file_name

    def _read(self, file_name: str) -> bytes:
        size = self._size_of(file_name)
        if size > MAX_MOTION_BYTES:
            raise Refused(codes.TOO_LONG, value=size)
        file = self._guard(open, self._path(file_name), "rb")
        try:
            return bytes(self._guard(file.read))
        except MemoryError:
            raise Refused(codes.TOO_LONG, value=size)
        finally:
            file.close()

    def _put(self, file: "Any", data: "bytes | bytearray | memoryview") -> None:
        if self._guard(file.write, data) != len(data):
            raise Refused(codes.FLASH_FULL)

    def _close(self) -> None:
        file = self._file
        self._file = None
        self._received = 0
        try:
            if self._filled:
                self._put(file, memoryview(self._block)[: self._filled])
        finally:
            self._guard(file.close)
        self._guard(_sync)

    def _check_motion(self, file_name: str, crc: int) -> None:
        try:
            found = self._guard(motion_file.stated_crc, self._path(file_name), self._size_of(file_name))
        except ValueError:  # MotionError
            raise Refused(codes.BAD_CHECKSUM)
        if found != crc:
            raise Refused(codes.BAD_CHECKSUM)
        self._check_kind(file_name)

    def _check_kind(self, file_name: str) -> None:
        """Refuse a record of no kind."""
        kind = self._kind(file_name) if features.SEQUENCES else MOTION
        if kind == MOTION:
            self._motion(file_name)
            return
        try:
            self._opened(file_name, kind).check()
        except ValueError:  # SequenceError, or of a program's table
            raise Refused(codes.BAD_RECORD)

    def _kind(self, file_name: str) -> int:
        self._size_of(file_name)
        file = self._guard(open, self._path(file_name), "rb")
        try:
            magic = self._guard(file.read, _KIND_BYTES)
        finally:
            file.close()
        # as in armtempo_shared.sequence and .program, which are loaded when needed
        return SEQUENCE if magic == b"ATS" else PROGRAM if magic == b"ATP" else MOTION

    def _motion(
        self, file_name: str, kind: "Any" = motion_file.MotionFile, *arguments: object
    ) -> motion_file.MotionFile:
        size = self._size_of(file_name)
        try:
            return self._guard(kind, self._path(file_name), size, *arguments)  # type: ignore[no-any-return]
        except ValueError:  # MotionError
            if self._kind(file_name) == MOTION:
                raise Refused(codes.BAD_RECORD)
            raise Refused(codes.IS_SEQUENCE if features.SEQUENCES else codes.NEEDS_FIRMWARE)

    def _is_whole(self, file_name: str) -> bool:
        """Whether a ``.new`` file is a complete record, of the kind given by its name."""
        try:
            if file_name.endswith(_MOTION):
                self._check_kind(file_name + _NEW)
                return True
            data = self._read(file_name + _NEW)
        except Refused:
            return False
        if file_name == _ARM:
            try:
                armrecord.unpack(data)
            except armrecord.ArmRecordError:
                return False
            return True
        return data.endswith(b"\n")

    def _replace(self, name: str) -> None:
        try:
            self._guard(os.rename, self._path(name + _NEW), self._path(name))
        except Refused:
            self._recover(name)  # FAT may have removed the old one already
            raise
        self._guard(_sync)

    def _discard(self, file_name: str) -> None:
        try:
            os.remove(self._path(file_name))
        except OSError:
            pass

    def _recover(self, name: str) -> None:
        if name in self._files() or not self._is_whole(name):
            return self._discard(name + _NEW)
        try:
            os.rename(self._path(name + _NEW), self._path(name))
            return _sync()
        except OSError:
            return None  # the next start tries again

    def _guard(self, function: "Callable[..., Any]", *arguments: object) -> "Any":
        try:
            return function(*arguments)
        except OSError as error:
            raise Refused(codes.FLASH_FULL if error.args[_ERRNO] == _ENOSPC else codes.FLASH_ERROR)
