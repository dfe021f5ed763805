"""Outputs and inputs on the virtual board: by its own hardware code, and from an arm file to the pins and back."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import armtempo
import pytest
from armtempo.basics.errors import BoardError, InputError, LinkError
from armtempo.cli import main
from armtempo.model.arm import Arm
from armtempo.robot.board import Board
from armtempo.simulator import InjectedFault, LaunchOptions, edgelog, launch
from click.testing import CliRunner, Result

from tests import scripted
from tests.host import arms

SCRIPT = Path(__file__).parent / "scripts" / "cases" / "wired_pins.py"
ESTOP = "estop_fitted = true"
TICKS_PER_US = 84


@scripted.each(scripted.together(scripted.cases(SCRIPT)))
def test_case(case: scripted.Case, tmp_path: Path) -> None:
    case.run(str(tmp_path), heap="")


@dataclass
class Bench:
    """A virtual board and the file of the arm on it."""

    port: str
    arm_file: Path
    log: Path

    def armtempo(self, *arguments: str) -> Result:
        """A command."""
        options = ["--port", self.port, "--arm", str(self.arm_file)]
        return CliRunner().invoke(main, [arguments[0], *options, *arguments[1:]])

    def said(self, *arguments: str) -> str:
        """The output of a command that ends well."""
        done = self.armtempo(*arguments)
        assert done.exit_code == 0, done.output
        return done.stdout

    def refused(self, *arguments: str) -> str:
        """What a command said that ends with code 1 or 2."""
        done = self.armtempo(*arguments)
        assert done.exit_code in (1, 2), done.output
        assert "Traceback" not in done.output
        return done.output


@contextmanager
def bench(folder: Path, *faults: InjectedFault) -> Iterator[Bench]:
    path = arms.write(folder, arms.ALL)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("estop_fitted = false", ESTOP), encoding="utf-8")
    log = folder / "edges"
    with launch(LaunchOptions(faults=faults, edge_log=log)) as process:
        yield Bench(process.port, path, log)


def widths_us(log: Path) -> list[float]:
    """The gripper's pulse widths, one after the other."""
    (cycle,) = edgelog.read(log)
    return [round(pulses.high_ticks / TICKS_PER_US) for pulses in cycle.pulses["B8"]]


def test_from_the_arm_file_to_the_pins(tmp_path: Path) -> None:
    with bench(tmp_path) as board:
        lines = board.said("output").splitlines()
        assert [line.split()[:3] for line in lines] == [
            ["gripper", "servo", "PB8"],
            ["pump", "switch", "PD0"],
            ["fan", "pwm", "PB9"],
        ]
        assert "open (20 deg)" in lines[0]
        assert " off " in lines[1]
        assert "closed (95 deg)" in board.said("output", "gripper", "closed")
        assert json.loads(board.said("output", "gripper", "180", "--json"))["value"] == 180.0
        assert json.loads(board.said("output", "gripper", "20", "--json"))["value"] == 20.0009  # of counts
        assert " on " in board.said("output", "pump", "on")
        assert board.said("output", "fan", "slow").split()[3:6] == ["slow", "(0.25", "duty)"]
        assert [entry["name"] for entry in json.loads(board.said("output", "--json"))] == [
            "gripper",
            "pump",
            "fan",
        ]
        assert board.said("input").split() == ["part", "PD1", "inactive", "door", "PD3", "inactive"]
        assert json.loads(board.said("input", "door", "--json")) == {
            "name": "door",
            "pin": "PD3",
            "active": False,
        }
        for arguments, words in (
            (("output", "grip", "open"), "no output 'grip'"),
            (("output", "gripper", "ajar"), "no state 'ajar'"),
            (("output", "gripper", "181"), "its range is 0 to 180"),
            (("output", "gripper", "-1"), "cannot take -1"),
            (("output", "pump", "0.5"), "on or off"),
            (("input", "parts"), "no input 'parts'"),
        ):
            assert words in board.refused(*arguments)
        assert "on" in board.said("output", "pump")
    assert widths_us(board.log) == [722, 1556, 2500, 722]  # the last as the program ends
    (cycle,) = edgelog.read(board.log)
    assert list(cycle.pins["D0"][1])[-2:] == [0, 1]  # on, off again; it is active low
    assert [pulses[1:] for pulses in cycle.pulses["B9"]] == [(0, 4200), (1050, 4200), (0, 4200)]


def test_pins_that_collide_never_reach_the_board(tmp_path: Path) -> None:
    with bench(tmp_path) as board:
        board.said("output", "gripper", "closed")
        text = board.arm_file.read_text(encoding="utf-8")
        board.arm_file.write_text(text.replace('"PB8"', '"PE9"'), encoding="utf-8")
        assert "output.gripper: PE9 is taken by the engine for encoder 1" in board.refused(
            "output", "gripper", "open"
        )
        assert "PE9" in board.refused("configure")
        board.arm_file.write_text(text, encoding="utf-8")
        assert "closed" in board.said("output", "gripper")


@contextmanager
def connected(arm_file: Path, port: str) -> Iterator[Board]:
    arm = Arm.load(arm_file)
    with armtempo.connect(port, arm) as board:
        board.home(arm)
        yield board


def test_an_estop_in_a_motion_makes_them_safe(tmp_path: Path) -> None:
    """A motion leaves them as they are; at an E-stop in the next one they are safe, and stay so until it is cleared."""
    fault = InjectedFault("input", at_s=0.3, run=2, name="E15", level=0)
    with bench(tmp_path, fault) as place, connected(place.arm_file, place.port) as board:
        gripper = board.output("gripper")
        gripper.set("closed")
        assert board.arm
        target_deg = [angle + 5.0 for angle in board.arm.home_deg]
        board.goto(target_deg)
        assert gripper.state == "closed"
        with pytest.raises(BoardError, match="E-stop"):
            board.goto(board.arm.home_deg)
        assert gripper.state == "open"
        with pytest.raises(BoardError, match="fault"):
            gripper.set("closed")
    assert widths_us(place.log) == [722, 1556, 722]


def test_from_python_and_through_the_program_that_has_the_port(tmp_path: Path) -> None:
    with bench(tmp_path) as place, connected(place.arm_file, place.port) as board:
        gripper = board.output("gripper")
        gripper.set(90)
        assert gripper.value == pytest.approx(90, abs=0.01)
        assert "closed" in place.said("output", "gripper", "closed")
        assert gripper.state == "closed"
        assert place.said("input", "part").split()[-1] == "inactive"
        assert "its range" in place.refused("output", "gripper", "200")
        part = board.input("part")
        assert not part.read()
        part.wait(active=False, timeout_s=0)
        with pytest.raises(LinkError, match=r"'part' has not become active within 0\.1 s"):
            part.wait(timeout_s=0.1)
        with pytest.raises(InputError, match="no output 'griper'"):
            board.output("griper")
        with armtempo.attach(place.port) as other:
            with pytest.raises(BoardError, match="no output"):
                other.set_output(7, 0)
            assert other.levels().outputs[0] == gripper.raw


def test_an_arm_without_says_so(tmp_path: Path) -> None:
    with launch(LaunchOptions()) as process:
        place = Bench(process.port, Path("paper"), tmp_path)
        assert "has no outputs" in place.armtempo("output").output
        assert "has no inputs" in place.armtempo("input").output
