"""Files that are written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from armtempo.basics.errors import InputError
from armtempo.cli import main
from armtempo.formats.atomic_file import replace_text
from armtempo.planning import planner
from click.testing import CliRunner


def test_new_old_and_linked(tmp_path: Path) -> None:
    path, link = tmp_path / "file", tmp_path / "link"
    link.symlink_to(path)
    for target, text in ((path, "one"), (path, "two"), (link, "three")):
        replace_text(target, text)
        assert path.read_text() == text
    assert link.is_symlink()
    assert sorted(item.name for item in tmp_path.iterdir()) == ["file", "link"]


def test_a_pipe_is_written_to(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        replace_text(pipe, "text")
        assert os.read(reader, 10) == b"text"
    finally:
        os.close(reader)
    assert pipe.is_fifo()


def test_what_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "folder"
    path.mkdir()
    for target in (path, tmp_path / "missing" / "file"):
        with pytest.raises(InputError, match=f"{target}: cannot be written: .*; choose another place"):
            replace_text(target, "text")
    assert list(tmp_path.rglob("*")) == [path]


def test_what_the_system_refuses_is_said_without_a_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device", "somewhere")

    monkeypatch.setattr(planner, "plan", full)
    result = CliRunner().invoke(main, ["plan"])
    assert (result.exit_code, result.output.split("ship with armtempo\n")[1]) == (
        1,
        "armtempo: somewhere: No space left on device\n"
        "hint: check the path, its permissions and the room on the disk\n",
    )
