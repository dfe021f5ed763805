"""`armtempo flash`: how a firmware gets onto a board, and what is said if it does not."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from armtempo.basics.errors import LinkError
from armtempo.deploy.firmware import image, write
from armtempo.link.program_version import own_crc
from armtempo.ports.board_port import Port

from tests.host.firmware.fakes import DFU, MACHINE, ONE, ST_INFO, STLINK, dfu_list, no_progress, outcome


@pytest.fixture
def built(tmp_path: Path) -> Path:
    """A firmware's folder."""
    folder = tmp_path / "firmware"
    pieces = (image.Piece("firmware0.bin", 0x08000000), image.Piece("firmware1.bin", 0x08020000))
    made = image.Image("STM32F4DISC", MACHINE, "1.28.0", "gcc", own_crc(), pieces)
    folder.mkdir()
    for piece in pieces:
        (folder / piece.file).write_bytes(piece.file.encode())
    (folder / image.ABOUT).write_bytes(image.about(made))
    return folder


def test_flashing_by_usb_writes_the_vectors_last(
    built: Path, tools: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU)
    monkeypatch.setenv("DFU_LIST", ONE)
    code, said = outcome("flash", "--image", built)
    assert (code, "armtempo deploy" in said) == (0, True), said
    back = re.compile(r"\S+armtempo-flash-\S+")
    assert back.sub("BACK", (tmp_path / "tool.log").read_text()).splitlines() == [
        *["dfu-util --list"] * 2,
        f"dfu-util -d 0483:df11 -a 0 -s 0x08020000 -D {built}/firmware1.bin",
        f"dfu-util -d 0483:df11 -a 0 -s 0x08000000 -D {built}/firmware0.bin",
        "dfu-util -d 0483:df11 -a 0 -s 0x08020000:13 -U BACK",
        "dfu-util -d 0483:df11 -a 0 -s 0x08000000:13 -U BACK",
        "dfu-util -d 0483:df11 -a 0 -s 0x08000000:4:leave -U BACK",
    ]


def test_what_is_read_back_must_be_what_was_written(
    built: Path, tools: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU)
    monkeypatch.setenv("DFU_LIST", ONE)
    monkeypatch.setenv("DFU_DAMAGES", "1")
    code, said = outcome("flash", "--image", built)
    assert code == 1
    assert "the data read back at 0x08020000 differ from what was written" in said


def test_the_only_firmware_here_is_taken(
    built: Path, tools: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(st_flash=STLINK, st_info=ST_INFO)
    monkeypatch.chdir(tmp_path)
    assert outcome("flash")[0] == 0
    shutil.make_archive("armtempo-firmware-STM32F4DISC", "zip", tmp_path, built.name)
    code, said = outcome("flash")
    assert (code, "2 firmwares found here" in said) == (2, True)
    shutil.rmtree(built)
    assert outcome("flash")[0] == 0  # of the zip file
    Path("armtempo-firmware-STM32F4DISC.zip").write_bytes(b"PK cut")
    code, said = outcome("flash")
    assert (code, "is not a complete zip file" in said) == (2, True)
    Path("armtempo-firmware-STM32F4DISC.zip").unlink()
    code, said = outcome("flash")
    assert (code, "no firmware given" in said) == (2, True)


def test_flashing_by_st_link(built: Path, tools: Callable[..., Path], tmp_path: Path) -> None:
    tools(st_flash=STLINK, st_info=ST_INFO)
    assert outcome("flash", "--image", built)[0] == 0
    back = re.compile(r"\S+armtempo-flash-\S+")
    assert back.sub("BACK", (tmp_path / "tool.log").read_text()).splitlines() == [
        f"st-flash --connect-under-reset write {built}/firmware1.bin 0x08020000",
        f"st-flash --connect-under-reset write {built}/firmware0.bin 0x08000000",
        "st-flash --connect-under-reset read BACK 0x08020000 13",
        "st-flash --connect-under-reset read BACK 0x08000000 13",
        "st-flash reset",
    ]


class FakeRemote:
    """A board's prompt: what it is, and what it was told."""

    machine = MACHINE
    log = ""

    def __init__(self, port: str) -> None:
        self.told: list[str] = []

    def survey(self) -> FakeRemote:
        return self

    def run(self, *commands: list[str]) -> str:
        with Path(self.log).open("a") as file:
            file.write(f"mpremote {commands[0][0]}\n")
        return ""


@pytest.fixture
def board(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A board that answers at any port."""
    monkeypatch.setattr(FakeRemote, "log", str(tmp_path / "tool.log"))
    monkeypatch.setattr(write, "Remote", FakeRemote)
    monkeypatch.setattr(write, "end_program", lambda port, tell: None)


@pytest.mark.usefixtures("board")
def test_a_board_at_a_port_goes_into_its_bootloader(
    built: Path, tools: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU, st_flash=STLINK, st_info=ST_INFO)
    monkeypatch.setenv("DFU_LIST", ONE)
    assert outcome("flash", "--image", built, "--port", "/dev/ttyX")[0] == 0
    lines = (tmp_path / "tool.log").read_text().splitlines()
    assert lines[:3] == ["mpremote bootloader", *["dfu-util --list"] * 2]
    (tmp_path / "tool.log").unlink()
    assert outcome("flash", "--image", built, "--port", "/dev/ttyX", "--tool", "st-flash")[0] == 0
    assert "mpremote" not in (tmp_path / "tool.log").read_text()


@pytest.mark.usefixtures("board")
def test_another_board_than_the_firmwares_is_refused(
    built: Path, tools: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU)
    monkeypatch.setattr(FakeRemote, "machine", "PYBv1.1 with STM32F405RG")
    code, said = outcome("flash", "--image", built, "--port", "/dev/ttyX")
    assert code == 1
    assert "is a PYBv1.1 with STM32F405RG, the firmware is for a F4DISC" in said
    assert not (tmp_path / "tool.log").exists()


def test_a_moving_board_is_not_flashed(
    built: Path, tools: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU)

    def moving(port: str, tell: object) -> None:
        raise LinkError("the board is moving")

    monkeypatch.setattr(write, "end_program", moving)
    with pytest.raises(LinkError, match="is moving"):
        write.flash(built, "/dev/ttyX", None, print, no_progress)


@pytest.mark.parametrize(
    ("devices", "words"),
    [
        ("", "sees no STM32F405 or F407"),
        (ONE * 2, "sees 2 boards"),
        (dfu_list("04*016Kg,01*064Kg"), "128 KB of flash, the firmware is for another one"),
        (dfu_list("04*016Kg,01*064Kg,07*128Kg,04*016Kg,01*064Kg,07*128Kg"), "2048 KB of flash"),
    ],
)
def test_just_one_chip_with_the_flash_is_written(
    devices: str, words: str, built: Path, tools: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU)
    monkeypatch.setenv("DFU_LIST", devices)
    code, said = outcome("flash", "--image", built)
    assert code == 1
    assert words in said
    assert devices or "BOOT0" in said


def test_another_chip_at_the_st_link_is_refused(
    built: Path, tools: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(st_flash=STLINK, st_info=ST_INFO)
    monkeypatch.setenv("ST_CHIP", "chipid:     0x419")
    code, said = outcome("flash", "--image", built)
    assert (code, "sees no STM32F405 or F407" in said) == (1, True), said
    assert not (tmp_path / "tool.log").exists()


def test_a_bootloader_that_may_not_be_opened(
    built: Path, tools: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU)
    monkeypatch.setenv("DFU_LIST", "")
    monkeypatch.setenv(
        "DFU_SAYS", "dfu-util: Cannot open DFU device 0483:df11 found on devnum 9 (LIBUSB_ERROR_ACCESS)"
    )
    code, said = outcome("flash", "--image", built)
    assert (code, "udev rule" in said) == (1, True), said


def test_a_port_that_is_not_there_is_a_board_in_its_bootloader(
    built: Path, tools: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A project or variable names the port; the board of an interrupted flashing has none."""
    tools(dfu_util=DFU)
    monkeypatch.setenv("ARMTEMPO_PORT", "/dev/ttyNONE")
    monkeypatch.setenv("DFU_LIST", ONE)
    assert outcome("flash", "--image", built)[0] == 0
    monkeypatch.setenv("DFU_LIST", "")
    code, said = outcome("flash", "--image", built)
    assert (code, "BOOT0" in said) == (2, True), said


@pytest.mark.usefixtures("board")
def test_the_only_board_needs_no_port(
    built: Path, tools: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    tools(dfu_util=DFU)
    boards = [Port("/dev/ttyX", "", True)]
    monkeypatch.setattr(write, "find_ports", lambda: boards)
    monkeypatch.setattr(write, "_APPEARS_S", 0.0)
    monkeypatch.setenv("DFU_LIST", "")  # the fake one does not appear
    assert outcome("flash", "--image", built)[0] == 1
    assert "mpremote bootloader" in (tmp_path / "tool.log").read_text()
    (tmp_path / "tool.log").unlink()
    boards.append(Port("/dev/ttyY", "", True))
    assert outcome("flash", "--image", built)[0] == 1
    assert "mpremote" not in (tmp_path / "tool.log").read_text()


def test_an_interrupted_flashing_is_told(
    built: Path, tools: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU)
    monkeypatch.setenv("DFU_LIST", ONE)
    shares: list[float] = []

    def interrupted(done: float, whole: float) -> None:
        shares.append(done / whole)
        if done > whole / 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match="'armtempo flash' again"):
        write.flash(built, None, None, print, interrupted)
    assert shares == [0, 0.125, 0.25, 0.375, 0.5, 0.625]


@pytest.mark.parametrize("tool", [None, "dfu-util", "st-flash"])
def test_missing_flash_tools_are_named(tool: str | None, built: Path, tools: Callable[..., Path]) -> None:
    tools()
    code, said = outcome("flash", "--image", built, *(["--tool", tool] if tool else []))
    assert code == 1
    assert "not installed" in said
    assert ("apt install dfu-util" in said) == (tool != "st-flash")
    assert ("apt install stlink-tools" in said) == (tool != "dfu-util")


def test_a_flash_tool_that_fails_says_what_to_do(
    built: Path, tools: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU)
    monkeypatch.setenv("DFU_LIST", ONE)
    monkeypatch.setenv("DFU_FAILS", "74")
    code, said = outcome("flash", "--image", built)
    assert code == 1
    assert "no whole firmware now" in said
    assert "hint: flash again" in said


def test_a_virtual_board_takes_no_firmware(built: Path, tools: Callable[..., Path]) -> None:
    tools(dfu_util=DFU)
    assert outcome("flash", "--image", built, "--port", "sim")[0] == 2


def test_a_folder_that_is_no_firmware_is_refused(
    built: Path, tools: Callable[..., Path], tmp_path: Path
) -> None:
    tools(st_flash=STLINK, st_info=ST_INFO)
    for damage, words in (
        (lambda: (built / "firmware1.bin").unlink(), "is incomplete: firmware1.bin"),
        (lambda: (built / image.ABOUT).write_text(json.dumps({"pieces": []})), "cannot be read"),
        (lambda: (built / image.ABOUT).unlink(), "contains no firmware"),
    ):
        damage()
        code, said = outcome("flash", "--image", built)
        assert code == 2
        assert words in said
    assert not (tmp_path / "tool.log").exists()


def test_another_version_in_a_firmware_is_told(built: Path, tools: Callable[..., Path]) -> None:
    tools(st_flash=STLINK, st_info=ST_INFO)
    content = json.loads((built / image.ABOUT).read_text())
    (built / image.ABOUT).write_text(json.dumps(content | {"program_crc": f"{own_crc() ^ 1:08x}"}))
    code, said = outcome("flash", "--image", built)
    assert code == 0
    assert f"{own_crc() ^ 1:08x}; another version than here, {own_crc():08x}" in said
