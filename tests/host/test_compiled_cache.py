"""The compiled program is made once: what is kept is used where it is what would be made, and only there."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from armtempo.deploy import compiled_cache, program_files

pytestmark = pytest.mark.xdist_group("compact program")  # which takes seconds to make

FILES = {"armtempo_board/core.mpy": bytes(range(256)), "armtempo_board/__init__.mpy": b""}


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
