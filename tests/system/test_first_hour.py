"""The page "The first hour": its commands, as they stand, with armtempo installed from its wheel."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

from tests.interpreters import ROOT

PAGE = (ROOT / "host" / "docs" / "first-hour.md").read_text(encoding="utf-8")
COMMANDS = [
    line
    for block in re.findall(r"^```sh\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    for line in block.replace("\\\n", " ").splitlines()
]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the programs of an environment with the wheel; its dependencies are those of the tests."""
    folder = tmp_path_factory.mktemp("installed")
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
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
    (site / "dependencies.pth").write_text(
        f"import sys; sys.path.append({mine!r})\n"
    )  # without its .pth files
    return programs


def test_an_own_arm_moves_within_ten_commands(installed: Path, tmp_path: Path) -> None:
    assert len(COMMANDS) <= 10
    assert COMMANDS[0].startswith("pipx install")
    environment = {"PATH": f"{installed}{os.pathsep}{os.environ['PATH']}", "HOME": str(tmp_path)}
    outputs = []
    folder = tmp_path
    for line in COMMANDS[1:]:
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


def test_it_is_the_wheel_that_ran(installed: Path) -> None:
    code = "import armtempo; print(armtempo.__file__)"
    done = subprocess.run([str(installed / "python"), "-c", code], capture_output=True, text=True, check=True)
    assert str(installed.parent) in done.stdout
