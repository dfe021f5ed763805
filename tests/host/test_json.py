"""Every command that reports has ``--json``: one document on stdout and nothing else."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest
from armtempo.cli import main
from armtempo.cli.commands import COMMANDS
from armtempo.link.board_messages import Hello
from armtempo.simulator import LaunchOptions, launch
from click.testing import CliRunner

from tests.interpreters import ROOT

NO_REPORT = {
    "demo": "shows a newcomer around",
    "teach": "a screen with keys, and a line on the file",
    "completion": "prints a script",
    "help": "prints a page",
    "virtual-board": "prints its port, and stays",
    "panel": "prints its address, and stays",
}
JOB = """
name = "short"
population = 5
iterations = 5
via_deg = [[0.0, -60.0, 40.0], [5.0, -55.0, 40.0]]
"""
SEQUENCE = """
name = "there"
start = "home"
[[step]]
goto = [5.0, -55.0, 40.0]
[[step]]
wait_s = 0.1
"""


def option(name: str) -> click.Parameter | None:
    """The option ``--json`` of a command."""
    command = main.get_command(click.Context(main), name)
    assert command is not None
    return next((one for one in command.params if "--json" in one.opts), None)


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_has_it_unless_it_reports_nothing(name: str) -> None:
    assert (option(name) is None) == (name in NO_REPORT)


def said(*arguments: Any, code: int = 0) -> Any:
    """The document that a command prints."""
    done = CliRunner().invoke(main, [*map(str, arguments), "--json"])
    assert done.exit_code == code, f"{arguments}: {done.output} {done.exception!r}"
    return json.loads(done.stdout)


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the paper's arm, a virtual board, a job and a sequence."""
    (tmp_path / "armtempo.toml").write_text('arm = "paper"\nport = "sim:board"\njob = "job.toml"\n')
    (tmp_path / "job.toml").write_text(JOB)
    (tmp_path / "sequence.toml").write_text(SEQUENCE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_without_a_board(project: Path) -> None:
    assert said("new", "mine", "--like", "ar4")["joints"][0]["steps_per_deg"] > 0
    (plan,) = said("plan")["plans"]
    assert plan["duration_s"] > 0
    sequence = said("plan", "sequence.toml")
    assert sequence["total"]["duration_s"] == pytest.approx(
        sum(step["duration_s"] or 0.0 for step in sequence["steps"]) + sequence["pause_s"]
    )
    assert said("export", "short.json", "-o", "short.csv")["rate_hz"] == 100.0
    assert said("import", "short.csv", "--name", "back")["via_points"] >= 2
    assert said("fk", "0,-60,40")
    assert said("ik", "--position", "-536.4", "0", "434.7", "--rpy", "0", "-90", "0")
    assert said("check")["findings"]
    assert said("config")["settings"]["arm"]["value"] == "paper"
    assert "ports" in said("ports")
    urdf = ROOT / "tests" / "data" / "urdf" / "six_rounded.urdf"
    assert said("import-urdf", urdf, "-o", "arm.toml")["joints"] == 6


def test_what_goes_to_stdout_itself_has_no_document(project: Path) -> None:
    said("plan")
    done = CliRunner().invoke(main, ["export", "short.json", "--json"])
    assert done.exit_code == 2
    assert "-o FILE" in json.loads(done.stdout)["hint"] + json.loads(done.stdout)["error"]


@pytest.fixture
def board(project: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A virtual board that all commands of a test find."""
    with launch(LaunchOptions()) as process:
        monkeypatch.setenv("ARMTEMPO_PORT", process.port)
        yield


@pytest.mark.slow
def test_with_a_board(project: Path, board: None) -> None:
    said("plan")
    said("plan", "sequence.toml")
    assert said("configure")["changed"]
    assert not said("configure")["changed"]
    assert said("home")["joints"][0]["angle_deg"] == 0.0
    assert said("upload", "short.json", "--name", "one")["size_bytes"] > 0
    assert said("upload", "there.json")["motions"] == 1
    assert {one["name"] for one in said("list")["motions"]} == {"one", "there", "there-1"}
    assert said("show", "one")["end_deg"] == pytest.approx([5, -55, 40], abs=0.05)
    assert said("rename", "one", "two") == {"old": "one", "new": "two"}
    assert said("remove", "two") == {"removed": ["two"]}
    run = said("run", "short.json")
    assert run["complete"]
    report = said("report", run["folder"])
    assert report["runs"][0]["verdict"] in ("good", "open")
    assert report["comparison"] is None
    assert said("goto", "home")["joints"][0]["steps"] == 0
    assert said("jog", "--joint", "1", "--by", "1")["joints"][0]["angle_deg"] == pytest.approx(1.0, abs=0.05)
    assert said("goto", "home")
    assert said("run", "there.json")["ending"] == "finished"
    assert said("goto", "home")
    assert said("run", "there")["ending"] == "finished"
    assert said("status")["virtual"]
    assert said("clear")["cleared"] is None
    assert not said("stop")["moving"]
    assert said("output") == []
    assert said("input") == []
    assert said("doctor")["machine"]


def test_traffic_is_a_document_a_line(project: Path) -> None:
    said("list", "--log-traffic", "log")
    done = CliRunner().invoke(main, ["monitor", "log", "--json"])
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert {line["direction"] for line in lines} == {">", "<"}


def test_speeds_name_the_program_that_was_asked(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("armtempo.cli.speed._ask", lambda *_: "'armtempo run' (process 1)")
    assert said("speed", "50")["speed_percent"] == 50.0
    assert said("pause")["speed_percent"] == 0.0
    assert said("resume")["speed_percent"] is None


@pytest.mark.slow
def test_the_program_on_a_board(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def deploy(port: str, mpy: bool, tell: Any, progress: Any) -> Hello:
        tell("copied")
        numbers = dict.fromkeys(Hello.__dataclass_fields__, 0)
        return Hello(**{**numbers, "board_id": "x", "engine_room": 60_000})

    monkeypatch.setattr("armtempo.deploy.deploy", deploy)
    monkeypatch.setattr("armtempo.deploy.undeploy", lambda port, tell: tell("removed"))
    assert said("deploy", "--port", "x")["arm_fits"]
    assert said("deploy", "--package", "package") == {"package": "package"}
    assert said("undeploy", "--port", "x") == {"port": "x", "program": None}


@pytest.mark.slow
def test_firmware(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("armtempo.deploy.firmware.write.flash", lambda *_: None)
    assert said("flash", "--image", "folder", "--port", "x") == {"image": "folder", "port": "x"}
    assert Path(said("firmware", "--program", "program")["manifest"]).exists()
