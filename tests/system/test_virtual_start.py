"""How the virtual board starts, as the firmware does: button, boot.py, SD card, file system, and its folder."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
import serial
from armtempo.basics.errors import LinkError
from armtempo.cli.virtual_board import virtual_board
from armtempo.simulator import LaunchOptions, VirtualBoard, edgelog, launch
from armtempo.simulator.launcher import PREFIX, TemporaryFolder

from tests import interpreters
from tests.system import commandline
from tests.system.commandline import wait_for


def ask(board: VirtualBoard, code: str, soft_reset: bool = False) -> str:
    """What an expression is at the board's prompt, or its traceback."""
    with serial.Serial(board.port, timeout=commandline.SLOW_S) as port:
        port.write(b"\r\x03\x01")
        port.read_until(b"raw REPL; CTRL-B to exit\r\n>")
        if soft_reset:
            port.write(b"\x04")
            port.read_until(b"raw REPL; CTRL-B to exit\r\n>")
        port.write(f"import os, sys, pyb; print({code})\x04".encode())
        output, error = (port.read_until(b"\x04")[:-1].decode() for _ in range(2))
        return output.removeprefix("OK").removesuffix("\r\n") + error


def starter() -> str:
    return interpreters.starter(interpreters.AVAILABLE[-1])


def changes(log: Path, pin: str) -> list[int]:
    """The level after each edge of a pin in the first session."""
    _, levels = edgelog.read(log)[0].pins.get(pin, ([], []))
    return [int(level) for level in levels]


@pytest.fixture
def flash(tmp_path: Path) -> Path:
    """A flash whose files say that they were run."""
    folder = tmp_path / "flash"
    folder.mkdir()
    for name in ("boot", "main"):
        (folder / f"{name}.py").write_text(f"import sys; sys.{name}_was_run = True\n")
    return folder


RUN = "[name for name in ('boot', 'main') if hasattr(sys, name + '_was_run')]"
"""Which of the files were run; ``sys`` outlives a soft reset here."""


@pytest.mark.parametrize(
    ("seconds", "run", "files"),
    [(0.0, ["boot", "main"], 2), (0.5, ["boot", "main"], 2), (0.9, [], 2), (2.0, ["boot", "main"], 2)],
)
def test_button_held_at_power_up(
    flash: Path, tmp_path: Path, seconds: float, run: list[str], files: int
) -> None:
    log = tmp_path / "edges"
    with launch(
        LaunchOptions(flash, deployed=True, interpreter=starter(), button_s=seconds, edge_log=log)
    ) as board:
        assert ask(board, RUN) == str(run)
        assert ask(board, "len(os.listdir('/flash'))") == str(files)
    assert len(changes(log, "A0")) == (2 if seconds else 0)


def test_leds_of_safe_mode_and_its_end(flash: Path, tmp_path: Path) -> None:
    log = tmp_path / "edges"
    with launch(
        LaunchOptions(flash, deployed=True, interpreter=starter(), button_s=0.9, edge_log=log)
    ) as board:
        assert ask(board, "pyb.usb_mode()") == "VCP+MSC"
        assert ask(board, RUN, soft_reset=True) == "['boot']"
    assert changes(log, "D12") == [1, 0]  # green, then orange alone, which flashes six times
    assert changes(log, "D13") == [1, 0] * 7


def test_factory_reset_makes_a_fresh_file_system(flash: Path) -> None:
    with launch(LaunchOptions(flash, deployed=True, interpreter=starter(), button_s=1.5)) as board:
        assert ask(board, RUN) == "[]"
        assert "README.txt" in ask(board, "os.listdir('/flash')")
    assert "was_run" not in (flash / "main.py").read_text()


@pytest.mark.parametrize(("name", "flashes"), [("boot", 4), ("main", 3)])
def test_exception_at_the_start_flashes_and_ends_it(
    flash: Path, tmp_path: Path, name: str, flashes: int
) -> None:
    (flash / f"{name}.py").write_text("1 / 0\n")
    log = tmp_path / "edges"
    with launch(LaunchOptions(flash, deployed=True, interpreter=starter(), edge_log=log)) as board:
        assert ask(board, RUN) == str({"boot": [], "main": ["boot"]}[name])
    assert changes(log, "D14") == changes(log, "D12") == [1, 0] * flashes  # red and green in turn


def test_card_comes_first_unless_the_flash_says_otherwise(flash: Path, tmp_path: Path) -> None:
    card = tmp_path / "card"
    card.mkdir()
    (card / "both.py").write_text("place = 'card'\n")
    (flash / "both.py").write_text("place = 'flash'\n")
    with launch(LaunchOptions(flash, deployed=True, interpreter=starter(), sd_card=card)) as board:
        assert ask(board, "(os.getcwd(), sorted(os.listdir('/')))") == "('/sd', ['flash', 'sd'])"
        assert ask(board, "__import__('both').place") == "card"
        assert ask(board, RUN) == "[]"  # a card without boot.py and main.py
        assert ask(board, "open('/sd/new', 'w').write('x')") == "1"
        (flash / "SKIPSD").touch()
        assert ask(board, "os.listdir('/')", soft_reset=True) == "['flash']"
        assert ask(board, "__import__('both').place") == "flash"
    assert (card / "new").read_text() == "x"


def test_unreadable_file_system_until_it_is_formatted(flash: Path) -> None:
    (flash / "lib").mkdir()
    (flash / "lib" / "old.py").touch()
    with launch(LaunchOptions(flash, deployed=True, interpreter=starter(), damage="unreadable")) as board:
        assert "EIO" in ask(board, "os.listdir('/flash')")
        assert ask(board, "os.umount('/flash'), os.VfsFat.mkfs(pyb.Flash(start=0))") == "None None"
        assert "ENOENT" in ask(board, "os.listdir('/flash')")
        assert ask(board, "os.mount(pyb.Flash(start=0), '/flash'), os.listdir('/flash')") == "None []"
        assert "EPERM" in ask(board, "os.mount(pyb.Flash(start=0), '/flash')")


def test_nothing_is_wrong_with_a_board_unless_asked_for() -> None:
    options = LaunchOptions()
    assert options.virtual_time, "motions as fast as they can"
    assert not any((options.faults, options.power_cut_at, options.button_s, options.damage, options.sd_card))


def test_the_command_starts_the_board_that_a_script_gets() -> None:
    (seed,) = (option for option in virtual_board.params if option.name == "seed")
    assert seed.default == LaunchOptions().seed


def test_a_system_without_pseudo_terminals_is_told_where_they_come_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none_left() -> tuple[int, int]:
        raise OSError("out of pty devices")

    monkeypatch.setattr("pty.openpty", none_left)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with pytest.raises(LinkError, match="out of pty devices") as caught:
        launch()
    assert "/dev/pts" in caught.value.hint
    assert not list(tmp_path.iterdir())


def test_folder_of_a_killed_launcher_is_swept_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    code = (
        "from armtempo import simulator as v; import time; print(v.launch().port, flush=True); time.sleep(99)"
    )
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    launcher = subprocess.Popen(
        [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True
    )
    assert launcher.stdout
    assert launcher.stdout.readline()
    (stale,) = tmp_path.glob(f"{PREFIX}*")

    def swept() -> bool:
        with launch():
            return not stale.exists()

    assert not swept()  # it is in use
    launcher.kill()
    launcher.communicate()
    wait_for(swept, "the end of the board without a launcher")
    assert not list(tmp_path.glob(f"{PREFIX}*"))


def test_a_folder_whose_lock_cannot_be_opened_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another user's; here the lock is a folder, which nobody opens as a file."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    others = tmp_path / f"{PREFIX}others" / "lock"
    others.mkdir(parents=True)
    TemporaryFolder().remove()
    assert list(tmp_path.iterdir()) == [others.parent]
