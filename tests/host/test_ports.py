"""Serial ports: which there are, what cannot be opened, what else may answer on one; systems without POSIX."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import armtempo
import pytest
from armtempo import deploy
from armtempo.basics.errors import InputError, LinkError, PortError, PortInUseError
from armtempo.cli import main
from armtempo.link import connect, transport
from armtempo.link.transport import SerialTransport
from armtempo.ports import board_port, names
from armtempo.ports import claim as claims
from armtempo.ports.board_port import find_ports
from armtempo.simulator import launch
from click.testing import CliRunner


class Silent:
    """A port on which ``answer`` comes after the first byte is sent."""

    name = "there"

    def __init__(self, answer: bytes = b"") -> None:
        self.answer = answer

    def read(self, timeout_s: float) -> bytes:
        data, self.answer = self.answer, b""
        return data

    def write(self, data: bytes) -> None: ...

    def wake(self) -> None: ...

    def close(self) -> None: ...


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (b"", "does not answer within 2 s"),
        (
            b'\r\n>>> \r\nMicroPython v1.29.0 on 2026-01-01; STM32F4DISC\r\nType "help()"\r\n>>> ',
            "armtempo deploy",
        ),
        (b"raw REPL; CTRL-B to exit\r\n>", "armtempo deploy"),
        (b"$GPGGA,1234,N*5B\r\n", "something other"),
        (b"\xa5\x10", "check cable"),
        (b"\x5d\x00\x01~\x01\x01\x003.4.0; MicroPython v1.29.0", "check cable"),
    ],
)
def test_what_else_sits_on_a_port(answer: bytes, words: str) -> None:
    assert words in str(connect.explain(Silent(answer), b""))


class Prompt(Silent):
    """MicroPython's prompt, as mpremote leaves it; it says that the program is in the flash."""

    def write(self, data: bytes) -> None:
        echo = data + b"\n"
        self.answer = echo + (b"armtempo is here\r\n>>> " if data.startswith(b"print(") else b">>> ")


def test_a_program_that_mpremote_has_ended_needs_a_reset_only() -> None:
    said = str(connect.explain(Prompt(), b""))
    assert "mpremote connect there reset" in said
    assert "reset button" in said


class Interrupted(Silent):
    """The prompt of a board to which a deployment was interrupted: parts of the program are in its library's folder."""

    def write(self, data: bytes) -> None:
        found = b"armtempo in parts\r\n" if b"listdir('/flash/lib')" in data else b""
        self.answer = data + b"\n" + found + b">>> "


def test_an_interrupted_deployment_is_completed_by_deploying() -> None:
    error = connect.explain(Interrupted(), b"")
    assert "its deployment was interrupted" in str(error)
    assert error.hint == "'armtempo deploy' completes it"


def test_port_that_does_not_exist() -> None:
    with pytest.raises(InputError, match="there is no port /dev/nowhere"):
        SerialTransport("/dev/nowhere")
    with pytest.raises(InputError, match="not a port or URL"):
        SerialTransport("nonsense://x")


def test_port_in_use(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "PATIENCE_S", 0.1)  # in use for longer than that
    master, slave = os.openpty()
    try:
        first = SerialTransport(os.ttyname(slave))
        with pytest.raises(LinkError, match=r"in use by another program.*close it"):
            SerialTransport(os.ttyname(slave))
        with pytest.raises(LinkError, match="in use by another program"):  # mpremote is not asked
            deploy.deploy(os.ttyname(slave), print, lambda *_: None)
        first.close()
        SerialTransport(os.ttyname(slave)).close()
    finally:
        os.close(master)
        os.close(slave)


def test_found_ports_put_boards_first() -> None:
    found = board_port.find_ports()
    assert [port.board for port in found] == sorted([port.board for port in found], reverse=True)


def test_what_is_no_serial_port_is_said_to_be_none(tmp_path: Path) -> None:
    for path in (tmp_path, Path("/dev/null"), tmp_path / "file"):
        if path.name == "file":
            path.write_text("")
        with pytest.raises(InputError, match=f"{path} is not a serial port"):
            SerialTransport(str(path))
    with pytest.raises(InputError, match="has no folder"):
        names.sim_flash("sim:")


def test_ports_as_json() -> None:
    found = CliRunner().invoke(main, ["ports", "--json"])
    assert found.exit_code == 0
    ports = json.loads(found.stdout)["ports"]
    assert [one["port"] for one in ports] == [port.device for port in find_ports()]


@pytest.mark.parametrize(("platform", "kind"), [("win32", PortInUseError), ("linux", PortError)])
def test_no_permission_is_a_port_in_use_on_windows(
    platform: str, kind: type[PortError], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.platform", platform)
    denied = PermissionError(errno.EACCES, "Access is denied.")
    assert type(transport._open_error("COM5", denied)) is kind


# where an operating system has not what POSIX has: every module can be imported, ports are called COM5


POSIX_ONLY = ("termios", "fcntl", "pty", "tty", "pwd", "grp", "resource", "curses", "syslog", "posix")
WITHOUT = f"""
import sys, os, select, signal, socket, pkgutil, importlib
# What the standard library and other packages have is imported before: it is of POSIX here, as it must be.
import armtempo, click, numpy, scipy.optimize, scipy.linalg, scipy.sparse.linalg, matplotlib.figure, serial
import nicegui, fastapi, uvicorn
import serial.tools.list_ports, multiprocessing, concurrent.futures.process, subprocess, tempfile, logging, mpremote
for name in {POSIX_ONLY}:
    sys.modules[name] = None
for module, words in ((select, "poll epoll"), (signal, "SIGHUP SIGKILL SIGUSR1"), (socket, "AF_UNIX"),
                      (os, "fork getuid geteuid openpty mkfifo uname setsid killpg")):
    for word in words.split():
        if hasattr(module, word):
            delattr(module, word)
failed = []
for found in pkgutil.walk_packages(armtempo.__path__, "armtempo."):
    if ".simulator.hardware" in found.name or found.name.endswith((".simulator.main", ".firmware.manifest")):
        continue  # run by a MicroPython, or by a Python in its place
    if found.name == "armtempo.__main__":
        continue
    try:
        importlib.import_module(found.name)
    except Exception as error:
        failed.append(f"{{found.name}}: {{error!r}}")
print("\\n".join(failed))
"""


@pytest.mark.long
def test_every_module_is_imported_without_what_only_posix_has() -> None:
    done = subprocess.run([sys.executable, "-c", WITHOUT], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == ""


def test_a_port_of_windows_is_the_same_in_any_spelling(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("armtempo.ports.names.os.name", "nt")
    assert names.same_for_all("com5") == names.same_for_all("COM5") == "COM5"
    assert not names.is_sim("COM5")


def test_a_virtual_board_says_where_it_can_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("armtempo.simulator.launcher.os.name", "java")
    with pytest.raises(LinkError, match="pseudo terminals") as caught:
        launch()
    assert "WSL" in caught.value.hint


def test_no_module_of_the_host_names_a_device_of_one_system_only() -> None:
    """Words for people may; what is opened comes from the user or from pyserial."""
    for path in Path(armtempo.__file__).parent.rglob("*.py"):
        assert 'open("/dev/' not in path.read_text(encoding="utf-8"), path
