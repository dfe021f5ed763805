"""Becomes ``/flash/lib/armtempo_sectors.mpy``: runs the program from the chip's last two sectors of flash.

For stock MicroPython, whose heap the program would fill. ``boot.py`` imports it; from then on ``import`` finds
the compiled modules there. ``load`` imports them all and has their code, byte code or machine code, run where it is in
the flash, so that the copies in the heap are freed.

The sectors (written by ``deploy/sectors.py`` on the host): three words, _MAGIC, bytes in all, and the crc32 of what
follows; the length of an index in two bytes; the index, a line "PACKAGE/MODULE OFFSET" for each module, the package
without "armtempo_", those first that others import; after a line "later" those that the program does not need. At the
offset: the number of the module's functions; for each the offset of its code, and its length << 8 | number of functions
in it; then the compiled file.
"""

import gc
import io
import sys
from binascii import crc32

import micropython
import vfs
from machine import mem32
from micropython import const
from uctypes import bytearray_at

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_AT = const(0x080C0000)  # sectors 10 and 11 of 1 MB (RM0090 3.3)
_MAGIC = const(0x544D5241)
_WORD = const(4)
_SIZE_AT, _CRC_AT = const(4), const(8)
_HEAD_BYTES = const(12)
_ENTRY_BYTES = const(8)
_SIZE_BIT = const(8)
_MOST_FUNCTIONS = const(0xFF)
_LENGTH_BYTES = const(2)
_INDEX_AT = const(14)  # behind the head and its length
_PIECE = const(128)  # bytes
_LONGEST_LINE = const(64)
_DIGITS = const(6)  # of an offset
_WORDS = const(2)  # in a line about a module
_PLACE = const(1)  # of them
_MOST = const(0x40000)
_RAM = const(0x10000000)  # no address of RAM is below
_UNALIGNED = const(15)  # bits that no address of memory from the heap has
_POINT = "/armtempo"
_PACKAGE = "armtempo_"
_BEFORE = const(10)  # letters of "/armtempo_"
_ENDING = ".mpy"
_OF_PACKAGE = ".__init__"
_FOLDER = const(0x4000)
_REGULAR = const(0x8000)
_ENOENT = const(2)
# words of MicroPython's objects (py/objfun.h, py/emitglue.h, py/objproperty.c)
_FUNCTIONS, _CODE = const(8), const(12)  # of a function
_RAW_CODE, _RAW_FUNCTIONS = const(4), const(8)  # of one in a function, which is made when that is called
_METHOD_END, _PROPERTY_END = const(8), const(16)  # after the functions of a static method, a property


class _File(io.IOBase):
    """A compiled file, which is read once, from its start."""

    def __init__(self, at: int) -> None:
        self._at = at

    def readinto(self, buffer: bytearray) -> int:
        """Bytes of the flash."""
        buffer[:] = bytearray_at(self._at, len(buffer))
        self._at += len(buffer)
        return len(buffer)

    def ioctl(self, what: int, argument: int) -> int:
        """Closing it needs nothing."""
        return 0


class _Sectors:
    """As MicroPython wants a file system, as far as imports need it."""

    def mount(self, readonly: bool, mkfs: bool) -> None:
        """Nothing to do."""

    def umount(self) -> None:
        """The same."""

    def stat(self, path: str) -> "tuple[int, ...]":
        """Whether a module or a folder is there; OSError."""
        return (_REGULAR if _find(path) else _FOLDER,) + (0,) * 9

    def open(self, path: str, mode: str) -> "Any":
        """A module's bytes."""
        at = _find(path)
        return _File(at + _WORD + _ENTRY_BYTES * mem32[at])


def is_whole() -> bool:
    """Whether a program is in the sectors, completely."""
    size = mem32[_AT + _SIZE_AT]
    if mem32[_AT] != _MAGIC or not _HEAD_BYTES < size <= _MOST:
        return False
    wrong = crc32(bytearray_at(_AT + _HEAD_BYTES, size - _HEAD_BYTES)) ^ mem32[_AT + _CRC_AT]
    return not wrong & 0xFFFFFFFF


def _find(path: str) -> int:
    """The address of what is said about a module, 0: a folder; OSError.

    In small pieces: a copy of the whole index is 2 KB of garbage, which a word left on the stack by earlier calls may
    keep in the heap as if it were in use, for as long as the program runs.
    """
    is_module = path.endswith(_ENDING)
    text = "\n" + (path[_BEFORE : -len(_ENDING)] + " " if is_module else path[_BEFORE:] + "/")
    name = text.encode()
    at = _AT + _INDEX_AT
    end = at + int.from_bytes(bytearray_at(at - _LENGTH_BYTES, _LENGTH_BYTES), "little")
    while at < end:
        found = bytes(bytearray_at(at, min(_PIECE + len(name), end - at))).find(name)
        if found >= 0:
            return _AT + int(bytes(bytearray_at(at + found + len(name), _DIGITS))) if is_module else 0
        at += _PIECE
    raise OSError(_ENOENT)


def load() -> None:
    """Import the program's modules and free the heap of their code; then this module is not needed any more.

    For modules that come later it is imported again.
    """
    # What functions of each kind begin with; on a virtual board of 64 bits they cannot be inspected
    kinds = [mem32[id(kind)] for kind in (_swap, _machine_code, _generator)] if not id(_swap) >> 32 else []
    at = _AT + _INDEX_AT + 1
    while True:
        line = bytes(bytearray_at(at, _LONGEST_LINE))
        line = line[: line.find(b"\n")]
        at += len(line) + 1
        words = line.decode().split()
        if len(words) < _WORDS:  # "later", or the end
            break
        name = _PACKAGE + words[0].replace("/", ".")
        name = name[: -len(_OF_PACKAGE)] if name.endswith(_OF_PACKAGE) else name
        __import__(name)
        if kinds:
            _settle(sys.modules[name].__dict__, kinds, _AT + int(words[_PLACE]))
        gc.collect()
    vfs.umount(_POINT)
    sys.path.remove(_POINT)
    del sys.modules[__name__]


def _settle(names: "dict[str, Any]", kinds: "list[int]", about: int) -> None:
    """Have the functions of a module, or of a class in it, run in the flash."""
    for item in names.values():
        kind = type(item).__name__
        at = id(item)
        if at < _RAM:  # MicroPython's own
            continue
        if kind == "type":
            _settle(item.__dict__, kinds, about)
        elif kind in ("function", "generator"):
            if mem32[at] in kinds:
                _swap(at + _CODE, at + _FUNCTIONS, about)
        elif kind in ("property", "staticmethod", "classmethod"):
            for word in range(at + _WORD, at + (_PROPERTY_END if kind == "property" else _METHOD_END), _WORD):
                function = mem32[word]
                if function and mem32[function] in kinds:
                    _swap(function + _CODE, function + _FUNCTIONS, about)


def _swap(code_at: int, functions_at: int, about: int) -> None:
    """Give an object the code in the flash that is the same, byte for byte, as its own; and those in it."""
    code = mem32[code_at]
    # In the flash already, MicroPython's own, or no address: the objects of a later MicroPython may differ
    if code < _RAM or code & _UNALIGNED:
        return
    first = about + _WORD
    for entry in range(first, first + _ENTRY_BYTES * mem32[about], _ENTRY_BYTES):
        place = _AT + mem32[entry]
        size = mem32[entry + _WORD] >> _SIZE_BIT
        if mem32[place] == mem32[code] and bytearray_at(place, size) == bytearray_at(code, size):
            mem32[code_at] = place
            functions = mem32[functions_at]
            count = mem32[entry + _WORD] & _MOST_FUNCTIONS
            for word in range(functions, functions + _WORD * count, _WORD):
                inner = mem32[word]
                _swap(inner + _RAW_CODE, inner + _RAW_FUNCTIONS, about)
            return


@micropython.viper
def _machine_code() -> object:
    pass


def _generator() -> "Any":
    yield


try:
    vfs.umount(_POINT)
except OSError:  # it is not mounted, which it may be on a virtual board
    pass
if is_whole():
    vfs.mount(_Sectors(), _POINT)
    sys.path.append(_POINT)
