"""The workflows, and what they run: interpreters that the lock names, and each other Python once."""

from __future__ import annotations

import re
import runpy
import shlex
import sys
from pathlib import Path

import click
import pytest
from armtempo.cli import main

from tests import conftest, sources
from tests.interpreters import ROOT

FILES = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


LINES = [
    (file.name, command.strip())
    for file in FILES
    for line in re.findall(r"run: (.*?)(?: #.*)?$", file.read_text(encoding="utf-8"), re.MULTILINE)
    for command in line.split("&&")
]


def test_what_may_be_left_out_without_a_package_is_there() -> None:
    assert [name for name in conftest.NEEDS if not (ROOT / "tests" / name).exists()] == []


def test_there_are_workflows() -> None:
    assert len(FILES) == 3
    assert len(LINES) > 10


def test_what_a_workflow_runs_is_there() -> None:
    for file, line in LINES:
        program, *arguments = shlex.split(line)
        if program == "armtempo" and arguments != ["--version"]:
            command = main.get_command(click.Context(main), arguments[0])
            assert command is not None, line
            command.make_context(arguments[0], arguments[1:], resilient_parsing=False)
        elif program == "make":
            makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
            assert all(re.search(rf"^{target}:", makefile, re.MULTILINE) for target in arguments)
        elif "/" in program or (program == "python" and arguments[0].endswith(".py")):
            script = ROOT / (program if "/" in program else arguments[0])
            assert script.is_file(), f"{file}: {line}"
            assert "/" not in program or script.stat().st_mode & 0o100, f"{file}: {line}"


def test_a_workflow_that_another_one_calls_is_there_and_may_be_called() -> None:
    for file in FILES:
        for called in re.findall(r"uses: \./(\S+)", file.read_text(encoding="utf-8")):
            assert "workflow_call:" in (ROOT / called).read_text(encoding="utf-8")


# interpreters for the tests: the file that the lock names, or none


@pytest.mark.parametrize("content", [b"another file", None])
def test_a_file_that_is_not_the_locked_one_is_not_unpacked(content: bytes | None, tmp_path: Path) -> None:
    names = runpy.run_path(str(ROOT / ".ci" / "get_micropython.py"))
    unpack = names["unpack"]
    unpack.__globals__.update(CACHE=tmp_path / "cache", archive_address=tmp_path.as_uri)
    for line in names["LOCK"].read_text().splitlines():
        package = tmp_path / line.split()[1]
        package.parent.mkdir(parents=True, exist_ok=True)
        if content is not None:
            package.write_bytes(content)
    with pytest.raises(names["Missing"], match=r"micropython_.*_armhf\.deb.*debian\.lock"):
        unpack("armhf")
    assert not (tmp_path / "cache").exists()


# the other Pythons of CI's machine: each release once, and a line if there is none


def test_pythons_that_ci_tries(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script = sources.script(ROOT / ".ci" / "pythons.py")
    one = {sys.version_info[:2]: Path("own")}
    two = {**one, (3, 99): Path("newer")}
    assert [(each.name, each.python) for each in script.environments(one)] == [("oldest", Path("own"))]
    assert [(each.name, each.python) for each in script.environments(two)] == [
        ("newest-3.99", Path("newer")),
        ("oldest", Path("own")),
    ]
    stood_in = script.main.__globals__
    stood_in.update(PLACE=tmp_path, test=lambda environment: (True, environment.name))
    stood_in["pythons"] = lambda: two
    assert script.main() == 0
    assert capsys.readouterr().out.splitlines() == ["newest-3.99", "oldest"]
    stood_in.update(pythons=lambda: one, test=lambda environment: (False, environment.name))
    assert script.main() == 1
    last = "only one Python from 3.11 on is on this machine; no other was tested"
    assert capsys.readouterr().out.splitlines() == ["oldest", last]
