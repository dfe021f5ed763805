"""Starts a virtual board as a process with a serial port and a temporary folder; tells the wear of its flash."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

from armtempo.basics.errors import InputError, LinkError
from armtempo.ports.names import is_sim, sim_flash
from armtempo.simulator.launch_options import LaunchOptions, ProcessOptions, describe, unique_id

INTERPRETER_VARIABLE = "ARMTEMPO_MICROPYTHON"
_CHOOSE_INTERPRETER = (
    f"set {INTERPRETER_VARIABLE} to a MicroPython that runs here, or unset it to use this Python"
)
_MOUNT_PTYS = "in a container or chroot, mount them: mount -t devpts devpts /dev/pts"
_MAIN = Path(__file__).with_name("main.py")
_HEAP = "4M"
_START_S = 60.0
_STOP_S = 1.0
PREFIX = "armtempo-virtual-"
FLASH_OF = "flash-of-"
"""Prefix of a link in it to the flash's folder, before the last part of the port's name."""
_LOCK = "lock"


class VirtualBoard:
    """A running virtual board, until ``stop`` or the end of the context.

    ``port`` can be opened like a serial device, any number of times.
    """

    def __init__(self, command: list[str], folder: TemporaryFolder, flash: Path) -> None:
        self.flash_dir = flash
        self.log_path = folder.path / "board.log"
        self._folder = folder
        master, self._slave = _pseudo_terminal()
        try:
            _set_raw(self._slave)
            os.set_blocking(master, False)
            self.port = os.ttyname(self._slave)
            (folder.path / f"{FLASH_OF}{os.path.basename(self.port)}").symlink_to(flash)
            with self.log_path.open("wb") as log:
                # in its own session: Ctrl-C in the terminal is handled by the launcher
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
            raise LinkError(
                f"the virtual board's interpreter {command[0]} does not start: {error}",
                _CHOOSE_INTERPRETER,
            ) from None
        finally:
            os.close(master)

    @property
    def pid(self) -> int:
        return self._process.pid

    def running(self) -> bool:
        return self._process.poll() is None

    def log(self) -> str:
        """The board program's stderr."""
        return self.log_path.read_text(errors="replace")

    def wait_until_up(self) -> None:
        """Wait until the board program has started; raises LinkError if the process ends before."""
        limit = time.monotonic() + _START_S
        while not (self._folder.path / "up").exists():
            if not self.running() or time.monotonic() > limit:
                tail = self.log().strip().splitlines()[-1:] or ["it says nothing"]
                raise LinkError(
                    f"the virtual board did not start: {tail[0]}",
                    "start it again; if that fails too, report it with this line",
                )
            time.sleep(0.005)

    def stop(self) -> None:
        """End the board as by a power cut; then the edge log is complete. A second call does nothing."""
        if self._slave < 0:
            return
        os.close(self._slave)
        self._slave = -1
        # it ends when its port is no longer open
        for end in (self._process.poll, self._process.terminate, self._process.kill):
            end()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_STOP_S)
                return

    def kill(self) -> None:
        self._process.kill()
        self.stop()

    def __enter__(self) -> VirtualBoard:
        return self

    def __exit__(self, *failure: object) -> None:
        self.stop()
        self._folder.remove()


def _pseudo_terminal() -> tuple[int, int]:
    """Both ends; raises LinkError if there is none, as in a container without /dev/pts."""
    import pty

    try:
        return pty.openpty()
    except OSError as error:
        raise LinkError(
            f"the virtual board gets no pseudo terminal for its serial port: {error}", _MOUNT_PTYS
        ) from None


def _set_raw(terminal: int) -> None:
    import tty  # of POSIX

    tty.setraw(terminal)


def launch(options: LaunchOptions | None = None) -> VirtualBoard:
    """Start a virtual board; use it as a context manager.

    Raises InputError if the flash's folder cannot be made, LinkError if the board does not start.
    """
    wanted = options or LaunchOptions()
    if os.name != "posix":
        raise LinkError(
            "a virtual board needs pseudo terminals, which this operating system does not have",
            "run it on Linux or macOS, or in WSL; plans and real boards work without one",
        )
    folder = TemporaryFolder()
    flash = Path(wanted.flash_dir).resolve() if wanted.flash_dir else folder.path / "flash"
    try:
        _make(flash)
        _process_options(wanted, flash, folder.path / "up").write(folder.path / "options.json")
        command = _command(wanted.interpreter, folder.path / "options.json")
        board = VirtualBoard(command, folder, flash)
    except BaseException:
        folder.remove()
        raise
    try:
        board.wait_until_up()
    except BaseException:
        board.__exit__(None, None, None)
        raise
    return board


def _process_options(wanted: LaunchOptions, flash: Path, up: Path) -> ProcessOptions:
    """The options for the process; ``up``: the file that it makes when it has started."""
    sources = program_folders()
    return ProcessOptions(
        flash=str(flash),
        sources=sources,
        program=[] if wanted.deployed else sources,
        flash_blocks=wanted.flash_blocks,
        instant_flash=wanted.instant_flash,
        speed=0.0 if wanted.virtual_time else 1.0,
        edge_log=_absolute(wanted.edge_log),
        unique_id=unique_id(wanted.seed),
        arm=describe(wanted.arm, wanted.start_deg) if wanted.arm else None,
        power_cut_at=wanted.power_cut_at,
        seed=wanted.seed,
        faults=list(wanted.faults),
        up=str(up),
        button_ms=1000 * wanted.button_s,
        sd_card=_absolute(wanted.sd_card),
        damage=wanted.damage,
        machine=wanted.machine,
    )


def _absolute(path: Path | str | None) -> str | None:
    return str(Path(path).resolve()) if path else None


def _make(flash: Path) -> None:
    try:
        flash.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{flash}: the virtual board's flash cannot be made there: {error.strerror}",
            "choose another folder",
        ) from None


def program_folders() -> list[str]:
    """The folders that hold the installed packages ``armtempo_board`` and ``armtempo_shared``."""
    import armtempo_shared

    shared = Path(armtempo_shared.__file__).resolve().parent.parent
    beside = shared.parent / "board"  # in a checkout; in site-packages both are in one folder
    board = beside if (beside / "armtempo_board").is_dir() else shared
    return [str(folder) for folder in dict.fromkeys((board, shared))]


def find_interpreter() -> str:
    """$ARMTEMPO_MICROPYTHON, ``micropython`` on PATH, or this Python."""
    return os.environ.get(INTERPRETER_VARIABLE) or shutil.which("micropython") or sys.executable


def _command(interpreter: Path | str | None, options: Path) -> list[str]:
    chosen = str(interpreter or find_interpreter())
    if os.sep in chosen:
        chosen = os.path.abspath(chosen)  # the process runs in the folder of its flash
    if chosen == sys.executable or not is_micropython(chosen):
        flags = ["-I", "-S", "-B"]
    else:
        flags = ["-X", f"heapsize={_HEAP}"]
    return [chosen, *flags, str(_MAIN), str(options)]


def is_micropython(interpreter: str) -> bool:
    """Whether the interpreter is MicroPython; raises LinkError if it does not run."""
    question = "import sys; print(sys.implementation.name)"
    try:
        command = [interpreter, "-c", question]
        answer = subprocess.run(command, capture_output=True, text=True, timeout=_START_S)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise LinkError(
            f"the virtual board's interpreter {interpreter} does not run: {error}",
            _CHOOSE_INTERPRETER,
        ) from None
    if answer.returncode:
        reason = answer.stderr.strip()
        raise LinkError(
            f"the virtual board's interpreter {interpreter} does not run: {reason}",
            _CHOOSE_INTERPRETER,
        )
    return answer.stdout.strip() == "micropython"


class TemporaryFolder:
    """A new temporary folder; it is in use while the file descriptor ``lock`` is open, also in a child process.

    Making one removes those that are no longer in use.
    """

    def __init__(self) -> None:
        import fcntl  # of POSIX, and so are virtual boards

        _sweep()
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
        unlocked = self.path / "new"
        self.lock = os.open(unlocked, os.O_CREAT | os.O_RDWR, 0o600)
        fcntl.flock(self.lock, fcntl.LOCK_EX)
        unlocked.rename(self.path / _LOCK)  # a file of this name is locked, or abandoned

    def remove(self) -> None:
        """Remove it with its contents; a second call does nothing."""
        if self.lock >= 0:
            shutil.rmtree(self.path, ignore_errors=True)
            os.close(self.lock)
            self.lock = -1


def _sweep() -> None:
    import fcntl

    for lock in Path(tempfile.gettempdir()).glob(f"{PREFIX}*/{_LOCK}"):
        try:
            descriptor = os.open(lock, os.O_RDWR)
        except OSError:  # another user's, or just removed
            continue
        with suppress(OSError):  # it is in use
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(lock.parent, ignore_errors=True)
        os.close(descriptor)


SUFFIX = ".erasures"
"""Of the file next to the flash's folder, as in ``hardware/chip/flash.py``."""


def erasures(port: str) -> dict[str, int]:
    """Erasures of each sector of the virtual board on a port; empty if nothing was erased, or it is not known."""
    flash = _flash_of(port)
    if flash is None:
        return {}
    try:
        return {str(sector): int(count) for sector, count in json.loads(_beside(flash).read_text()).items()}
    except (OSError, ValueError, AttributeError):
        return {}


def _beside(flash: Path) -> Path:
    return flash.with_name(flash.name + SUFFIX)


def _flash_of(port: str) -> Path | None:
    if is_sim(port):
        found = sim_flash(port)
        return None if found is None else found.resolve()
    name = FLASH_OF + os.path.basename(os.path.realpath(port))
    return next((link.resolve() for link in Path(tempfile.gettempdir()).glob(f"{PREFIX}*/{name}")), None)
