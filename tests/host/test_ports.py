"""Serial ports: which there are, what cannot be opened, what else may answer on one."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path

import pytest
from armtempo import deploy
from armtempo.basics.errors import InputError, LinkError, PortError, PortInUseError
from armtempo.cli import main
from armtempo.deploy import program_files
from armtempo.link import connect, transport
from armtempo.link.transport import SerialTransport
from armtempo.ports import board_port, names
from armtempo.ports import claim as claims
from armtempo.ports.board_port import find_ports
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


def test_compiled_files_for_a_virtual_board_under_cpython() -> None:
    with pytest.raises(LinkError, match="CPython, or a MicroPython built without them; deploy without --mpy"):
        program_files._compiler(0)


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
        with pytest.raises(LinkError, match="in use by another program"):
            SerialTransport(os.ttyname(slave))
        with pytest.raises(LinkError, match="in use by another program"):  # mpremote is not asked
            deploy.deploy(os.ttyname(slave), False, print, lambda *_: None)
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
