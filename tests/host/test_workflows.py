"""The workflows for GitHub call commands, scripts and targets that there are."""

from __future__ import annotations

import re
import runpy
import shlex
from pathlib import Path

import click
import pytest
from armtempo.cli import main

from tests.interpreters import ROOT

FILES = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
LINES = [
    (file.name, command.strip())
    for file in FILES
    for line in re.findall(r"run: (.*?)(?: #.*)?$", file.read_text(encoding="utf-8"), re.MULTILINE)
    for command in line.split("&&")
]


def test_there_are_workflows() -> None:
    assert len(FILES) == 3
    assert len(LINES) > 10


@pytest.mark.parametrize(("file", "line"), LINES)
def test_what_a_workflow_runs_is_there(file: str, line: str) -> None:
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
        assert script.is_file()
        assert "/" not in program or script.stat().st_mode & 0o100


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
