"""Every example of README and host/docs does what it says: Python blocks, and commands on a virtual board.

The commands of host/docs/recovery.md are tried by ``test_recovery``, each on a board that has the trouble.
"""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from armtempo.model import shipped
from armtempo.simulator import LaunchOptions, launch

from tests import interpreters
from tests.interpreters import ROOT
from tests.system import commandline
from tests.system.boards import small_plan
from tests.system.conftest import FASTEST

PAGES = (ROOT / "README.md", *sorted((ROOT / "host" / "docs").glob("*.md")))
PORT = "/dev/ttyACM0"
COMMANDS = ("README.md", "cli.md")
ONCE = ((r"repeat=\d+", "repeat=1"), (r"--repeat \d+", "--repeat 1"))
"""Repetitions take time and show nothing new here."""


def text_of(page: Path) -> str:
    """A page whose examples run their motions once."""
    text = page.read_text(encoding="utf-8")
    for many, once in ONCE:
        text = re.sub(many, once, text)
    return text


def python_blocks() -> list[tuple[str, str]]:
    """(page and number, code) of each Python block."""
    return [
        (f"{page.name}-{number}", code)
        for page in PAGES
        for number, code in enumerate(
            re.findall(r"^```python\n(.*?)^```", text_of(page), re.DOTALL | re.MULTILINE),
            1,
        )
    ]


def command_lines(page: Path) -> list[list[list[str]]]:
    """The commands of each block of a page, indented or fenced, as words; ``export`` and ``cd`` too."""
    blocks: list[list[list[str]]] = [[]]
    for line in text_of(page).splitlines():
        if line.strip().startswith(("armtempo ", "export ", "cd ")) and not line.startswith("|"):
            blocks[-1].append(shlex.split(line, comments=True))
        elif not line.strip() or line.startswith("```"):
            blocks.append([])
    return [block for block in blocks if block]


BLOCKS = [(page.name, block) for page in PAGES if page.name in COMMANDS for block in command_lines(page)]


@pytest.fixture(scope="module")
def started(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that the examples take for granted: arm, job, and a recorded run."""
    folder = tmp_path_factory.mktemp("examples")
    (folder / "my_arm.toml").write_text(shipped.arm_path().read_text())
    (folder / "my_job.toml").write_text(shipped.job_path().read_text())
    plan = small_plan(folder / "feed.json", name="feed")
    done = commandline.run("run", plan, "--repeat", "2", folder=folder)
    assert done.exit_code == 0, done.errors
    return folder


@pytest.fixture
def port(tmp_path: Path) -> Iterator[str]:
    """A board with MicroPython alone on it, where the examples say PORT."""
    options = LaunchOptions(tmp_path / "flash", deployed=True, interpreter=interpreters.starter(FASTEST))
    with launch(options) as board:
        yield board.port


@pytest.mark.parametrize(("name", "code"), python_blocks(), ids=[name for name, _ in python_blocks()])
def test_python_example(name: str, code: str, started: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(started)
    exec(compile(code, name, "exec"), {"__name__": "__main__"})


@pytest.mark.parametrize(
    ("page", "block"), BLOCKS, ids=[f"{page}-{number}" for number, (page, _) in enumerate(BLOCKS)]
)
def test_commands(page: str, block: list[list[str]], port: str, started: Path, tmp_path: Path) -> None:
    for name in ("my_arm.toml", "my_job.toml"):
        (tmp_path / name).write_text((started / name).read_text())
    shutil.copytree(started / "runs" / "feed-001", tmp_path / "runs" / "feed-001")  # the demo's
    environment, folder = {}, tmp_path
    for words in block:
        if words[0] == "cd":
            folder /= words[1]
            continue
        if words[1] == "flash":  # tried on stand-ins for a board's boot loader
            continue
        if words[0] == "export":
            name, value = words[1].split("=")
            environment[name] = value.replace(PORT, port)
            continue
        arguments = [port if word == PORT else word for word in words[1:]]
        done = commandline.run(*arguments, folder=folder, **environment)
        assert done.exit_code == 0, f"{' '.join(words)}: {done.output}{done.errors}"


def test_the_examples_were_found() -> None:
    assert {name.split("-")[0] for name, _ in python_blocks()} >= {"library.md", "kinematics.md"}
    assert {page for page, _ in BLOCKS} == set(COMMANDS)
    assert sum(len(block) for _, block in BLOCKS) >= 15
