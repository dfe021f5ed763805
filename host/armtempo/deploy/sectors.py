"""The image of the compiled program for the chip's last two sectors of flash: the board's ``sectors.py`` reads it.

The code of functions runs in place, so it begins at multiples of 4: numbers in a compiled file may begin with bytes
0x80, which add nothing to them, and the number in front of the code gets as many.
"""

from __future__ import annotations

import ast
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ADDRESS = 0x080C0000
"""Of sectors 10 and 11, the last of a chip with 1 MB (RM0090 3.3)."""
SIZE = 2 * 128 * 1024
MAGIC = b"ARMT"
HEAD_BYTES = 12
_BYTE_CODE, _NATIVE, _VIPER = range(3)
_FUNCTION_TABLE, _ELLIPSIS, _STR, _BYTES, _TUPLE = 0, 4, 5, 6, 10
_FILLER = b"\x80"
_LATER = "\nlater"
"""The line in front of modules that are not loaded with the program."""
_FLAGS = 0x70
"""Of viper code, by which it would have data or addresses in it that are filled in."""


class UnknownFormatError(ValueError):
    """A compiled file is not as this module knows them."""


@dataclass(frozen=True)
class Code:
    """A function's code in a compiled file; ``functions``: number of those that are defined in it.

    ``head``: offset of the number in front of the code.
    """

    head: int
    offset: int
    size: int
    functions: int


def image(needed: Mapping[str, bytes], later: Mapping[str, bytes]) -> bytes:
    """The sectors' bytes, from compiled files by their module's dotted name.

    ``needed``: those that the program imports when it starts, those first that others import; ``later``: others.

    The functions of packages stay in the heap: they are what loads the others, and code that runs may not be freed.
    Raises UnknownFormatError if mpy-cross makes what this does not know, or more than fits.
    """
    files = {**needed, **later}
    packages = {module.rsplit(".", 1)[0] for module in files if "." in module}
    names = [
        f"{module.removeprefix('armtempo_').replace('.', '/')}{'/__init__' if module in packages else ''}"
        for module in files
    ]
    index_bytes = sum(len(f"\n{name} 000000") for name in names) + len(_LATER) + 1
    body = b""
    lines = []
    for number, ((module, data), name) in enumerate(zip(files.items(), names, strict=True)):
        if number == len(needed):
            lines.append(_LATER)
        at = -(-(HEAD_BYTES + 2 + index_bytes) // 4) * 4 + len(body)
        lines.append(f"\n{name} {at:06}")
        body += _module(at, data, codes(data) if module not in packages else [])
    index = ("".join(lines) + "\n").ljust(index_bytes, "\n").encode()
    text = len(index).to_bytes(2, "little") + index
    text += bytes(-(HEAD_BYTES + len(text)) % 4) + body
    if HEAD_BYTES + len(text) > SIZE:
        raise UnknownFormatError(f"{HEAD_BYTES + len(text)} bytes of program, the flash has space for {SIZE}")
    return MAGIC + struct.pack("<II", HEAD_BYTES + len(text), zlib.crc32(text)) + text


def _module(at: int, data: bytes, listed: Sequence[Code]) -> bytes:
    """What the sectors have of a module at an offset; ``listed``: functions that are to run there."""
    head = 4 + 8 * len(listed)
    aligned = align(data, at + head)
    table = b"".join(
        struct.pack("<II", at + head + code.offset, code.size << 8 | code.functions)
        for code in codes(aligned)[: len(listed)]
    )
    whole = struct.pack("<I", len(table) // 8) + table + aligned
    return whole + bytes(-len(whole) % 4)


def script(path: Path, **values: str | tuple[str, ...]) -> str:
    """A script for the board's prompt in which AT, SIZE and the ``values`` are known."""
    known = {"AT": ADDRESS, "SIZE": SIZE, **values}
    return "".join(f"{name} = {value!r}\n" for name, value in known.items()) + path.read_text(
        encoding="utf-8"
    )


def codes(data: bytes) -> list[Code]:
    """The functions of a compiled file; that of the module itself comes first."""
    found: list[Code] = []
    _Reader(data, found).file()
    return found


def align(data: bytes, at: int) -> bytes:
    """A compiled file that is the same, and all whose code begins at a multiple of 4 if the file begins at ``at``."""
    made, done = b"", 0
    for code in codes(data):
        made += data[done : code.head]
        made += _FILLER * (-(at + len(made) + code.offset - code.head) % 4)
        done = code.head
    return made + data[done:]


def in_order(sources: Mapping[str, str], first: str) -> list[str]:
    """The dotted names of modules that one needs, with it, each after those that it imports at its head."""
    found: list[str] = []
    begun: set[str] = set()

    def add(module: str) -> None:
        if module in begun or module not in sources:
            return
        begun.add(module)
        parts = module.split(".")
        for count in range(1, len(parts)):
            add(".".join(parts[:count]))
        for node in ast.parse(sources[module]).body:
            if isinstance(node, ast.ImportFrom):
                add(str(node.module))
                for alias in node.names:
                    add(f"{node.module}.{alias.name}")
        found.append(module)

    add(first)
    return found


class _Reader:
    """Reads a compiled file (MicroPython's py/persistentcode.c); ``found`` gets the code in it."""

    def __init__(self, data: bytes, found: list[Code]) -> None:
        self._data = data
        self._at = 4
        self._found = found

    def file(self) -> None:
        """Names, constants, then the functions."""
        names, constants = self._number(), self._number()
        for _ in range(names):
            size = self._number()
            self._at += 0 if size & 1 else (size >> 1) + 1
        for _ in range(constants):
            self._constant()
        self._function()
        if self._at != len(self._data):
            raise UnknownFormatError("the compiled file does not end where its last function does")

    def _number(self) -> int:
        value = 0
        while True:
            byte = self._data[self._at]
            self._at += 1
            value = value << 7 | byte & 0x7F
            if not byte & 0x80:
                return value

    def _constant(self) -> None:
        kind = self._number()
        if _FUNCTION_TABLE <= kind <= _ELLIPSIS:
            return
        size = self._number()
        if kind == _TUPLE:
            for _ in range(size):
                self._constant()
        else:
            self._at += size + (kind in (_STR, _BYTES))

    def _function(self) -> None:
        head = self._at
        about = self._number()
        kind, has_functions, size = about & 3, about & 4, about >> 3
        begin = self._at
        self._at += size
        if kind == _VIPER:
            if self._number() & _FLAGS:
                raise UnknownFormatError("viper code with data of its own")
        elif kind != _BYTE_CODE:
            raise UnknownFormatError("code that is neither byte code nor viper code")
        count = self._number() if has_functions else 0
        self._found.append(Code(head, begin, size, count))
        for _ in range(count):
            self._function()
