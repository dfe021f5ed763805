"""Where an operating system has not what POSIX has: every module can be imported, ports are called COM5."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import armtempo
import pytest
from armtempo.basics.errors import LinkError
from armtempo.ports import names
from armtempo.simulator import launch

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


@pytest.mark.slow
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
