"""Runs tests in a fork of a process that has imported the large packages already: a program that stands alone.

Each line of the input is a JSON list of tests. The answer: "process" and its number, "test" and each that begins,
"failed" and the first test that failed, or nothing, and "end".
"""

from __future__ import annotations

import compileall
import json
import os
import sys
import warnings
from typing import Any, TextIO

_NOTHING_WRONG = (0, 5)
"""Of pytest's exit codes: all passed, none was found."""


class InOrder:
    """A plugin: exactly these tests, in this order, and which failed first."""

    def __init__(self, tests: list[str], answers: TextIO) -> None:
        self._answers = answers
        self._place = {test: place for place, test in enumerate(tests)}
        self.failed = ""

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        """Files are collected whole. A mistake may give tests other names: then all of that function."""
        gone = set(self._place) - {item.nodeid for item in items}
        others = {test.split("[")[0]: self._place[test] for test in gone}
        place = {
            item: self._place.get(item.nodeid, others.get(item.nodeid.split("[")[0], -1)) for item in items
        }
        for item in items:
            if place[item] < 0:
                place[item] = self._place.get(item.nodeid.split("::")[0], -1)
        items[:] = sorted((item for item in items if place[item] >= 0), key=lambda item: place[item])

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """A test begins."""
        print("test", nodeid, file=self._answers, flush=True)

    def pytest_runtest_logreport(self, report: Any) -> None:
        """A test."""
        if report.failed and not self.failed:
            self.failed = report.nodeid

    def pytest_collectreport(self, report: Any) -> None:
        """A file that cannot be imported any more."""
        if report.failed and not self.failed:
            self.failed = report.nodeid


def run(tests: list[str], answers: TextIO) -> str:
    """The first that failed, or ""."""
    import pytest

    compileall.compile_dir = lambda *_arguments, **_options: True  # it was done once, for all forks

    plugin = InOrder(tests, answers)
    files = list(dict.fromkeys(test.split("::")[0] for test in tests))
    try:
        code = int(pytest.main(["-q", "-x", "-p", "no:cacheprovider", *files], plugins=[plugin]))
    except BaseException as error:  # whatever a mistake does to the process of the tests
        return plugin.failed or repr(error).replace("\n", " ")
    return plugin.failed or ("" if code in _NOTHING_WRONG else f"pytest ended with {code}")


def main() -> None:
    """Until the input ends."""
    sys.path[:1] = [os.getcwd()]  # not this file's folder
    for folder in ("host", "shared", "board", "tests"):
        compileall.compile_dir(folder, quiet=2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import click  # noqa: F401
        import pytest  # noqa: F401
        import scipy.interpolate
        import scipy.linalg
        import scipy.optimize  # noqa: F401
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    nothing = os.open(os.devnull, os.O_RDWR)
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            os.setsid()
            for descriptor in range(3):
                os.dup2(nothing, descriptor)
            print("failed", run(json.loads(line), answers), file=answers, flush=True)
            os._exit(0)
        print("process", child, file=answers, flush=True)
        os.waitpid(child, 0)
        print("end", file=answers, flush=True)


if __name__ == "__main__":
    main()
