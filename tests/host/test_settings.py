"""Which board, arm, job and run folder a command takes: option, variable, project folder, in that order; else none."""

from __future__ import annotations

import itertools
import json
import random
from pathlib import Path

import pytest
from armtempo.basics.settings import NAMES, OPTIONS, ProjectSettings, variable_of
from armtempo.cli import main
from armtempo.ports import board_port
from armtempo.ports.board_port import Port
from click.testing import CliRunner, Result

SEED = 1301
BOARD_COMMANDS = [
    *(["status"], ["stop"], ["stop", "--now"], ["clear"], ["list"], ["show", "m"], ["remove", "m"]),
    *(["rename", "m", "n"], ["watch"], ["monitor"], ["deploy"], ["undeploy"]),
    *([*words.split(), "--arm", "paper"] for words in ("configure", "home", "goto home", "run m", "fetch")),
]


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(board_port, "_open_ports", list)


def run(*arguments: str, **variables: str) -> Result:
    return CliRunner(env=variables).invoke(main, list(arguments))


def plugged_in(monkeypatch: pytest.MonkeyPatch, *devices: str) -> None:
    """These likely boards, and a port that is none, are there."""
    ports = [Port("/dev/ttyS0", "", False), *(Port(device, "", True) for device in devices)]
    monkeypatch.setattr(board_port, "find_ports", lambda: ports)


@pytest.mark.parametrize("arguments", BOARD_COMMANDS, ids=" ".join)
def test_no_command_takes_a_virtual_board_unasked(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    plugged_in(monkeypatch)
    done = run(*arguments)
    assert done.exit_code == 2, done.output
    assert "none is plugged in" in done.stderr
    assert "--port sim" in done.stderr
    assert done.stdout == ""


def test_one_board_is_taken_and_said_two_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    plugged_in(monkeypatch, "/dev/no-board-1")
    done = run("status")
    assert "port /dev/no-board-1: the only board plugged in" in done.stderr
    plugged_in(monkeypatch, "/dev/no-board-1", "/dev/no-board-2")
    done = run("status")
    assert done.exit_code == 2
    assert "2 could be meant: /dev/no-board-1, /dev/no-board-2" in done.stderr


def test_option_before_variable_before_project_in_every_order(monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = random.Random(SEED)
    for name in NAMES:
        for sources in itertools.product((False, True), repeat=3):
            given, variable, project = (f"v{numbers.randrange(1000)}" if used else "" for used in sources)
            Path("armtempo.toml").write_text(f'{name} = "{project}"\n' if project else "")
            monkeypatch.delenv(variable_of(name), raising=False)
            if variable:
                monkeypatch.setenv(variable_of(name), variable)
            found = ProjectSettings().get(name, given or None)
            wanted = given or variable or project or ("runs" if name == "runs" else "")
            assert found.value == wanted, f"seed {SEED}: {name} {sources}"
            assert found.source.startswith(
                OPTIONS[name]
                if given
                else f"variable {variable_of(name)}"
                if variable
                else "armtempo.toml"
                if project
                else "default"
                if name == "runs"
                else ""
            )


def test_a_project_is_found_from_below_and_its_paths_are_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "my lab").mkdir()
    Path("my lab/armtempo.toml").write_text('arm = "my arm.toml"\nport = "sim:flash"\n')
    (tmp_path / "my lab" / "a" / "b").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "my lab" / "a" / "b")
    settings = ProjectSettings()
    assert settings.get("arm").path.resolve() == tmp_path / "my lab" / "my arm.toml"
    assert settings.get("port").value == f"sim:{Path('../../flash')}"
    assert settings.get("runs").path.resolve() == tmp_path / "my lab" / "runs"


def test_the_name_of_an_arm_that_ships_stays_a_name() -> None:
    Path("armtempo.toml").write_text('arm = "ar4"\n')
    assert ProjectSettings().get("arm").value == "ar4"
    Path("ar4").write_text("")
    assert ProjectSettings().get("arm").path.resolve() == Path("ar4").resolve()


def test_config_says_where_each_setting_comes_from(monkeypatch: pytest.MonkeyPatch) -> None:
    plugged_in(monkeypatch)
    Path("armtempo.toml").write_text('arm = "ar4"\njob = "feed.toml"\n')
    done = run("config", "--job", "other.toml", ARMTEMPO_PORT="sim:x")
    assert done.exit_code == 0, done.output
    assert "arm       ar4 (armtempo.toml)" in done.stdout
    assert "job       other.toml (--job)" in done.stdout
    assert "port      sim:x (variable ARMTEMPO_PORT)" in done.stdout
    assert "not set, and not exactly one board is plugged in" in run("config").stdout
    found = json.loads(run("config", "--json").stdout)
    assert found["settings"]["port"] == {"value": None, "source": None}


def test_a_misspelt_key_of_the_project_is_named() -> None:
    Path("armtempo.toml").write_text('prot = "sim"\n')
    done = run("status")
    assert done.exit_code == 2
    assert "prot" in done.stderr
    assert "did you mean 'port'" in done.stderr


def test_a_job_without_an_arm_is_not_planned() -> None:
    Path("job.toml").write_text('name = "j"\nvia_deg = [[0,0,0],[1,1,1]]\n')
    done = run("plan", "--job", "job.toml")
    assert done.exit_code == 2
    assert "no arm is set" in done.stderr
    assert not list(Path().glob("*.json"))
