"""The demo, the wheel, "The first hour" with armtempo installed from it, and "A day with your arm"."""

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
from armtempo.model.plan import Plan
from armtempo.report import run_reader, run_report
from armtempo.report.run_folder import leg_file
from armtempo.simulator import LaunchOptions, launch

from tests import interpreters
from tests.interpreters import ROOT
from tests.system import commandline
from tests.system.commandline import Ended
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
    done = subprocess.run(build, capture_output=True, text=True, env=interpreters.environment_of_others())
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
    environment = interpreters.environment_of_others()
    subprocess.run([sys.executable, *install], check=True, capture_output=True, env=environment)
    (site,) = (folder / "venv").glob("lib/python*/site-packages")
    mine = sysconfig.get_paths()["purelib"]
    # Without its .pth files
    (site / "dependencies.pth").write_text(f"import sys; sys.path.append({mine!r})\n")
    return programs


@TOGETHER
@pytest.mark.long
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
@pytest.mark.long
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


@pytest.mark.long
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


# ``armtempo demo`` from the command line: what it prints and what it leaves


DEMO = pytest.mark.xdist_group("demo")  # what they share is made once

FIGURES = ("tracking", "errors", "convergence", "postures")
LIMITS = {"joint 1": (50.0, 50.0, 150.0), "joint 2": (40.0, 30.0, 120.0), "joint 3": (60.0, 40.0, 150.0)}
"""Speed, acceleration and jerk (Tables 5 and 7)."""
BLOCKED = "raise ImportError('not here')\n"


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Ended, Path]:
    """A demo with the report, under CPython, and its run folder."""
    folder = tmp_path_factory.mktemp("demo")
    environment = {"ARMTEMPO_MICROPYTHON": interpreters.starter("cpython")}
    return commandline.run("demo", folder=folder, **environment), folder / "runs" / "feed-001"


def rows(output: str, joint: str) -> list[list[float]]:
    """The numbers of each line about a joint."""
    lines = [line.removeprefix(joint) for line in output.splitlines() if line.startswith(joint)]
    return [[float(number) for number in re.findall(r"[-+]?\d+\.?\d*", line)] for line in lines]


@DEMO
def test_it_leaves_a_whole_run_folder_and_its_report(demo: tuple[Ended, Path]) -> None:
    done, folder = demo
    assert done.exit_code == 0, done.errors
    assert done.errors == "port sim: a virtual board, which ends with this command\n"
    assert [one.state for one in run_reader.load(folder).repetitions] == ["complete"]
    assert (folder / leg_file(1)).stat().st_size > 0
    assert Plan.load(folder / "trajectory.json").job.name == "feed"
    assert "samples-01.csv: complete, 6.795 s, 69 samples" in done.output
    assert f"report: {Path('runs') / folder.name / run_report.PAGE}" in done.output
    assert "armtempo panel --port sim" in done.output
    assert (folder / run_report.PAGE).read_text(encoding="utf-8").count("<figure") == len(FIGURES)
    assert all((folder / f"{name}.svg").stat().st_size > 0 for name in FIGURES)


@DEMO
@pytest.mark.parametrize(("joint", "net_steps"), [*zip(LIMITS, (6400, 1955, -3271), strict=True)])
def test_it_sums_up_plan_and_run(joint: str, net_steps: int, demo: tuple[Ended, Path]) -> None:
    """Net steps: those of Table 3's P6 less P0, each rounded to whole steps."""
    done, folder = demo
    planned, (sent, _, error_deg) = rows(done.output, joint)
    spline = Plan.load(folder / "trajectory.json").trajectory.joints[list(LIMITS).index(joint)]
    assert planned[0] == pytest.approx(spline.duration_s, abs=1e-4)
    assert tuple(planned[-5::2]) == LIMITS[joint]
    for reached, limit in zip(planned[-6::2], LIMITS[joint], strict=True):
        assert 0.3 * limit < reached <= limit
    assert sent == net_steps
    assert abs(error_deg) < 0.2  # two encoder counts


@pytest.mark.long
@DEMO
def test_its_trajectory_file_runs_again(demo: tuple[Ended, Path]) -> None:
    _, folder = demo
    again = commandline.run("run", folder / "trajectory.json", folder=folder.parent.parent)
    assert again.exit_code == 0, again.errors
    first, second = (
        run_reader.load(folder.with_name(name)).repetitions[0] for name in ("feed-001", "feed-002")
    )
    assert first.commanded_steps[-1].tolist() == second.commanded_steps[-1].tolist()


@pytest.mark.long
def test_without_matplotlib_it_says_what_is_missing_and_keeps_the_run(tmp_path: Path) -> None:
    blocked = tmp_path / "blocked"
    (blocked / "matplotlib").mkdir(parents=True)
    (blocked / "matplotlib" / "__init__.py").write_text(BLOCKED, encoding="utf-8")
    done = commandline.run("demo", folder=tmp_path, PYTHONPATH=str(blocked))
    assert done.exit_code == 0, done.errors
    done.said("no report", "matplotlib", "pip install 'matplotlib", "armtempo report")
    assert run_reader.load(tmp_path / "runs" / "feed-001").repetitions[0].state == "complete"
    assert "joint 1" in done.output
