"""Ctrl-C while the command is still being imported: quiet, with exit code 130, as at any later time."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import pytest
from armtempo.cli import raised_by_signals

from tests.interpreters import ROOT

pytestmark = pytest.mark.xdist_group("start")  # what they share is made once

COMMAND = (sys.executable, "-X", "importtime", "-c", "from armtempo.__main__ import main; main()", "plan")
SHORT = ("--iterations", "1", "--population", "4")
ENDLESS = ("--iterations", "1000000")
SAID = "no arm and no job given; using the shipped feeding job and arm\n"
MOMENTS = 8
SEED = 20266


class Watched:
    """The command with ``options``, run to its end; ``at(process)`` is called when it has imported ``after`` modules.

    They are counted from the one that follows ``armtempo.__main__``: only then the command surely minds the signal.
    """

    def __init__(
        self,
        folder: Path,
        options: tuple[str, ...],
        after: int = 0,
        at: Callable[[subprocess.Popen[str]], None] = lambda process: None,
        prepare: Callable[[], object] | None = None,
    ) -> None:
        self.first: list[str] = []
        self.imported: list[str] = []
        self.errors = ""
        with subprocess.Popen(
            [*COMMAND, *options],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=prepare,
        ) as process:
            assert process.stderr is not None
            for line in process.stderr:
                if not line.startswith("import time:"):
                    self.errors += line
                    continue
                begun = "armtempo.__main__" in self.first
                (self.imported if begun else self.first).append(line.rsplit("|", 1)[1].strip())
                if begun and len(self.imported) == after:
                    at(process)
        self.exit_code = process.returncode


def interrupt(process: subprocess.Popen[str]) -> None:
    """Ctrl-C."""
    process.send_signal(signal.SIGINT)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Watched:
    """A run that nobody interrupts."""
    run = Watched(tmp_path_factory.mktemp("whole"), SHORT)
    assert run.exit_code == 0, run.errors
    return run


def test_the_installed_command_begins_there() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["scripts"] == {"armtempo": "armtempo.__main__:main"}


def test_little_is_imported_before_an_interrupt_is_minded(whole: Watched) -> None:
    ours = [name for name in whole.first if name.startswith("armtempo")]
    basics = ["armtempo.basics", "armtempo.basics.installation", "armtempo.basics.errors"]
    assert ours == ["armtempo", *basics, "armtempo.__main__"]
    assert {"click", "numpy", "armtempo.planning.planner"} <= set(whole.imported)


@pytest.mark.parametrize("number", range(MOMENTS))
def test_an_interrupt_during_the_imports_ends_it_quietly(number: int, whole: Watched, tmp_path: Path) -> None:
    most = whole.imported.index("armtempo.planning.planner")  # what comes after it, comes after the search
    after = 1 + int((number + random.Random(SEED + number).random()) / MOMENTS * most)
    run = Watched(tmp_path, ENDLESS, after, interrupt)
    what = f"seed {SEED}, after {whole.imported[after - 1]}, module {after}"
    assert run.exit_code == 130, f"{what}: {run.errors}"
    assert run.errors.removeprefix(SAID) == "armtempo: interrupted\n", what
    assert not list(tmp_path.iterdir()), what


def test_in_the_background_ctrl_c_stays_ignored(whole: Watched, tmp_path: Path) -> None:
    for after in (len(whole.imported) // 10, len(whole.imported) // 2):
        run = Watched(tmp_path, SHORT, after, interrupt, lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
        assert run.exit_code == 0, run.errors


def test_an_interrupt_waits_for_the_end_of_an_import(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is imported here would swallow it; what comes then would take a minute."""
    (tmp_path / "swallowing.py").write_text(
        "import signal, time\n"
        "swallowed = False\n"
        "try:\n"
        "    signal.raise_signal(signal.SIGINT)\n"
        "    time.sleep(0.1)\n"
        "except BaseException:\n"
        "    swallowed = True\n"
    )
    monkeypatch.syspath_prepend(tmp_path)

    def import_and_sleep() -> None:
        assert not import_module("swallowing").swallowed
        time.sleep(1200.0)

    handler = signal.getsignal(signal.SIGINT)
    begin_s = time.monotonic()
    with pytest.raises(KeyboardInterrupt), raised_by_signals():
        import_and_sleep()
    assert time.monotonic() - begin_s < 600.0
    assert signal.getsignal(signal.SIGINT) == handler
