"""Python, the operating system, the packages that armtempo uses, and the serial ports."""

from __future__ import annotations

import os
import platform
import re
import shutil
import sys
from importlib.metadata import PackageNotFoundError, requires, version

from armtempo.basics import installation
from armtempo.diagnosis.finding import Finding, Level, error, good, note
from armtempo.ports.board_port import Port, find_ports

LEAST_PYTHON = (3, 11)
_NO_PORT = "connect a board by its USB socket, or use --port sim; a board without MicroPython: armtempo flash"
_GROUP = "sudo usermod -a -G dialout $USER, then log in again"


def examine_machine() -> list[Finding]:
    """Versions of armtempo, Python and the operating system."""
    from armtempo.basics.installation import installed_version

    python = f"{platform.python_version()} ({platform.python_implementation()})"
    fits = sys.version_info[:2] >= LEAST_PYTHON
    least = ".".join(map(str, LEAST_PYTHON))
    found = good("Python", python) if fits else error("Python", python, f"install Python {least} or newer")
    system = good("system", f"{platform.system()} {platform.release()}, {platform.machine()}")
    return [good("armtempo", installed_version()), found, _flash_tool(), system]


def _flash_tool() -> Finding:
    found = shutil.which("dfu-util") or shutil.which("st-flash")
    if found:
        return good("flash tool", found)
    return note("flash tool", "not installed", "for 'armtempo flash': install dfu-util")


def packages() -> list[Finding]:
    """Each required or optional package, with its version, or how to install it."""
    found: dict[str, Finding] = {}
    for requirement in requires("armtempo") or []:
        name = re.split(r"[^A-Za-z0-9._-]", requirement)[0]
        extra = re.search(r"extra == ['\"](\w+)['\"]", requirement)
        if extra is not None and extra[1] == "docs":  # for developers
            continue
        if not (name in found or "platform_machine" in requirement):  # which also has an extra
            found[name] = _package(name, extra[1] if extra else "")
    return [*found.values()]


def _package(name: str, extra: str) -> Finding:
    """A package of the core (``extra`` = "") or of an extra."""
    try:
        return good(name, version(name))
    except PackageNotFoundError:
        if extra:
            advice = f"{installation.command(name, extra)} if you want it"
            return note(name, "not installed", advice)
        return error(name, "missing", "pip install --force-reinstall armtempo")


def ports() -> list[Finding]:
    """The serial ports, and whether this user can open them."""
    found = [_port(port) for port in find_ports()]
    return found or [note("ports", "none", _NO_PORT)]


def _port(port: Port) -> Finding:
    what = f"{port.description or 'serial port'}{', a MicroPython board' if port.board else ''}"
    if sys.platform == "linux" and not os.access(port.device, os.R_OK | os.W_OK):
        level = Level.ERROR if port.board else Level.NOTE
        return Finding(level, port.device, f"{what}; no permission to open it", _GROUP)
    return good(port.device, what)
