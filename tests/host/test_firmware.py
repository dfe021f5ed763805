"""Firmwares with the program in them: what goes into the build, and what is said where something is missing."""

from __future__ import annotations

import json
import shutil
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from armtempo.cli import main
from armtempo.deploy import program_files
from armtempo.deploy.firmware import build, checkout, flash, frozen, image
from armtempo.errors import InputError, LinkError, ToolError
from armtempo.link.program_version import PACKAGES, own_crc, package_folder
from click.testing import CliRunner

MAKE = """#!/bin/sh
echo "$@" >> "$MAKE_LOG"
for word in "$@"; do case "$word" in BUILD=*) out="${word#BUILD=}";; esac; done
[ -n "$MAKE_FAILS" ] && { echo "error: it does not compile"; exit 2; }
[ -n "$out" ] || exit 0
for name in firmware0.bin firmware1.bin firmware.dfu firmware.hex firmware.elf; do echo "$name" > "$out/$name"; done
"""
GCC = '#!/bin/sh\ncase "$1" in -dump*) echo 13.2.1;; *) exit ${NO_NEWLIB:-0};; esac\n'
TOOL = '#!/bin/sh\necho "${0##*/} $@" >> "$TOOL_LOG"\n'
DFU = TOOL + 'case "$1" in --list) printf "$DFU_LIST";; *) exit ${DFU_FAILS:-0};; esac\n'
ONE = "Found DFU: [0483:df11] ver=2200, devnum=9, alt=1\\nFound DFU: [0483:df11] ver=2200, devnum=9, alt=0\\n"
BOARD_MAKE = """CMSIS_MCU = STM32F407xx
ifeq ($(USE_MBOOT),1)
TEXT0_ADDR = 0x08020000
else
TEXT0_ADDR = 0x08000000
TEXT1_ADDR = 0x08020000
endif
"""
HEADER = '#define MICROPY_HW_BOARD_NAME "F4DISC"\n#define MICROPY_HW_MCU_NAME "STM32F407"\n'
ROOT = Path(__file__).parents[2]
STM32F4DISC = "ports/stm32/boards/STM32F4DISC"
HEAD = str(shutil.which("head"))
MACHINE = "F4DISC with STM32F407"


def no_progress(done: float, whole: float) -> None: ...


@pytest.fixture
def tools(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Makes a folder with programs, by name, the only one beside the system's to be looked into."""
    folder = tmp_path / "bin"
    folder.mkdir()

    def make(**programs: str) -> Path:
        for name, text in {"make": MAKE, "gcc": GCC, "arm_none_eabi_gcc": GCC, **programs}.items():
            if text:
                path = folder / name.replace("_", "-")
                path.write_text(text)
                path.chmod(path.stat().st_mode | stat.S_IXUSR)
        return folder

    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.setenv("MAKE_LOG", str(tmp_path / "make.log"))
    monkeypatch.setenv("TOOL_LOG", str(tmp_path / "tool.log"))
    monkeypatch.delenv("ARMTEMPO_PORT", raising=False)
    return make


@pytest.fixture
def micropython(tmp_path: Path) -> Path:
    """What of a checkout is looked at."""
    folder = tmp_path / "micropython"
    files = {
        "py/mpconfig.h": "".join(
            f"#define MICROPY_VERSION_{part} {number}\n"
            for part, number in (("MAJOR", 1), ("MINOR", 28), ("MICRO", 0))
        ),
        "ports/stm32/Makefile": "GIT_SUBMODULES += lib/stm32lib lib/tinyusb\n",
        "ports/stm32/boards/STM32F4DISC/mpconfigboard.mk": BOARD_MAKE,
        "ports/stm32/boards/STM32F4DISC/mpconfigboard.h": HEADER,
        "ports/stm32/boards/PYBV11/mpconfigboard.mk": BOARD_MAKE.replace("407", "405")
        + "FROZEN_MANIFEST ?= boards/PYBV10/manifest.py\n",
        "ports/stm32/boards/PYBV11/mpconfigboard.h": HEADER.replace("STM32F407", "STM32F405RG"),
        "ports/stm32/boards/OTHER/mpconfigboard.mk": "CMSIS_MCU = STM32H743xx\n",
        "ports/stm32/boards/OTHER/mpconfigboard.h": "",
        "lib/stm32lib/a": "",
        "lib/tinyusb/a": "",
        "lib/micropython-lib/a": "",
    }
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def frozen_by(manifest: str) -> tuple[list[str], list[tuple[str, int]]]:
    """What a manifest includes, and the packages that it freezes."""
    included: list[str] = []
    packages: list[tuple[str, int]] = []
    calls: dict[str, Any] = {
        "include": included.append,
        "package": lambda name, opt: packages.append((name, opt)),
    }
    exec(manifest, calls)
    return included, packages


def test_the_manifest_takes_every_module_of_the_program(tmp_path: Path) -> None:
    folder = tmp_path / "program"
    frozen.write(folder)
    included, packages = frozen_by((folder / "manifest.py").read_text())
    assert included == ["$(PORT_DIR)/boards/manifest.py"]
    assert [name for name, _ in packages] == [*PACKAGES]
    there = {str(path.relative_to(folder)) for name in PACKAGES for path in (folder / name).rglob("*.py")}
    assert there == {*program_files.modules(), frozen.HASH}
    board = package_folder(PACKAGES[0])
    every = {f"{PACKAGES[0]}/{path.relative_to(board).as_posix()}" for path in board.rglob("*.py")}
    assert every - there == {f"{PACKAGES[0]}/{name}" for name in program_files.START_FILES}
    for name, source in program_files.modules().items():
        if not name.endswith("program_hash.py"):
            assert (folder / name).read_bytes() == source.read_bytes(), "the sources as they are"


def test_the_frozen_program_tells_the_hash_of_the_sources() -> None:
    told: dict[str, Any] = {}
    exec(frozen.files()[frozen.HASH], told)
    assert told["CRC"] == own_crc()
    assert b"import CRC" in frozen.files()["armtempo_shared/program_hash.py"]


def test_a_boards_own_manifest_is_kept(micropython: Path) -> None:
    found = checkout.board(checkout.look(micropython), "PYBV11")
    assert found.manifest == "$(PORT_DIR)/boards/PYBV10/manifest.py"
    included, _ = frozen_by(frozen.files(found.manifest)["manifest.py"].decode())
    assert included == [found.manifest]


def test_a_build_makes_a_whole_folder(micropython: Path, tools: Callable[..., Path], tmp_path: Path) -> None:
    tools()
    out = tmp_path / "out"
    made = build.build(micropython, "STM32F4DISC", out, no_progress)
    assert image.read(out) == made
    assert made == image.Image(
        "STM32F4DISC",
        MACHINE,
        "1.28.0",
        "arm-none-eabi-gcc 13.2.1",
        own_crc(),
        (image.Piece("firmware0.bin", 0x08000000), image.Piece("firmware1.bin", 0x08020000)),
    )
    assert {path.name for path in out.iterdir()} == {
        "firmware0.bin",
        "firmware1.bin",
        "firmware.dfu",
        "firmware.hex",
        "firmware.elf",
        "firmware.json",
    }
    cross, port = (tmp_path / "make.log").read_text().splitlines()
    assert "mpy-cross" in cross
    assert "FROZEN_MANIFEST=" in port
    with pytest.raises(InputError, match="there already"):
        build.build(micropython, "STM32F4DISC", out, no_progress)


def test_a_chip_without_the_programs_pins_is_told(
    micropython: Path, tools: Callable[..., Path], tmp_path: Path
) -> None:
    tools()
    code, said = outcome(
        "firmware", "--board", "PYBV11", "--micropython", micropython, "--out", tmp_path / "out"
    )
    assert code == 0
    assert "cannot drive an arm: its chip has 64 pins" in said


def test_releases_bring_the_boards_that_are_named() -> None:
    workflow = (ROOT / ".github" / "workflows" / "firmware.yml").read_text()
    assert f"board: [{', '.join(checkout.BOARDS)}]" in workflow
    page = (ROOT / "board" / "docs" / "firmware.md").read_text()
    assert all(f"`{name}`" in page for name in (*checkout.BOARDS, "PYBV11"))
    assert f"--branch {checkout.RELEASE} " in page


def test_a_board_definition_of_ones_own_is_taken(
    micropython: Path, tools: Callable[..., Path], tmp_path: Path
) -> None:
    tools()
    own = tmp_path / "MINE"
    own.mkdir()
    for name, text in (("mpconfigboard.mk", BOARD_MAKE), ("mpconfigboard.h", HEADER)):
        (own / name).write_text(text)
    assert build.build(micropython, str(own), tmp_path / "out", no_progress).board == "MINE"
    assert f"BOARD_DIR={own}" in (tmp_path / "make.log").read_text()


def test_a_firmware_too_large_for_the_chip_is_refused(
    micropython: Path, tools: Callable[..., Path], tmp_path: Path
) -> None:
    """MicroPython's linker takes every F407 for one of 1 MB."""
    large = "head -c 400000 /dev/zero > $out/firmware1.bin\n"
    (tools(make=MAKE + large) / "head").symlink_to(HEAD)
    header = micropython / "ports/stm32/boards/STM32F4DISC/mpconfigboard.h"
    build.build(micropython, "STM32F4DISC", tmp_path / "large", no_progress)
    header.write_text(HEADER.replace("STM32F407", "STM32F407VE"))
    with pytest.raises(ToolError, match="6784 bytes larger than the flash"):
        build.build(micropython, "STM32F4DISC", tmp_path / "out", no_progress)
    assert not (tmp_path / "out").exists()


def outcome(*arguments: str | Path) -> tuple[int, str]:
    """Exit code and what is said of a command."""
    done = CliRunner().invoke(main, [str(each) for each in arguments])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done.exit_code, done.output


def test_the_command_says_how_to_get_a_checkout(tools: Callable[..., Path], tmp_path: Path) -> None:
    tools()
    code, said = outcome("firmware")
    assert code == 2
    assert f"git clone --depth 1 --branch {checkout.RELEASE}" in said
    code, said = outcome("firmware", "--board", "STM32F4DISC", "--micropython", tmp_path)
    assert code == 2
    assert "is no checkout of MicroPython\nhint: get one: git clone" in said


@pytest.mark.parametrize(
    ("board", "change", "words"),
    [
        ("NONE", {}, "knows no board NONE\nhint: give one that suits: PYBV11, STM32F4DISC"),
        ("OTHER", {}, "has no STM32F405 or F407\nhint: give one that suits: PYBV11, STM32F4DISC"),
        ("STM32F4DISC", {"lib/tinyusb/a": None}, "lacks submodules (lib/tinyusb)\nhint: get them: make -C"),
        ("STM32F4DISC", {"lib/micropython-lib/a": None}, "lacks submodules (lib/micropython-lib)"),
        (
            "STM32F4DISC",
            {f"{STM32F4DISC}/mpconfigboard.mk": f"{BOARD_MAKE}MICROPY_PY_LWIP = 1\n"},
            "lacks submodules (lib/lwip)",
        ),
        ("STM32F4DISC", {"py/mpconfig.h": "#define MICROPY_VERSION_MAJOR 1\n"}, "is no checkout"),
    ],
)
def test_a_checkout_that_does_not_suit(
    board: str,
    change: dict[str, str | None],
    words: str,
    micropython: Path,
    tools: Callable[..., Path],
    tmp_path: Path,
) -> None:
    tools()
    for name, text in change.items():
        (micropython / name).unlink()
        if text is not None:
            (micropython / name).write_text(text)
    code, said = outcome(
        "firmware", "--board", board, "--micropython", micropython, "--out", tmp_path / "out"
    )
    assert code == 2
    assert words in said
    assert not (tmp_path / "out").exists()
    assert not (tmp_path / "make.log").exists(), "nothing was begun"


def test_an_old_checkout_is_refused(micropython: Path) -> None:
    header = micropython / "py" / "mpconfig.h"
    header.write_text(header.read_text().replace("MINOR 28", "MINOR 19"))
    with pytest.raises(
        InputError, match=r"is MicroPython 1\.19\.0, which is too old; get a newer one: git clone"
    ):
        checkout.look(micropython)


def test_a_path_with_a_space_is_refused(micropython: Path) -> None:
    with pytest.raises(InputError, match="takes no path with a space"):
        checkout.look(micropython.rename(micropython.with_name("micro python")))


@pytest.mark.parametrize("missing", ["make", "arm_none_eabi_gcc", "gcc"])
def test_a_missing_compiler_is_named(
    missing: str, micropython: Path, tools: Callable[..., Path], tmp_path: Path
) -> None:
    tools(**{missing: ""})
    code, said = outcome(
        "firmware", "--board", "STM32F4DISC", "--micropython", micropython, "--out", tmp_path / "out"
    )
    assert code == 1
    assert f"{missing.replace('_', '-')}: not installed" in said
    assert "hint: install it, on Debian and Ubuntu: sudo apt install" in said
    assert not (tmp_path / "out").exists()


def test_no_gcc_is_needed_where_mpy_cross_is_built(
    micropython: Path, tools: Callable[..., Path], tmp_path: Path
) -> None:
    tools(gcc="")
    (micropython / "mpy-cross" / "build").mkdir(parents=True)
    (micropython / "mpy-cross" / "build" / "mpy-cross").touch()
    build.build(micropython, "STM32F4DISC", tmp_path / "out", no_progress)
    assert len((tmp_path / "make.log").read_text().splitlines()) == 1


def test_a_compiler_without_its_library_is_named(
    micropython: Path, tools: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools()
    monkeypatch.setenv("NO_NEWLIB", "1")
    with pytest.raises(ToolError, match="no C library"):
        build.build(micropython, "STM32F4DISC", tmp_path / "out", no_progress)


def test_a_build_that_fails_leaves_nothing(
    micropython: Path, tools: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools()
    monkeypatch.setenv("MAKE_FAILS", "1")
    code, said = outcome(
        "firmware", "--board", "STM32F4DISC", "--micropython", micropython, "--out", tmp_path / "out"
    )
    assert code == 1
    assert "error: it does not compile" in said
    assert not (tmp_path / "out").exists()


@pytest.fixture
def built(tmp_path: Path) -> Path:
    """A firmware's folder."""
    folder = tmp_path / "firmware"
    pieces = (image.Piece("firmware0.bin", 0x08000000), image.Piece("firmware1.bin", 0x08020000))
    made = image.Image("STM32F4DISC", MACHINE, "1.28.0", "gcc", own_crc(), pieces)
    folder.mkdir()
    for piece in pieces:
        (folder / piece.file).touch()
    (folder / image.ABOUT).write_bytes(image.about(made))
    return folder


def test_flashing_by_usb_writes_the_vectors_last(
    built: Path, tools: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU)
    monkeypatch.setenv("DFU_LIST", ONE)
    code, said = outcome("flash", built)
    assert (code, "armtempo deploy --port PORT" in said) == (0, True), said
    assert (tmp_path / "tool.log").read_text().splitlines() == [
        "dfu-util --list",
        f"dfu-util -d 0483:df11 -a 0 -s 0x08020000 -D {built}/firmware1.bin",
        f"dfu-util -d 0483:df11 -a 0 -s 0x08000000:leave -D {built}/firmware0.bin",
    ]


def test_flashing_by_st_link(built: Path, tools: Callable[..., Path], tmp_path: Path) -> None:
    tools(st_flash=TOOL)
    assert outcome("flash", built)[0] == 0
    assert (tmp_path / "tool.log").read_text().splitlines() == [
        f"st-flash --connect-under-reset write {built}/firmware1.bin 0x08020000",
        f"st-flash --connect-under-reset --reset write {built}/firmware0.bin 0x08000000",
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
    monkeypatch.setattr(flash, "Remote", FakeRemote)
    monkeypatch.setattr(flash, "end_program", lambda port, tell: None)


@pytest.mark.usefixtures("board")
def test_a_board_at_a_port_goes_into_its_bootloader(
    built: Path, tools: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU, st_flash=TOOL)
    monkeypatch.setenv("DFU_LIST", ONE)
    assert outcome("flash", built, "--port", "/dev/ttyX")[0] == 0
    lines = (tmp_path / "tool.log").read_text().splitlines()
    assert lines[:2] == ["mpremote bootloader", "dfu-util --list"]
    (tmp_path / "tool.log").unlink()
    assert outcome("flash", built, "--port", "/dev/ttyX", "--tool", "st-flash")[0] == 0
    assert "mpremote" not in (tmp_path / "tool.log").read_text()


@pytest.mark.usefixtures("board")
def test_another_board_than_the_firmwares_is_refused(
    built: Path, tools: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU)
    monkeypatch.setattr(FakeRemote, "machine", "PYBv1.1 with STM32F405RG")
    code, said = outcome("flash", built, "--port", "/dev/ttyX")
    assert code == 1
    assert "is a PYBv1.1 with STM32F405RG, the firmware is for a F4DISC" in said
    assert not (tmp_path / "tool.log").exists()


def test_a_moving_board_is_not_flashed(
    built: Path, tools: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU)

    def moving(port: str, tell: object) -> None:
        raise LinkError("the board is moving")

    monkeypatch.setattr(flash, "end_program", moving)
    with pytest.raises(LinkError, match="is moving"):
        flash.flash(built, "/dev/ttyX", None, print, no_progress)


@pytest.mark.parametrize(
    ("devices", "words"), [("", "no board in its bootloader"), (ONE * 2, "2 boards in their bootloader")]
)
def test_no_bootloader_or_more_than_one(
    devices: str, words: str, built: Path, tools: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    tools(dfu_util=DFU)
    monkeypatch.setenv("DFU_LIST", devices)
    code, said = outcome("flash", built)
    assert code == 1
    assert words in said
    assert "BOOT0" in said


@pytest.mark.parametrize("tool", [None, "dfu-util", "st-flash"])
def test_missing_flash_tools_are_named(tool: str | None, built: Path, tools: Callable[..., Path]) -> None:
    tools()
    code, said = outcome("flash", built, *(["--tool", tool] if tool else []))
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
    code, said = outcome("flash", built)
    assert code == 1
    assert "no whole firmware now" in said
    assert "hint: flash again" in said


def test_a_virtual_board_takes_no_firmware(built: Path, tools: Callable[..., Path]) -> None:
    tools(dfu_util=DFU)
    assert outcome("flash", built, "--port", "sim")[0] == 2


def test_a_folder_that_is_no_firmware_is_refused(
    built: Path, tools: Callable[..., Path], tmp_path: Path
) -> None:
    tools(st_flash=TOOL)
    for damage, words in (
        (lambda: (built / "firmware1.bin").unlink(), "is not whole: firmware1.bin"),
        (lambda: (built / image.ABOUT).write_text(json.dumps({"pieces": []})), "cannot be read"),
        (lambda: (built / image.ABOUT).unlink(), "holds no firmware"),
    ):
        damage()
        code, said = outcome("flash", built)
        assert code == 2
        assert words in said
    assert not (tmp_path / "tool.log").exists()


def test_another_version_in_a_firmware_is_told(built: Path, tools: Callable[..., Path]) -> None:
    tools(st_flash=TOOL)
    content = json.loads((built / image.ABOUT).read_text())
    (built / image.ABOUT).write_text(json.dumps(content | {"program_crc": f"{own_crc() ^ 1:08x}"}))
    code, said = outcome("flash", built)
    assert code == 0
    assert "another version of the program" in said
