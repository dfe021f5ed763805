"""Machine code and bytecode as files lie in the board's heap, whose collector takes every word for a possible address.

A word of code that is the address of a block of the heap keeps what begins there from ever being freed: in some builds
2 to 3 KB of an upload, by `add r2, sp, #0; movs r0, #1` (0x2001AA00), which calls a method with one argument.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import pytest
from armtempo.deploy import program_files
from armtempo.deploy.package import STM32F4

HEAP = range(0x2000_2000, 0x2001_C000, 16)
"""Where a block may begin: RAM behind what is static, up to the stack (MicroPython's stm32f405.ld)."""
HEADER_BYTES = 4
KIND_BYTECODE, KIND_VIPER = 0, 2
OBJECT_FIRST_WITH_LENGTH, OBJECT_TEXT, OBJECT_TUPLE = 5, (5, 6), 10


@dataclass
class Reader:
    """Of a compiled file (MicroPython's py/persistentcode.c)."""

    data: bytes
    at: int = HEADER_BYTES

    def number(self) -> int:
        """7 bits a byte, the highest first."""
        value = 0
        while True:
            byte = self.take(1)[0]
            value = value << 7 | byte & 0x7F
            if byte < 0x80:
                return value

    def take(self, count: int) -> bytes:
        """So many bytes."""
        self.at += count
        return self.data[self.at - count : self.at]

    def skip_constants(self) -> None:
        """Names and constant objects, which lie behind the header."""
        names, objects = self.number(), self.number()
        for _ in range(names):
            length = self.number()
            if not length & 1:
                self.take((length >> 1) + 1)
        for _ in range(objects):
            self.skip_object()

    def skip_object(self) -> None:
        """One of them."""
        kind = self.take(1)[0]
        if kind < OBJECT_FIRST_WITH_LENGTH:
            return
        length = self.number()
        if kind == OBJECT_TUPLE:
            for _ in range(length):
                self.skip_object()
        else:
            self.take(length + (kind in OBJECT_TEXT))

    def codes(self) -> Iterator[bytes]:
        """The code of each function, which gets a block of its own."""
        head = self.number()
        kind = head & 3
        yield self.take(head >> 3)
        if kind != KIND_BYTECODE:
            flags = self.number()
            assert kind == KIND_VIPER
            assert not flags & 0x60, "code with data of its own, which is not read here"
        if head & 4:
            for _ in range(self.number()):
                yield from self.codes()


def codes(data: bytes) -> list[bytes]:
    """Of a whole file."""
    reader = Reader(data)
    reader.skip_constants()
    found = list(reader.codes())
    assert reader.at == len(data)
    return found


FILES = {path: data for path, data in program_files.library(STM32F4).items() if path.endswith(".mpy")}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.rpartition("/")[2])
def test_no_word_of_code_is_an_address_in_the_heap(path: str) -> None:
    found = [
        (number, at, hex(word))
        for number, code in enumerate(codes(FILES[path]))
        for at, (word,) in zip(
            range(0, len(code), 4), struct.iter_unpack("<I", code[: len(code) & ~3]), strict=False
        )
        if word in HEAP
    ]
    assert not found, "function, byte, word: change the function a little, so that it falls otherwise"


def test_the_code_of_a_function_is_read() -> None:
    """Viper functions begin by saving registers."""
    machine = [code for data in FILES.values() for code in codes(data) if code[:2] == b"\xfe\xb5"]
    assert sum(map(len, machine)) > 20_000
