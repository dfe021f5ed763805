"""The virtual board as a process: its start as the firmware's, its port, flash and end, and its prompt."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import serial
from armtempo.basics.errors import LinkError, RunFolderError
from armtempo.cli.virtual_board import virtual_board
from armtempo.link.connect import open_board
from armtempo.simulator import LaunchOptions, VirtualBoard, edgelog, launch, launcher
from armtempo.simulator.launcher import PREFIX, TemporaryFolder

from tests import interpreters, scripted
from tests.system import commandline
from tests.system.commandline import wait_for
from tests.system.conftest import FASTEST

CASES = Path(__file__).parent / "scripts" / "cases"


def test_answers_on_its_port_again_and_again(interpreter: str) -> None:
    with launch(LaunchOptions(interpreter=interpreters.starter(interpreter))) as board:
        for _ in range(2):
            with open_board(board.port) as link:
                assert link.status().state == "unconfigured"
        assert not board.log()
    assert not board.running()


def test_two_at_a_time_are_told_apart() -> None:
    with (
        launch(LaunchOptions(seed=1)) as one,
        launch(LaunchOptions(seed=2)) as two,
        open_board(one.port) as first,
        open_board(two.port) as second,
    ):
        assert first.info
        assert second.info
        assert first.info.board_id != second.info.board_id


def test_flash_lasts(tmp_path: Path) -> None:
    boots = set()
    for _ in range(2):
        with launch(LaunchOptions(tmp_path / "flash")) as board, open_board(board.port) as link:
            assert link.info
            boots.add(link.info.boot)
    assert (tmp_path / "flash" / "armtempo").is_dir()
    assert len(boots) == 2


def test_goes_with_its_context() -> None:
    with launch() as board:
        folder = board.log_path.parent
        assert folder.is_dir()
        assert os.getsid(board.pid) == board.pid, "Ctrl-C at the terminal is not for it"
    assert not board.running()
    assert board._process.returncode == 0, "it ends by itself where nobody has its port open"
    assert not folder.exists()
    board.stop()


def test_a_board_that_ends_before_its_program_runs_did_not_start() -> None:
    with launch() as board:
        board._process.kill()
        board._process.wait()
        (board._folder.path / "up").unlink()
        with pytest.raises(LinkError, match="the virtual board did not start"):
            board.wait_until_up()


def test_a_motion_that_is_not_in_the_edge_log_is_told() -> None:
    cycle = edgelog.PowerCycle(starts=[100, 200])
    for number in (-3, 2):
        with pytest.raises(RunFolderError, match=f"has 2 motions, not one number {number}"):
            cycle.motion(number)


def test_a_motions_edges_are_those_behind_the_stop_of_the_clock_before_it() -> None:
    """However soon it follows; the first one's begin 0.1 s before its time 0."""
    second = 100_000_000
    ticks = np.array([9_000_000, 19_000_000, second - 1_000_000, second - 400_000, second + 50])
    edges = {"A15": (ticks, np.array([1, 0, 1, 0, 1]))}
    cycle = edgelog.PowerCycle(edges, [18_000_000, second], ends=[1_000, second - 500_000, second + 100])
    assert list(cycle.motion(0)["A15"][0] + 18_000_000) == [19_000_000, second - 1_000_000]
    assert list(cycle.motion(1)["A15"][0]) == [-400_000, 50]


def test_goes_with_its_launcher(tmp_path: Path) -> None:
    """A launcher that is killed leaves no process."""
    script = (
        "import time\nfrom armtempo.simulator import launch\n"
        "board = launch()\nprint(board.pid, flush=True)\ntime.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout
        pid = int(parent.stdout.readline())
        parent.kill()
    commandline.wait_for(lambda: not _alive(pid), "the end of the board's process")


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_no_interpreter(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(launcher.INTERPRETER_VARIABLE, "/no/such/micropython")
    with pytest.raises(LinkError, match="/no/such/micropython does not run"), launch():
        pass


def test_something_else_than_an_interpreter() -> None:
    with pytest.raises(LinkError, match="does not run"), launch(LaunchOptions(interpreter="/bin/false")):
        pass


def test_a_program_that_fails_is_logged(tmp_path: Path) -> None:
    (tmp_path / "main.py").write_text("raise ValueError('broken')\n")
    with launch(LaunchOptions(tmp_path, deployed=True)) as board:
        commandline.wait_for(lambda: "ValueError: broken" in board.log(), "the traceback in the log")
        assert board.running()


def test_command_prints_the_port_and_ends_with_ctrl_c(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-c",
        "from armtempo.cli import main; main()",
        "virtual-board",
        "--flash",
        str(tmp_path / "a b"),
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout
        port = process.stdout.readline().strip()
        with open_board(port) as link:
            assert link.status().state == "unconfigured"
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=commandline.SLOW_S)
    assert process.returncode == 130
    # That its port is gone cannot be told: another program may have the number now
    assert "Traceback" not in error


# the simulated hardware behaves like the chip's, on every interpreter


SCRIPTS = tuple(CASES / f"virtual_{name}.py" for name in ("hardware", "time", "memory"))


@scripted.each(scripted.together(scripted.cases(*SCRIPTS)))
def test_case(case: scripted.Case, tmp_path: Path) -> None:
    (tmp_path / "flash").mkdir()
    case.run(str(tmp_path), heap="")


@pytest.fixture(params=interpreters.EACH[1:])
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


# how the virtual board starts, as the firmware does: button, boot.py, SD card, file system, and its folder


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
    return interpreters.starter(FASTEST)


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
