"""Run a script of board code under CPython and under the MicroPython interpreters of .cache/micropython."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
VIRTUAL = ROOT / "host" / "armtempo" / "simulator"
_CACHE = ROOT / ".cache" / "micropython"
_STARTERS = {
    "cpython": Path(sys.executable),
    "micropython": _CACHE / "micropython",
    "micropython-arm": _CACHE / "micropython-arm",
}
AVAILABLE = [name for name, starter in _STARTERS.items() if starter.exists()]
MISSING = [name for name in _STARTERS if name not in AVAILABLE]
EACH = [pytest.param(name, marks=[pytest.mark.long] * (name == "micropython-arm")) for name in AVAILABLE]
"""For a test of each interpreter; long in the emulator."""
_BOARD_PATH = [ROOT / "shared", ROOT / "board", VIRTUAL / "hardware"]
_RIGS = [ROOT / "tests" / folder for folder in ("rigs", "board/scripts/rigs", "system/scripts/rigs")]


def starter(name: str) -> str:
    """Path of the program that starts the interpreter."""
    return str(_STARTERS[name])


def environment(name: str) -> dict[str, str]:
    """Environment in which scripts of board code find its packages, the simulated hardware and the tests' rigs."""
    path = [*_BOARD_PATH, *_RIGS]
    if name == "cpython":
        path.append(VIRTUAL / "cpython")
    variable = "PYTHONPATH" if name == "cpython" else "MICROPYPATH"
    value = os.pathsep.join(str(folder) for folder in path)
    if name != "cpython":
        value += os.pathsep + ".frozen"
    return {**os.environ, variable: value, "PYTHONDONTWRITEBYTECODE": "1"}


def run(name: str, script: Path | str, *arguments: str, timeout: float = 1200.0, heap: str = "") -> str:
    """What the script prints; AssertionError with its error output if it fails.

    ``timeout``: seconds, generous for a busy machine.
    ``heap``: heap size for MicroPython, as its ``-X heapsize=`` takes it.
    """
    command = [starter(name)]
    if heap and name != "cpython":
        command += ["-X", f"heapsize={heap}"]
    command += [str(script), *arguments]
    done = subprocess.run(command, env=environment(name), capture_output=True, text=True, timeout=timeout)
    assert done.returncode == 0, (
        f"{name} {script} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}"
    )
    return done.stdout


def environment_of_others() -> dict[str, str]:
    """For a program that is not ours, such as pip: its deprecation warnings are no errors there."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONWARNINGS"}


if __name__ == "__main__":  # python -m tests.interpreters NAME SCRIPT [ARGUMENTS]
    print(run(*sys.argv[1:]), end="")
