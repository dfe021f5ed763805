"""Commands by what they print and end with, on a board in the same process; ``--json`` of all that report."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import pytest
from armtempo.cli import main
from armtempo.cli.commands import COMMANDS
from armtempo.kinematics.of_arm import forward
from armtempo.link import Client, greet
from armtempo.link.board_messages import Hello
from armtempo.link.session import Session
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import planner
from armtempo.report import run_reader
from armtempo.robot import connect
from armtempo.simulator import LaunchOptions, launch
from click.testing import CliRunner, Result

from tests.inprocess import Pipe
from tests.interpreters import ROOT

ARM = Arm.paper()
START, END = (0.0, -60.0, 40.0), (10.0, -50.0, 45.0)
ARM_HOME = forward(ARM, START)
Run = Callable[..., Result]


@pytest.fixture
def pipe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Pipe:
    """The board that every command finds on its port."""
    found = Pipe(tmp_path / "flash")
    found.run_samples = 12

    @contextmanager
    def open_board(port: str, *arguments: Any, **options: Any) -> Iterator[Client]:
        yield greet(Session(found, found.clock))

    monkeypatch.setattr(connect, "open_board", open_board)
    monkeypatch.chdir(tmp_path)
    return found


@pytest.fixture
def run(pipe: Pipe) -> Run:
    """Runs a command on that board, which counts as a real one; the paper's arm is the one that is named."""

    def run_command(*arguments: str, code: int = 0, **variables: str) -> Result:
        settings = {"ARMTEMPO_ARM": shipped.arm_path(), "ARMTEMPO_JOB": shipped.job_path()}
        environment = {**{name: str(value) for name, value in settings.items()}, **variables}
        result = CliRunner().invoke(main, [*arguments, "--port", "pipe"], env=environment)
        assert result.exit_code == code, result.output
        return result

    return run_command


@pytest.fixture
def file(tmp_path: Path) -> str:
    """A trajectory file."""
    job = Job("small", (START, END), population=5, iterations=20, path="through")
    planner.plan(ARM, job).save(tmp_path / "small.json")
    return "small.json"


def test_help_lists_every_command() -> None:
    output = CliRunner().invoke(main, ["--help"]).output
    for name in COMMANDS:
        assert f"  {name} " in output
        assert CliRunner().invoke(main, [name, "--help"]).exit_code == 0


@pytest.mark.slow
def test_store_commands(run: Run, file: str) -> None:
    assert "stored" in run("upload", file, "--default").output
    listing = run("list").output
    assert "small *" in listing
    assert "    from 0.00, -60.00, 40.00°" in listing.splitlines()
    assert "small-2" in run("rename", "small", "small-2").output
    shown = run("show", "small-2").output
    assert "from joint 1 0.00° (0 steps), joint 2 -60.00° (-5333 steps), joint 3 40.00° (" in shown
    run("remove", "small-2")
    assert "small" not in run("list").output
    assert "no trajectory of this name" in run("remove", "small", code=1).output
    assert "is not a valid name on the board" in run("upload", file, "--name", "a b", code=2).output
    assert "'a b' is not a valid name of a motion on the board" in run("rename", "x", "a b", code=2).output


@pytest.mark.slow
def test_run_writes_a_folder(run: Run, file: str, pipe: Pipe) -> None:
    assert "armtempo home" in run("run", file, code=1).output
    said = run("home", "P0").output
    assert re.search(r"joint 3 +39\.99° +\(1422 steps\)", said), said  # the nearest step
    output = run("run", file).output
    assert "samples-01.csv: complete" in output
    assert "12 samples" in output
    found = run_reader.load(Path("runs/small-001"))
    assert len(found.repetitions[0].index) == 12
    assert found.plan_path is not None
    assert (Path("runs/small-001") / "leg-01.bin").read_bytes()[:4] == b"ATM4"


@pytest.mark.slow
def test_run_refuses_another_start(run: Run, file: str) -> None:
    run("upload", file)
    run("home", "5,-60,40")
    assert "armtempo goto" in run("run", file, code=1).output


@pytest.mark.slow
def test_run_by_stored_name(run: Run, file: str) -> None:
    run("upload", file)
    run("home")
    assert "complete" in run("run", "small").output
    assert "no trajectory of this name" in run("run", "other", code=1).output


@pytest.mark.slow
def test_fault_during_a_run(run: Run, file: str, pipe: Pipe, monkeypatch: pytest.MonkeyPatch) -> None:
    run("upload", file)
    run("home")
    engine = pipe.app.controller.board.engine

    def stall(samples: int) -> None:
        engine.fault, engine.fault_joint = 42, 1
        engine.finish()

    monkeypatch.setattr(engine, "advance", stall)
    output = run("run", file, code=1).output
    assert "stall or slip) (joint 2)" in output
    assert run_reader.load(Path("runs/small-001")).repetitions[0].state == "fault"
    assert "fault     following" in run("status").output
    assert "a fault is pending" in run("run", file, code=1).output
    assert "cleared: following" in run("clear").output
    assert "no fault was pending" in run("clear").output


@pytest.mark.slow
@pytest.mark.parametrize(("samples", "calls"), [(12, ["brake"]), (120, ["brake", "freeze"])])
def test_interrupt_brakes_then_freezes_and_keeps_the_samples(
    run: Run, file: str, pipe: Pipe, monkeypatch: pytest.MonkeyPatch, samples: int, calls: list[str]
) -> None:
    pipe.run_samples = samples
    run("upload", file)
    run("home")
    engine = pipe.app.controller.board.engine
    advance = engine.advance

    def interrupt(samples: int) -> None:
        advance(samples)
        if engine.calls[-1] == "start":
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(engine, "advance", interrupt)
    output = run("run", file, code=130).output
    assert "interrupted" in output
    assert engine.calls[-len(calls) :] == calls
    found = run_reader.load(Path("runs/small-001")).repetitions[0]
    assert found.state == "interrupted"
    assert len(found.index)


@pytest.mark.slow
def test_arm_is_not_replaced_silently(run: Run, file: str, tmp_path: Path) -> None:
    run("upload", file)
    other = tmp_path / "other.toml"
    text = shipped.arm_path().read_text().replace("pulse_us = 2.0", "pulse_us = 3.0")
    other.write_text(text.replace("microsteps = 8, gear_ratio = 20.0", "microsteps = 16, gear_ratio = 20.0"))
    run("home")
    refused = run("home", "--arm", str(other), code=1).output
    assert "set up for a different arm" in refused
    assert "switches; joint 2: encoder counts a step, range, speed limit\n" in refused
    assert "armtempo configure" in refused
    assert "idle" in run("status").output
    run("home", "--arm", str(other), "--replace-arm")
    assert "set up for a different arm" in run("home", code=1).output
    unsaid = run("home", code=2, ARMTEMPO_ARM="").output
    assert "which arm does the board move? It is set up for an arm other than the paper's" in unsaid
    assert "give --arm" in unsaid
    assert "planned for a different arm" in run("run", file, "--arm", str(other), code=2).output


@pytest.mark.slow
@pytest.mark.parametrize(
    ("where", "words"),
    [
        ("P9", "give one of P0 to P6"),
        ("here", "has no posture"),
        ("1,2", "3 angles, not 2"),
        ("-11,0,0", "outside of its range"),
        ("x.json", "x.json"),
    ],
)
def test_bad_postures(run: Run, where: str, words: str) -> None:
    run("home")
    assert words in run("goto", where, code=2).output


def test_stop_when_nothing_moves(run: Run) -> None:
    run("home")
    assert "state     idle" in run("stop").output


def test_ports_and_missing_ports() -> None:
    assert "sim" in CliRunner().invoke(main, ["ports"]).output
    result = CliRunner().invoke(main, ["status"], env={"ARMTEMPO_PORT": "/dev/nowhere"})
    assert result.exit_code == 2
    assert "there is no port /dev/nowhere" in result.output
    assert "armtempo ports" in result.output


def test_a_typing_error_names_the_file_that_is_meant(run: Run, tmp_path: Path) -> None:
    (tmp_path / "first.json").write_text("{}", encoding="utf-8")
    for wrong in ("first.jsn", "firts.json"):
        said = run("run", wrong, code=2).output
        assert f"{wrong}: no such file; did you mean 'first.json'?" in said
    assert "'': no such file" in run("run", "", code=2).output
    (tmp_path / "folder.json").mkdir()
    assert "mean 'folder.json'" not in run("run", "folder.json", code=2).output


def test_what_is_not_planned_yet_is_not_called_damaged(run: Run, tmp_path: Path) -> None:
    for name, cure in (("job.toml", "armtempo plan"), ("pick.py", "armtempo program")):
        (tmp_path / name).write_text("x = 1\n", encoding="utf-8")
        said = run("run", name, code=2).output
        assert f"{name}: is not a plan" in said
        assert cure in said


def test_angles_without_commas_are_shown_with_them(run: Run) -> None:
    said = run("goto", "10", "10", "-10", code=2).output
    assert "3 values for one posture" in said
    assert "armtempo goto 10,10,-10" in said


def test_a_failure_is_json_where_results_are(run: Run) -> None:
    found = json.loads(run("goto", "10,-50,500", "--json", code=2).stdout)
    assert found["exit_code"] == 2
    assert "500 degrees is outside" in found["error"]
    assert found["hint"]


@pytest.mark.parametrize("command", ["pause", "resume"])
def test_nothing_to_pause_is_said_as_just_that(run: Run, command: str) -> None:
    run("home")
    assert f"there is nothing to {command}: nothing moves" in run(command, code=1).output


def test_status_says_where_the_tool_is(run: Run) -> None:
    run("home")
    assert re.search(r"tool at 299\.6 0\.0 \S+ mm, roll", run("status").output)
    tool = json.loads(run("status", "--json").stdout)["tool"]
    assert tool["position_mm"] == pytest.approx(ARM_HOME[:3, 3], abs=0.1)


# every command that reports has ``--json``: one document on stdout and nothing else


NO_REPORT = {
    "demo": "shows a newcomer around",
    "teach": "a screen with keys, and a line on the file",
    "help": "prints a page",
    "virtual-board": "prints its port, and stays",
    "panel": "prints its address, and stays",
}
SHORT_JOB = """
name = "short"
path = "through"
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


def test_a_command_has_it_unless_it_reports_nothing() -> None:
    for name in COMMANDS:
        assert (option(name) is None) == (name in NO_REPORT), name


def said(*arguments: Any, code: int = 0) -> Any:
    """The document that a command prints."""
    done = CliRunner().invoke(main, [*map(str, arguments), "--json"])
    assert done.exit_code == code, f"{arguments}: {done.output} {done.exception!r}"
    return json.loads(done.stdout)


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the paper's arm, a virtual board, a job and a sequence."""
    (tmp_path / "armtempo.toml").write_text('arm = "paper"\nport = "sim:board"\njob = "job.toml"\n')
    (tmp_path / "job.toml").write_text(SHORT_JOB)
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
    report = said("report")
    assert [one["folder"] for one in report["runs"]] == [run["folder"]]
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
    def deploy(port: str, tell: Any, progress: Any) -> Hello:
        tell("copied")
        numbers = dict.fromkeys(Hello.__dataclass_fields__, 0)
        return Hello(**{**numbers, "board_id": "x", "engine_bytes": 60_000})

    monkeypatch.setattr("armtempo.deploy.deploy", deploy)
    monkeypatch.setattr("armtempo.deploy.undeploy", lambda port, tell: tell("removed"))
    assert said("deploy", "--port", "x")["arm_fits"]
    assert said("undeploy", "--port", "x") == {"port": "x", "program": None}


@pytest.mark.slow
def test_firmware(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("armtempo.deploy.firmware.write.flash", lambda *_: None)
    assert said("flash", "--image", "folder", "--port", "x") == {"image": "folder", "port": "x"}
    assert Path(said("firmware", "--program", "program")["manifest"]).exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("goto P99 --job {job}", "no via point P99"),
        ("home P99 --job {job}", "no via point P99"),
        ("goto 1,2", "has 3 angles, not 2"),
        ("home 1,2", "has 3 angles, not 2"),
        ("goto parc", "no posture 'parc'"),
        ("goto --position nan 0 0", "nan is not a finite number"),
        ("jog --joint 1 --by nan", "nan is not a finite number"),
        ("jog --joint 9 --by 1", "drives no joint '9'"),
        ("speed nan", "nan is not a finite number"),
    ],
)
def test_what_is_wrong_is_said_before_a_port_is_opened(words: str, said: str) -> None:
    given = [word.format(job=shipped.job_path()) for word in words.split()]
    arm = [] if words.startswith("speed") else ["--arm", str(shipped.arm_path())]
    result = CliRunner().invoke(main, [*given, *arm, "--port", "nowhere"])
    assert result.exit_code == 2, result.output
    assert said in result.output
    assert "nowhere" not in result.output
