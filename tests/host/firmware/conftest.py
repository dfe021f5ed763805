"""Fake programs on the path, and what of a checkout is looked at."""

from __future__ import annotations

import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.host.firmware.fakes import BOARD_MAKE, GCC, HEADER, MAKE


@pytest.fixture
def tools(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Makes a folder with programs, by name, the only one in addition to the system's to be looked into."""
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
