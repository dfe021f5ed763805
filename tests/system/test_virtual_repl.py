"""The virtual board's prompt: the real mpremote must take it for a board."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import serial
from armtempo.simulator import LaunchOptions, VirtualBoard, launch

from tests import interpreters
from tests.system import commandline


@pytest.fixture(params=[name for name in interpreters.AVAILABLE if name != "cpython"])
def bare(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[VirtualBoard]:
    """A board with an empty flash, under real MicroPython."""
    flash = tmp_path / "flash"
    with launch(
        LaunchOptions(flash, deployed=True, interpreter=interpreters.starter(request.param))
    ) as board:
        yield board


def mpremote(board: VirtualBoard, *arguments: str, code: int = 0) -> str:
    """What mpremote prints."""
    done = commandline.python("-m", "mpremote", "connect", board.port, *arguments)
    assert done.returncode == code, (done.stdout, done.stderr)
    return done.stdout + done.stderr


def test_files(bare: VirtualBoard, tmp_path: Path) -> None:
    data = bytes(range(256)) * 20
    (tmp_path / "here.bin").write_bytes(data)
    mpremote(bare, "mkdir", "lib", "+", "cp", str(tmp_path / "here.bin"), ":lib/there.bin")
    assert (bare.flash_dir / "lib" / "there.bin").read_bytes() == data
    assert "5120 there.bin" in mpremote(bare, "ls", "lib")
    mpremote(bare, "cp", ":lib/there.bin", str(tmp_path / "back.bin"))
    assert (tmp_path / "back.bin").read_bytes() == data
    assert "No such file" in mpremote(bare, "cat", ":absent", code=1)
    mpremote(bare, "rm", ":lib/there.bin", "+", "rmdir", "lib")
    assert {path.name for path in bare.flash_dir.iterdir()} == {
        "boot.py",
        "main.py",
        "README.txt",
        "pybcdc.inf",
    }


def test_a_full_flash_is_said(bare: VirtualBoard, tmp_path: Path) -> None:
    (bare.flash_dir / "there").write_bytes(bytes(160_000))
    (tmp_path / "big").write_bytes(bytes(5_000))
    assert "No space left" in mpremote(bare, "cp", str(tmp_path / "big"), ":big", code=1)


def test_code_errors_and_platform(bare: VirtualBoard) -> None:
    assert mpremote(bare, "exec", "import sys; print(sys.platform)") == "pyboard\n"
    assert "STM32F407" in mpremote(bare, "exec", "import sys; print(sys.implementation._machine)")
    code = "f = open('t', 'w'); print(1, 2, file=f); f.close(); print(__name__, open('t').read())"
    assert mpremote(bare, "exec", code) == "__main__ 1 2\n\n"
    error = mpremote(bare, "exec", "print('before'); 1 / 0", code=1)
    assert error.startswith("before\n")
    assert error.rstrip().endswith("ZeroDivisionError: divide by zero")
    assert "virtual_board" not in error


def test_main_starts_with_a_reset_and_is_interrupted(bare: VirtualBoard) -> None:
    mpremote(
        bare, "exec", "open('main.py', 'w').write('import pyb\\nprint(6 * 7)\\nwhile 1:\\n  pyb.delay(5)\\n')"
    )
    mpremote(bare, "reset")
    with serial.Serial(bare.port) as port:
        port.write(b"\x03")
        assert b"KeyboardInterrupt" in port.read_until(b">>> ")
        port.write(b"\x04")
        assert b"soft reboot" in port.read_until(b"42\r\n")
    mpremote(bare, "soft-reset", "exec", "print('still here')")


def test_friendly_prompt(bare: VirtualBoard) -> None:
    with serial.Serial(bare.port) as port:
        port.write(b"print('be' 'gin')\r")
        port.read_until(b"begin\r\n>>> ")
        port.write(b"\x02")
        assert port.read_until(b">>> ").startswith(b"\r\nMicroPython")  # on a line of its own
        port.write(b"x = 20 + 1\r")
        port.read_until(b">>> ")
        port.write(b"2 * xy\x08\r")  # a typing mistake, taken back
        assert port.read_until(b">>> ").endswith(b"42\r\n>>> ")
        port.write(b"for i in range(2):\r  print(i + 7)\r\r")
        assert b"7\r\n8\r\n" in port.read_until(b"8\r\n>>> ")
        port.write(b"\x01")
        port.read_until(b"raw REPL; CTRL-B to exit\r\n>")
        port.write(b"\x02")
        assert port.read_until(b">>> ").startswith(b"\r\nMicroPython")
        port.write(b"\x01")
        port.read_until(b"raw REPL; CTRL-B to exit\r\n>")
        port.write(b"\x04")
        assert port.read_until(b"soft reboot\r\n") == b"OK\r\nMPY: sync filesystems\r\nMPY: soft reboot\r\n"


def test_hard_reset_clears_the_registers_soft_reset_does_not(bare: VirtualBoard) -> None:
    code = "import stm, machine as m; print(m.mem32[stm.TIM2 + stm.TIM_ARR], m.reset_cause(), end=' ')"
    running = "print([m.mem32[stm.TIM4 + at] for at in (stm.TIM_CR1, stm.TIM_DIER, stm.TIM_CCER)])"
    code = f"{code}; {running}"
    mpremote(bare, "exec", "import stm; from machine import mem32; mem32[stm.TIM2 + stm.TIM_ARR] = 77")
    mpremote(bare, "resume", "exec", "import pyb; pyb.Timer(4, freq=100, callback=lambda timer: None)")
    assert mpremote(bare, "soft-reset", "exec", code) == "77 0 [0, 0, 0]\n", "only timers that it made stop"
    mpremote(bare, "reset")
    time.sleep(0.5)
    assert mpremote(bare, "resume", "exec", code) == "-1 2 [0, 0, 0]\n"
