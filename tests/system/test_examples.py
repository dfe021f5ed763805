"""Every example of README and host/docs does what it says: Python blocks, and commands on a virtual board.

The commands of host/docs/recovery.md are tried by ``test_recovery``, each on a board that has the trouble.
The board's bootloader is a stand-in that puts the program where a firmware has it.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from zipfile import ZipFile

import pytest
from armtempo.deploy.firmware import frozen, image
from armtempo.link.program_version import own_crc
from armtempo.model import shipped
from armtempo.simulator import LaunchOptions, launch
from armtempo.simulator.launch_options import DEFAULT_MACHINE

from tests import interpreters
from tests.host.firmware import fakes
from tests.interpreters import ROOT
from tests.system import commandline
from tests.system.commandline import SOURCES_BLOCKS, small_plan
from tests.system.conftest import FASTEST

README = ROOT / "README.md"
PAGES = (README, *sorted((ROOT / "host" / "docs").glob("*.md")))
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


def on_stock(block: list[list[str]]) -> list[list[str]]:
    """What is another for a board that keeps stock MicroPython: what follows runs on the firmware's board."""
    return [words for words in block if words[0] == "export" or words[1] in ("deploy", "home")]


BLOCKS = [(page.name, block) for page in PAGES if page.name in COMMANDS for block in command_lines(page)]
BLOCKS += [
    (page, on_stock(block))
    for page, block in BLOCKS
    if page == "README.md" and any(words[1] == "flash" for words in block)
]


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


@contextmanager
def board(folder: Path, firmware: bool) -> Iterator[str]:
    """A board with MicroPython alone on it, where the examples say PORT; the program in a firmware takes more space."""
    options = LaunchOptions(
        folder / "flash",
        deployed=True,
        interpreter=interpreters.starter(FASTEST),
        flash_blocks=SOURCES_BLOCKS if firmware else None,
    )
    with launch(options) as board:
        yield board.port


def bootloader(folder: Path) -> dict[str, str]:
    """A release's firmware in the folder, and what stands for dfu-util; the chip starts with the program in it."""
    pieces = (image.Piece("firmware0.bin", 0x08000000), image.Piece("firmware1.bin", 0x08020000))
    made = image.Image("STM32F4DISC", DEFAULT_MACHINE, "1.28.0", "gcc", own_crc(), pieces)
    with ZipFile(folder / "armtempo-firmware-STM32F4DISC.zip", "w") as archive:
        for piece in pieces:
            archive.writestr(f"firmware/{piece.file}", piece.file)
        archive.writestr(f"firmware/{image.ABOUT}", image.about(made))
    frozen.write(folder / "program")
    tools = folder / "bin"
    tools.mkdir()
    (tools / "dfu-util").write_text(fakes.DFU)
    (tools / "dfu-util").chmod(0o755)
    return {
        "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}",
        "TOOL_LOG": str(folder / "tool.log"),
        "DFU_LIST": fakes.ONE,
        "DFU_STARTS": f"cp -r {folder}/program/. {folder}/flash",
    }


@pytest.mark.parametrize(("name", "code"), python_blocks(), ids=[name for name, _ in python_blocks()])
def test_python_example(name: str, code: str, started: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(started)
    exec(compile(code, name, "exec"), {"__name__": "__main__"})


@pytest.mark.parametrize(
    ("page", "block"),
    [pytest.param(*one, marks=[pytest.mark.long] * (one[0] != "README.md")) for one in BLOCKS],
    ids=[f"{page}-{number}" for number, (page, _) in enumerate(BLOCKS)],
)
def test_commands(page: str, block: list[list[str]], started: Path, tmp_path: Path) -> None:
    for name in ("my_arm.toml", "my_job.toml"):
        (tmp_path / name).write_text((started / name).read_text())
    shutil.copytree(started / "runs" / "feed-001", tmp_path / "runs" / "feed-001")  # the demo's
    flashes = any(words[1] == "flash" for words in block)
    environment, folder = bootloader(tmp_path) if flashes else {}, tmp_path
    with board(tmp_path, flashes) as port:
        for words in block:
            if words[0] == "cd":
                folder /= words[1]
                continue
            if words[0] == "export":
                name, value = words[1].split("=")
                environment[name] = value.replace(PORT, port)
                continue
            arguments = [port if word == PORT else word for word in words[1:]]
            done = commandline.run(*arguments, folder=folder, **environment)
            assert done.exit_code == 0, f"{' '.join(words)}: {done.output}{done.errors}"
            if words[1] == "deploy":
                assert ("part of the board's firmware" in done.output + done.errors) == flashes


def test_the_examples_were_found() -> None:
    assert {name.split("-")[0] for name, _ in python_blocks()} >= {"library.md", "kinematics.md"}
    assert {page for page, _ in BLOCKS} == set(COMMANDS)
    assert sum(len(block) for _, block in BLOCKS) >= 15


# every file of host/examples runs, and leaves what it says


EXAMPLES = ROOT / "host" / "examples"
LEAVES = {
    "feeding.py": "runs/feed-001/report.html",
    "turntable.py": "runs/half-turn-001/samples-02.csv",
    "pen.py": "pen.png",
    "ros_trajectory.py": "feed.yaml",
    "sweep.py": "sweep.csv",
    "compare_searches.py": "searches.csv",
    "animate.py": "arm.gif",
    "plan_and_plot.ipynb": "reach.png",
    "pick_and_place.py": "two-parts.toml",
}
FEW = ["--populations", "4", "--seeds", "2", "--iterations", "3"]
SHORTER = (
    ("repeat=3", "repeat=1"),
    ("iterations=200", "iterations=20, refine=1"),
    ("RATE_HZ = 10", "RATE_HZ = 2"),
    ("PARTS = 2", "PARTS = 1"),
)
"""What takes time and shows nothing new here."""
EVERY_DAY = ("ros_trajectory.py",)
ARGUMENTS = {"sweep.py": ["--jobs", "6"], "compare_searches.py": FEW}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.long] * (name not in EVERY_DAY)) for name in LEAVES]
)
def test_example(name: str, tmp_path: Path) -> None:
    script = EXAMPLES / name
    if script.suffix == ".ipynb":
        cells = json.loads(script.read_text(encoding="utf-8"))["cells"]
        code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
        script = tmp_path / "notebook.py"
        script.write_text(f"import matplotlib\nmatplotlib.use('Agg')\n{code}", encoding="utf-8")
    else:
        text = script.read_text(encoding="utf-8")
        for long, short in SHORTER:
            text = text.replace(long, short)
        script = tmp_path / name
        script.write_text(text, encoding="utf-8")
    done = commandline.python(script, *ARGUMENTS.get(name, []), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / LEAVES[name]).stat().st_size > 0


@pytest.mark.long
def test_searches_on_a_cluster_give_the_same(tmp_path: Path) -> None:
    import distributed  # takes long, and every process that collects the tests would do it

    script = EXAMPLES / "compare_searches.py"
    found = []
    with distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster:
        for where in ([], ["--scheduler", cluster.scheduler_address]):
            command = [sys.executable, str(script), *FEW, *where]
            subprocess.run(command, cwd=tmp_path, check=True)
            found.append((tmp_path / "searches.csv").read_text())
    assert found[0] == found[1]
    assert found[0].count("\n") == 13


def test_none_is_left_out() -> None:
    files = {path.name for path in EXAMPLES.iterdir() if path.suffix in (".py", ".ipynb")}
    page = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    assert files == {*LEAVES, "ros_bridge.py"}  # which test_ros_bridge.py runs
    assert all(f"({name})" in page for name in files)
