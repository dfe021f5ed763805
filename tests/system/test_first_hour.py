"""The wheel, the page "The first hour" with armtempo installed from it, and the page "A day with your arm"."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest
from armtempo.cli.help import TOPICS
from armtempo.simulator import LaunchOptions, launch

from tests import interpreters
from tests.interpreters import ROOT
from tests.system import commandline
from tests.system.conftest import FASTEST

PAGE = (ROOT / "host" / "docs" / "first-hour.md").read_text(encoding="utf-8")
COMMANDS = [
    line
    for block in re.findall(r"^```sh\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    for line in block.replace("\\\n", " ").splitlines()
]
TOGETHER = pytest.mark.xdist_group("wheel")  # which is built once


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A freshly built wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(build, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the programs of an environment with the wheel; its dependencies are those of the tests."""
    folder = tmp_path_factory.mktemp("installed")
    venv.create(folder / "venv", with_pip=False)
    programs = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
    install = [
        "-m",
        "pip",
        "--python",
        str(programs / "python"),
        "install",
        "--no-deps",
        "--quiet",
        str(wheel),
    ]
    subprocess.run([sys.executable, *install], check=True, capture_output=True)
    (site,) = (folder / "venv").glob("lib/python*/site-packages")
    mine = sysconfig.get_paths()["purelib"]
    # Without its .pth files
    (site / "dependencies.pth").write_text(f"import sys; sys.path.append({mine!r})\n")
    return programs


@TOGETHER
def test_an_own_arm_moves_within_ten_commands(installed: Path, tmp_path: Path) -> None:
    assert len(COMMANDS) <= 10
    assert COMMANDS[0].startswith("pipx install")
    environment = {"PATH": f"{installed}{os.pathsep}{os.environ['PATH']}", "HOME": str(tmp_path)}
    outputs = []
    folder = tmp_path
    assert COMMANDS[1] == "armtempo demo"  # see test_demo
    for line in COMMANDS[2:]:
        if line.startswith("cd "):
            folder /= line.removeprefix("cd ")
            continue
        done = subprocess.run(
            ["sh", "-c", line], cwd=folder, env=environment, capture_output=True, text=True, timeout=600
        )
        assert done.returncode == 0, f"{line}: {done.stdout}{done.stderr}"
        outputs.append(done.stdout)
    assert (folder / "runs" / "first-001" / "report.html").stat().st_size > 10_000
    assert (folder / "arm.png").stat().st_size > 10_000
    for line in re.findall(r"^joint.*\d$|^joint.*known$", PAGE, re.MULTILINE):
        assert any(line in output for output in outputs), line


@TOGETHER
def test_it_is_the_wheel_that_ran(installed: Path) -> None:
    code = "import armtempo; print(armtempo.__file__)"
    done = subprocess.run([str(installed / "python"), "-c", code], capture_output=True, text=True, check=True)
    assert str(installed.parent) in done.stdout


# the page "A day with your arm": its commands, as they stand, on one virtual board


DAY_PAGE = (ROOT / "host" / "docs" / "day.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(sh|toml)\n(.*?)^```", DAY_PAGE, re.DOTALL | re.MULTILINE)
PORT = "/dev/ttyACM0"


def put(text: str, folder: Path) -> None:
    """What is in a file by its first line."""
    first, rest = text.split("\n", 1)
    name = first.split()[-1]
    added = (folder / name).read_text() + "\n" if "at the end of" in first else ""
    (folder / name).write_text(added + rest)


def test_its_commands_one_after_the_other(tmp_path: Path) -> None:
    folder = tmp_path
    outputs: dict[str, str] = {}
    with launch(LaunchOptions(tmp_path / "flash", interpreter=interpreters.starter(FASTEST))) as board:
        for kind, text in BLOCKS:
            if kind == "toml":
                put(text, folder)
                continue
            for line in text.splitlines():
                words = shlex.split(line)
                if words[0] == "cd":
                    folder /= words[1]
                    continue
                arguments = [board.port if word == PORT else word for word in words[1:]]
                done = commandline.run(*arguments, folder=folder, ARMTEMPO_PORT=board.port)
                assert done.exit_code == 0, f"{line}: {done.output}{done.errors}"
                outputs[line] = done.output
    assert re.search(r"^state +idle", outputs["armtempo status"], re.MULTILINE), outputs["armtempo status"]
    assert "finished after 2 whole cycles; parts 2" in outputs["armtempo run feed.json --speed 60"]
    assert "feed *" in outputs["armtempo list"]
    postures = re.findall(r"^\[posture\.(\w+)\]", (folder / "arm.toml").read_text(), re.MULTILINE)
    assert postures == ["above_feeder", "at_feeder", "above_tray"]
    assert json.loads((folder / "feed.json").read_text())["format"].startswith("armtempo sequence")


# the wheel: three packages at its top level and nothing else, with everything they need inside


PACKAGES = {"armtempo": "host", "armtempo_shared": "shared", "armtempo_board": "board"}


@pytest.fixture(scope="module")
def names(wheel: Path) -> set[str]:
    """The files in the wheel."""
    return set(zipfile.ZipFile(wheel).namelist())


@TOGETHER
def test_its_top_level_is_the_three_packages(names: set[str]) -> None:
    top = {Path(name).parts[0] for name in names}
    assert {name for name in top if not name.endswith(".dist-info")} == set(PACKAGES)
    assert len(top) == len(PACKAGES) + 1


@TOGETHER
def test_the_pages_that_messages_name_are_in_it(names: set[str]) -> None:
    assert {f"armtempo/data/pages/{topic}.md" for topic in TOPICS} <= names


@TOGETHER
def test_every_tracked_file_of_the_packages_is_in_it(names: set[str]) -> None:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    for package, folder in PACKAGES.items():
        prefix = f"{folder}/{package}/"
        wanted = {line.removeprefix(f"{folder}/") for line in listed.stdout.splitlines() if prefix in line}
        assert wanted
        assert wanted <= names
