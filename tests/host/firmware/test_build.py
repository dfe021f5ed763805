"""Firmwares with the program in them: what goes into the build, and the command's messages if something is missing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from armtempo.basics.errors import InputError, ToolError
from armtempo.deploy import program_files
from armtempo.deploy.firmware import build, checkout, frozen, image
from armtempo.link.program_version import PACKAGES, own_crc, package_folder

from tests import interpreters
from tests.host.firmware.fakes import (
    BOARD_MAKE,
    HEAD,
    HEADER,
    MACHINE,
    MAKE,
    STM32F4DISC,
    no_progress,
    outcome,
)


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


@pytest.mark.slow
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
    outside = {*program_files.START_FILES, "sectors.py"}
    assert every - there == {f"{PACKAGES[0]}/{name}" for name in outside}
    for name, source in program_files.modules().items():
        if not name.endswith("program_hash.py"):
            lines = [path.read_text().count("\n") for path in (folder / name, source)]
            assert lines[0] == lines[1], "the sources' lines as they are"


@pytest.mark.slow
def test_the_frozen_program_tells_the_hash_of_the_sources() -> None:
    told: dict[str, Any] = {}
    exec(frozen.files()[frozen.HASH], told)
    assert told["CRC"] == own_crc()
    assert b"import CRC" in frozen.files()["armtempo_shared/program_hash.py"]


@pytest.mark.slow
def test_a_boards_own_manifest_is_kept(micropython: Path) -> None:
    found = checkout.board(checkout.look(micropython), "PYBV11")
    assert found.manifest == "$(PORT_DIR)/boards/PYBV10/manifest.py"
    included, _ = frozen_by(frozen.files(found.manifest)["manifest.py"].decode())
    assert included == [found.manifest]


@pytest.mark.slow
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
    with pytest.raises(InputError, match="already exists"):
        build.build(micropython, "STM32F4DISC", out, no_progress)


def test_a_firmware_in_one_piece_has_no_number() -> None:
    definition = checkout.BoardDefinition("MINE", Path("MINE"), MACHINE, "", (0x08000000,), 0x08100000)
    assert build._pieces(definition) == (image.Piece("firmware.bin", 0x08000000),)


@pytest.mark.slow
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
    workflow = (interpreters.ROOT / ".github" / "workflows" / "firmware.yml").read_text()
    assert f"board: [{', '.join(checkout.BOARDS)}]" in workflow
    page = (interpreters.ROOT / "board" / "docs" / "firmware.md").read_text()
    assert all(f"`{name}`" in page for name in checkout.BOARDS)
    assert f"--branch {checkout.RELEASE} " in page


@pytest.mark.slow
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


@pytest.mark.slow
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


def test_the_command_says_how_to_get_a_checkout(tools: Callable[..., Path], tmp_path: Path) -> None:
    tools()
    code, said = outcome("firmware")
    assert code == 2
    assert f"git clone --depth 1 --branch {checkout.RELEASE}" in said
    code, said = outcome("firmware", "--board", "STM32F4DISC", "--micropython", tmp_path)
    assert code == 2
    assert "is not a MicroPython checkout\nhint: get one: git clone" in said


@pytest.mark.parametrize(
    ("board", "change", "words"),
    [
        ("NONE", {}, "has no board NONE\nhint: give one that suits: PYBV11, STM32F4DISC"),
        ("OTHER", {}, "has no STM32F405 or F407\nhint: give one that suits: PYBV11, STM32F4DISC"),
        ("STM32F4DISC", {"lib/tinyusb/a": None}, "lacks submodules (lib/tinyusb)\nhint: get them: make -C"),
        ("STM32F4DISC", {"lib/micropython-lib/a": None}, "lacks submodules (lib/micropython-lib)"),
        (
            "STM32F4DISC",
            {f"{STM32F4DISC}/mpconfigboard.mk": f"{BOARD_MAKE}MICROPY_PY_LWIP = 1\n"},
            "lacks submodules (lib/lwip)",
        ),
        (
            "STM32F4DISC",
            {"py/mpconfig.h": "#define MICROPY_VERSION_MAJOR 1\n"},
            "is not a MicroPython checkout",
        ),
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


@pytest.mark.parametrize(("minor", "why"), [(19, "is too old"), (27, "compiles code for this chip wrongly")])
def test_an_unfit_release_is_refused(micropython: Path, minor: int, why: str) -> None:
    header = micropython / "py" / "mpconfig.h"
    header.write_text(header.read_text().replace("MINOR 28", f"MINOR {minor}"))
    with pytest.raises(
        InputError, match=rf"is MicroPython 1\.{minor}\.0, which {why}; get a newer one: git clone"
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


@pytest.mark.slow
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


@pytest.mark.slow
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
