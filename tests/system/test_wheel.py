"""The wheel: three packages at its top level and nothing else, with everything they need inside."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from armtempo.cli.help import TOPICS

from tests.interpreters import ROOT

pytestmark = pytest.mark.xdist_group("wheel")  # what they share is made once

PACKAGES = {"armtempo": "host", "armtempo_shared": "shared", "armtempo_board": "board"}


@pytest.fixture(scope="module")
def names(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    """The files in a freshly built wheel."""
    out = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = out.glob("*.whl")
    return set(zipfile.ZipFile(wheel).namelist())


def test_its_top_level_is_the_three_packages(names: set[str]) -> None:
    top = {Path(name).parts[0] for name in names}
    assert {name for name in top if not name.endswith(".dist-info")} == set(PACKAGES)
    assert len(top) == len(PACKAGES) + 1


def test_the_pages_that_messages_name_are_in_it(names: set[str]) -> None:
    assert {f"armtempo/data/pages/{topic}.md" for topic in TOPICS} <= names


def test_every_tracked_file_of_the_packages_is_in_it(names: set[str]) -> None:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    for package, folder in PACKAGES.items():
        prefix = f"{folder}/{package}/"
        wanted = {line.removeprefix(f"{folder}/") for line in listed.stdout.splitlines() if prefix in line}
        assert wanted
        assert wanted <= names
