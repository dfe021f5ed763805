"""Starts a virtual board as a process of its own and gives it a serial port."""

from __future__ import annotations

import os
import pty
import shutil
import subprocess
import sys
import time
import tty
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from armtempo.errors import InputError, LinkError
from armtempo.model.arm import Arm
from armtempo.simulator.describe import describe
from armtempo.simulator.folder import Folder
from armtempo.simulator.options import Fault, Options, unique_id

INTERPRETER_VARIABLE = "ARMTEMPO_MICROPYTHON"
_MAIN = Path(__file__).with_name("main.py")
_HEAP = "4M"
_DEPLOYED_BLOCKS = 256
_START_S = 60.0
_STOP_S = 1.0


class VirtualBoard:
    """A running virtual board; ends with its context, or by ``stop``.

    ``port`` can be opened like a serial device, again and again, until then.
    """

    def __init__(self, command: list[str], folder: Folder, flash: Path) -> None:
        self.flash_dir = flash
        self.log_path = folder.path / "board.log"
        self._folder = folder
        master, self._slave = pty.openpty()
        try:
            tty.setraw(self._slave)
            os.set_blocking(master, False)
            self.port = os.ttyname(self._slave)
            with self.log_path.open("wb") as log:
                # in a session of its own: a Ctrl-C in the terminal is the launcher's to act on
                self._process = subprocess.Popen(
                    command,
                    stdin=master,
                    stdout=master,
                    stderr=log,
                    cwd=flash,
                    start_new_session=True,
                    pass_fds=(folder.lock,),
                )
        except OSError as error:
            os.close(self._slave)
            raise LinkError(f"the virtual board's interpreter {command[0]} does not start: {error}") from None
        finally:
            os.close(master)

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def running(self) -> bool:
        """Whether the process lives."""
        return self._process.poll() is None

    def log(self) -> str:
        """What the board program wrote to its error output."""
        return self.log_path.read_text(errors="replace")

    def wait_until_up(self) -> None:
        """Wait until the board program has started; LinkError where the process ends instead."""
        limit = time.monotonic() + _START_S
        while not (self._folder.path / "up").exists():
            if not self.running() or time.monotonic() > limit:
                tail = self.log().strip().splitlines()[-1:] or ["it says nothing"]
                raise LinkError(f"the virtual board did not start: {tail[0]}")
            time.sleep(0.005)

    def stop(self) -> None:
        """Pull the plug. The edge log is complete then. Nothing happens the second time."""
        if self._slave < 0:
            return
        os.close(self._slave)
        self._slave = -1
        # it ends by itself when the port's last user has gone
        for end in (self._process.poll, self._process.terminate, self._process.kill):
            end()
            try:
                self._process.wait(_STOP_S)
                return
            except subprocess.TimeoutExpired:
                continue

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()
        self.stop()

    def __enter__(self) -> VirtualBoard:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
        self._folder.remove()


def launch(
    flash_dir: Path | str | None = None,
    virtual_time: bool = True,
    edge_log: Path | str | None = None,
    interpreter: Path | str | None = None,
    arm: Arm | None = None,
    start_deg: Sequence[float] | None = None,
    seed: int = 0,
    faults: Sequence[Fault] = (),
    power_cut_at: int = 0,
    deployed: bool = False,
    flash_blocks: int | None = None,
    button_s: float = 0.0,
    sd_card: Path | str | None = None,
    damage: str = "",
    machine: str = Options.machine,
) -> VirtualBoard:
    """Start a virtual board; use it as a context manager.

    ``flash_dir``: the folder that is its flash and lasts; None: a new one that goes with the board.
    ``virtual_time``: motions run as fast as they can; else in real time. ``edge_log``: file for every pin
    edge. ``interpreter``: MicroPython or CPython; None: $ARMTEMPO_MICROPYTHON, ``micropython`` on PATH, or
    this Python. ``arm``: gets motors with its ``model``; None: ideal motors for whatever arm the board is set
    up for. ``start_deg`` (J,): where the arm stands at power-up, else at home. ``deployed``: run the program
    in the flash (``armtempo deploy`` puts it there) instead of the installed one. ``flash_blocks``: size of
    the flash; None: the chip's, and with ``deployed`` more, as compiled files for this machine's processor
    are larger than for the chip's. ``button_s``: how long the user button is held from power-up on: safe mode
    from 0.6 to 1.2, a fresh file system from 1.2 to 1.8. ``sd_card``: folder that is an SD card in the board.
    ``damage``: ``"no file system"`` or ``"unreadable"``, what has befallen the flash. ``machine``: what the
    firmware was built for. Raises InputError where ``flash_dir`` cannot be made, LinkError where the board does
    not start.
    """
    folder = Folder()
    flash = Path(flash_dir).resolve() if flash_dir else folder.path / "flash"
    try:
        _make(flash)
        options = Options(
            flash=str(flash),
            sources=program_folders(),
            program=[] if deployed else program_folders(),
            flash_blocks=flash_blocks or (_DEPLOYED_BLOCKS if deployed else Options.flash_blocks),
            speed=0.0 if virtual_time else 1.0,
            edge_log=str(Path(edge_log).resolve()) if edge_log else None,
            unique_id=unique_id(seed),
            arm=describe(arm, start_deg) if arm else None,
            power_cut_at=power_cut_at,
            seed=seed,
            faults=list(faults),
            up=str(folder.path / "up"),
            button_ms=1000 * button_s,
            sd_card=str(Path(sd_card).resolve()) if sd_card else None,
            damage=damage,
            machine=machine,
        )
        options.write(folder.path / "options.json")
        board = VirtualBoard(_command(interpreter, folder.path / "options.json"), folder, flash)
    except BaseException:
        folder.remove()
        raise
    try:
        board.wait_until_up()
    except BaseException:
        board.__exit__(None, None, None)
        raise
    return board


def _make(flash: Path) -> None:
    try:
        flash.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{flash}: the virtual board's flash cannot be made there: {error.strerror}"
        ) from None


def program_folders() -> list[str]:
    """The folders that hold the installed packages ``armtempo_board`` and ``armtempo_shared``."""
    import armtempo_shared

    shared = Path(armtempo_shared.__file__).resolve().parent.parent
    beside = shared.parent / "board"  # in a checkout; in site-packages all stand together
    board = beside if (beside / "armtempo_board").is_dir() else shared
    return [str(folder) for folder in dict.fromkeys((board, shared))]


def find_interpreter() -> str:
    """$ARMTEMPO_MICROPYTHON, ``micropython`` on PATH, or this Python."""
    return os.environ.get(INTERPRETER_VARIABLE) or shutil.which("micropython") or sys.executable


def _command(interpreter: Path | str | None, options: Path) -> list[str]:
    chosen = str(interpreter or find_interpreter())
    if os.sep in chosen:
        chosen = os.path.abspath(chosen)  # the process starts in the folder of its flash
    if chosen == sys.executable or not is_micropython(chosen):
        flags = ["-I", "-S", "-B"]
    else:
        flags = ["-X", f"heapsize={_HEAP}"]
    return [chosen, *flags, str(_MAIN), str(options)]


def is_micropython(interpreter: str) -> bool:
    """Whether the interpreter is MicroPython; LinkError where it does not run."""
    question = "import sys; print(sys.implementation.name)"
    try:
        command = [interpreter, "-c", question]
        answer = subprocess.run(command, capture_output=True, text=True, timeout=_START_S)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise LinkError(f"the virtual board's interpreter {interpreter} does not run: {error}") from None
    if answer.returncode:
        reason = answer.stderr.strip()
        raise LinkError(f"the virtual board's interpreter {interpreter} does not run: {reason}")
    return answer.stdout.strip() == "micropython"
