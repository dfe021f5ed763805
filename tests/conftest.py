"""Fixtures for all tests: the interpreters, and what had to be left out."""

from __future__ import annotations

import compileall
import gc
import os
import shutil
import signal
import tempfile
from collections import Counter
from collections.abc import Generator, Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests import interpreters

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # Started in the background: the commands that the tests start would inherit it and not mind Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)

NEEDS = {
    "board/test_cortex_m4.py": "unicorn",
    "host/test_site.py": "docutils",
    "host/panel": "nicegui",
    "host/test_recordings.py": "rosbags",
    "host/urdf": "trimesh",
    "system/panel": "nicegui",
}
"""What test modules, or all of a folder, import that armtempo itself does without: an extra, or a tool of the tests."""
_NONE = (pytest.param(0, marks=pytest.mark.skip("takes long: only with --cases")),)
DEPRECATIONS = ("DeprecationWarning", "PendingDeprecationWarning", "FutureWarning")
"""Errors in the commands that tests start, too; in the tests' own process every warning is one."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Random tests with other cases than every day's, and what only a release needs."""
    parser.addoption("--long", action="store_true", help="the tests marked long, too")
    parser.addoption("--brief", action="store_true", help="what another Python beside it may do otherwise")
    parser.addoption("--cases", type=int, metavar="N", help="N random cases for each test that has seeds")
    parser.addoption("--first", type=int, default=0, metavar="SEED", help="the first of them, default 0")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Give a test marked ``seeds`` a ``seed``: those of the mark, or those of --cases."""
    if mark := metafunc.definition.get_closest_marker("seeds"):
        first, count = metafunc.config.getoption("first"), metafunc.config.getoption("cases")
        metafunc.parametrize("seed", range(first, first + count) if count else mark.args or _NONE)


@pytest.fixture(scope="session", autouse=True)
def own_settings() -> Iterator[None]:
    """No setting of the user's reaches a test, and no port that a test opens is known outside of it."""
    for name in [
        name for name in os.environ if name.startswith("ARMTEMPO_") and name != "ARMTEMPO_MICROPYTHON"
    ]:
        del os.environ[name]
    folder = tempfile.mkdtemp(prefix="run-")  # short: the path of a socket has 100 bytes
    os.environ["XDG_RUNTIME_DIR"] = folder
    os.environ["XDG_CACHE_HOME"] = str(interpreters.ROOT / ".cache")
    os.environ["COLUMNS"] = "1000"  # no sentence that a test looks for is wrapped
    os.environ["PYTHONWARNINGS"] = ",".join(f"error::{name}" for name in DEPRECATIONS)
    yield
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(params=interpreters.EACH)
def interpreter(request: pytest.FixtureRequest) -> str:
    """Each interpreter that is here, by name; for ``interpreters.run``."""
    return str(request.param)


def pytest_xdist_auto_num_workers() -> int:
    """Two more than there are cores: a test that waits for its board leaves its core to another."""
    return (os.cpu_count() or 1) + 2


class LeftOut(pytest.Module):
    """A test module that cannot be imported here."""

    def collect(self) -> Iterator[pytest.Item | pytest.Collector]:
        """Skip it, with the reason."""
        needed = _missing(self.path)
        pytest.skip(f"needs {needed}: 'make test' installs it", allow_module_level=True)


def _missing(path: Path) -> str:
    """The package that a test module lacks; "" if it has all, or if nothing may be left out."""
    module = path.relative_to(Path(__file__).parent)
    needed = NEEDS.get(module.as_posix(), "") or NEEDS.get(module.parent.as_posix(), "")
    return needed if needed and not os.environ.get("CI") and find_spec(needed) is None else ""


def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module | None:
    """Collect all that can be, without the extras too."""
    return LeftOut.from_parent(parent, path=module_path) if _missing(module_path) else None


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Hardly anything that is imported and collected is garbage, and looking for it takes a tenth of the time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """All of ``system/`` is slow. Several workers begin with what takes long, so that they end together."""
    kept = [item for item in items if config.getoption("long") or not item.get_closest_marker("long")]
    if config.getoption("brief"):
        kept = _brief(kept)
    config.hook.pytest_deselected(items=list(set(items).difference(kept)))
    items[:] = kept
    for item in items:
        if item.path.is_relative_to(interpreters.ROOT / "tests" / "system"):
            item.add_marker(pytest.mark.slow)
    if hasattr(config, "workerinput"):  # of pytest-xdist
        items.sort(key=lambda item: item.get_closest_marker("slow") is None)


def _brief(items: list[pytest.Item]) -> list[pytest.Item]:
    """Two variants of each quick test; none in MicroPython, nor of what sources say, the same with any Python."""
    kept, seen = [], Counter[str]()
    for item in items:
        name, _, variant = item.nodeid.partition("[")
        group = item.get_closest_marker("xdist_group")
        is_slow = item.get_closest_marker("slow") or variant.startswith("micropython")
        if not is_slow and (group is None or group.args != ("sources",)):
            seen[name] += 1
            if seen[name] <= 2:
                kept.append(item)
    return kept


def pytest_collection_finish() -> None:
    """What was imported and collected stays: looked through with all else, it takes a tenth of the tests' time."""
    gc.collect()
    gc.freeze()


def _compile_sources() -> None:
    """Once for all: virtual boards and scripts that the tests start write no byte code, and would compile each time."""
    for name in ("board", "shared", "host/armtempo", "tests"):
        compileall.compile_dir(interpreters.ROOT / name, quiet=2, workers=0)


def pytest_sessionstart(session: pytest.Session) -> None:
    """In CI nothing may be left out."""
    if not hasattr(session.config, "workerinput"):
        writer = session.config.get_terminal_writer()
        writer.fullwidth = writer.fullwidth  # as it is before ``own_settings`` sets COLUMNS
        _compile_sources()
    if interpreters.MISSING and os.environ.get("CI"):
        pytest.exit(f"CI needs the interpreters {', '.join(interpreters.MISSING)}", returncode=1)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say at the end what was not run here, and what CI ran with other Pythons."""
    if pythons := os.environ.get("PYTHONS"):
        terminalreporter.section("other Pythons and releases")
        terminalreporter.write_line(pythons)
    for name in interpreters.MISSING:
        terminalreporter.write_line(
            f"left out: all tests under {name}, which is not on this machine", red=True
        )
