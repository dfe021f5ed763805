"""`armtempo firmware`: what is said where a checkout does not suit or a compiler is missing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from armtempo.basics.errors import InputError, ToolError
from armtempo.deploy.firmware import build, checkout

from tests.host.firmware.fakes import BOARD_MAKE, STM32F4DISC, no_progress, outcome


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
