"""Which lines of the project each test executes: a plugin for pytest, and for the Python programs that tests start.

A line is asked about only until it is known, and a function only for its first calls in a test; what it calls is seen
all the same. Needs nothing but Python, so that it may be imported before everything else.
"""

from __future__ import annotations

import atexit
import json
import os
import sys
import threading
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

FOLDER = "MUTATION_LINES"
"""Environment variable: where the lines go, a file for each process; they are only added to, for some are killed."""
ROOT = str(Path(__file__).resolve().parents[2])
_AREAS = tuple(
    f"{ROOT}/{name}/" for name in ("host/armtempo", "shared/armtempo_shared", "board/armtempo_board")
)
_CALLS = 60
_LINES = 4000


class Tracer:
    """Lines by test; what a file's fixtures and imports execute is kept under the file's name."""

    def __init__(self) -> None:
        name = f"{os.getpid()}-{os.urandom(4).hex()}.lines"
        self._file = os.open(os.path.join(os.environ[FOLDER], name), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        self._calls: dict[CodeType, int] = {}
        self._left: dict[CodeType, int] = {}
        self._found: dict[CodeType, set[int]] = {}
        self.at_once = False

    def begin(self, name: str) -> None:
        """From here on it is this test."""
        self.write()
        self._calls.clear()
        self._left.clear()
        self.put({"test": name})

    def put(self, value: dict[str, Any]) -> None:
        """A line of JSON."""
        os.write(self._file, json.dumps(value).encode() + b"\n")

    def install(self) -> None:
        """In all threads, until the process ends."""
        atexit.register(sys.settrace, None)
        threading.settrace(self._call)
        sys.settrace(self._call)

    def _call(self, frame: FrameType, event: str, _argument: Any) -> Any:
        code = frame.f_code
        calls = self._calls.get(code, 0)
        if calls >= _CALLS:
            return None
        if not code.co_filename.startswith(_AREAS):
            self._calls[code] = _CALLS
            return None
        self._calls[code] = calls + 1
        self._line(frame, event, None)
        return self._line

    def _line(self, frame: FrameType, _event: str, _argument: Any) -> Any:
        code = frame.f_code
        found = self._found.get(code)
        if found is None:
            found = self._found[code] = set()
        if frame.f_lineno not in found:
            found.add(frame.f_lineno)
            if self.at_once:
                self.write()
        left = self._left[code] = self._left.get(code, _LINES) - 1
        if left < 0:
            frame.f_trace_lines = False
        return self._line

    def write(self) -> None:
        """What was found since the last time."""
        for code, lines in list(self._found.items()):
            self.put({"path": code.co_filename[len(ROOT) + 1 :], "lines": sorted(lines)})
        self._found.clear()


def of_current_test() -> str:
    """The test whose process started this one; its file where a fixture did."""
    name, _, phase = os.environ.get("PYTEST_CURRENT_TEST", "").rpartition(" ")
    return name if phase == "(call)" else name.split("::")[0]


def start_in_program() -> None:
    """For a Python program that a test starts: ``sitecustomize`` calls it."""
    tracer = Tracer()
    tracer.at_once = True
    tracer.begin(of_current_test())
    tracer.install()


def _trace_programs() -> None:
    """Python programs that are started from here on find the ``sitecustomize`` of the folder."""
    import subprocess

    started = subprocess.Popen.__init__

    def init(self: Any, *arguments: Any, **options: Any) -> None:
        environment = dict(os.environ if options.get("env") is None else options["env"])
        path = environment.get("PYTHONPATH", "")
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, (os.environ[FOLDER], path)))
        options["env"] = environment
        started(self, *arguments, **options)

    subprocess.Popen.__init__ = init  # type: ignore[method-assign]


class Plugin:
    """Tells the tracer which test it is."""

    def __init__(self) -> None:
        self._tracer = Tracer()
        self._tracer.begin("")
        self._tracer.install()

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Fixtures belong to the file: the next test may find them made."""
        self._tracer.begin(nodeid.split("::")[0])

    def pytest_runtest_call(self, item: Any) -> None:
        """The test itself."""
        self._tracer.begin(item.nodeid)
        self._tracer.install()

    def pytest_runtest_teardown(self, item: Any) -> None:
        """What clears up after it."""
        self._tracer.begin(item.nodeid.split("::")[0])

    def pytest_runtest_logreport(self, report: Any) -> None:
        """How long each part of a test takes."""
        if not report.failed:
            self._tracer.put({"seconds": report.duration, "of": report.nodeid})

    def pytest_unconfigure(self) -> None:
        """The rest."""
        self._tracer.write()


def pytest_configure(config: Any) -> None:
    """Programs that tests start find the tracer."""
    customise = f"import sys\nsys.path.append({ROOT + '/tests/mutation'!r})\nimport tracer\ntracer.start_in_program()\n"
    (Path(os.environ[FOLDER]) / "sitecustomize.py").write_text(customise)
    _trace_programs()
    config.pluginmanager.register(Plugin())
