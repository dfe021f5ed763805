"""Jog and teach on the virtual board: by step, held and released, cut off, at a terminal's keys."""

from __future__ import annotations

import os
import random
import re
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import armtempo
import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.cli import main
from armtempo.cli.teach import TaughtPoints, by_hand
from armtempo.link.board_messages import Notice
from armtempo.model import shipped
from armtempo.simulator import LaunchOptions, launch
from click.testing import CliRunner

from tests.system import commandline
from tests.system.relay import KINDS, HeldCase, HeldJogs

PAPER = armtempo.Arm.paper()
SEED = 5
CASES = 8


@contextmanager
def homed() -> Iterator[str]:
    """The port of a virtual board whose arm is homed."""
    with launch(LaunchOptions(arm=PAPER)) as virtual:
        with armtempo.connect(virtual.port, PAPER) as board:
            board.home(PAPER)
        yield virtual.port


def jogged(port: str, *arguments: str, code: int = 0) -> str:
    """What the command says."""
    result = CliRunner().invoke(main, ["jog", *arguments, "--arm", "paper", "--port", port])
    assert result.exit_code == code, result.output
    return result.output


def where(port: str) -> np.ndarray:
    """The arm's posture, (J,)."""
    with armtempo.connect(port, PAPER) as board:
        board.configure(PAPER)
        return board.posture_deg()


@pytest.mark.long
def test_steps_by_the_command_line() -> None:
    with launch(LaunchOptions(arm=PAPER)) as virtual:
        assert "is unknown" in jogged(virtual.port, "--joint", "1", "--by", "5", code=1)
    with homed() as port:
        jogged(port, "--joint", "2", "--by", "-5")
        assert "--to needs --joint, without --by" in jogged(port, "--axis", "x", "--to", "5", code=2)
        jogged(port, "--joint", "2", "--to", str(PAPER.home_deg[1]))
        jogged(port, "--joint", "2", "--by", "-5")
        np.testing.assert_allclose(where(port), [0.0, -65.0, 40.0], atol=0.02)
        before = armtempo.forward(PAPER, where(port))[:3, 3]
        jogged(port, "--axis", "z", "--by", "10", "--speed", "100")
        np.testing.assert_allclose(
            armtempo.forward(PAPER, where(port))[:3, 3] - before, [0.0, 0.0, 10.0], atol=0.3
        )
        said = jogged(port, "--joint", "joint 2", "--by", "-1000", "--speed", "100", code=1)
        assert "ended early: joint 2 is at the end of its range, -170 degrees" in said
        assert where(port)[1] == pytest.approx(-170.0, abs=0.02)
        assert where(port)[1] >= -170.0
        assert "end of its range" in jogged(port, "--joint", "2", "--by", "-1", code=2)
        for wrong in (("--joint", "2"), ("--by", "2"), ("--joint", "2", "--axis", "x", "--by", "1")):
            assert "--by needs" in jogged(port, *wrong, code=2)
        assert "cannot turn the tool" in jogged(port, "--about", "x", "--by", "5", code=2)
        assert "needs a terminal" in jogged(port, code=2)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_held_jogs_rest_within_the_stated_time_and_the_range(tmp_path: Path, kind: str) -> None:
    print("seed", SEED)
    rng = random.Random(SEED)
    cases = [case for case in (HeldCase.random(rng) for _ in range(400)) if case.kind == kind]
    with HeldJogs.open(tmp_path) as jogs:
        ends = [(case, jogs.run(case)) for case in cases[: CASES // len(KINDS)]]
    assert any(end for _, end in ends)
    for case, end in ends:
        assert end is None or end.good, (case, end)


@pytest.mark.long
def test_the_same_from_python() -> None:
    with homed() as port, armtempo.connect(port, PAPER) as board:
        board.configure(PAPER)
        before = board.posture_deg()
        np.testing.assert_allclose(board.jog(joint=1, by_deg=5) - before, [5, 0, 0], atol=0.02)
        with board.held_jog(joint="joint 1", direction=-1) as held:
            assert held.hold(0.5)
            assert held.moving
        assert not held.moving
        assert board.posture_deg()[0] < 5.0
        assert held.angles_deg == pytest.approx(board.posture_deg())
        assert board.list() == ()
        with pytest.raises(InputError, match="joint by degrees"):
            board.jog(joint=1, by_mm=5)
        for _ in range(2):  # the second time it is there
            assert board.jog_to(2, before[1] + 3.0)[1] == pytest.approx(before[1] + 3.0, abs=0.02)
        board.jog_to(2, before[1])
        tray = armtempo.Pose.of_angles([50, 200, 100], {"roll": 5, "pitch": -10, "yaw": 90})
        board.configure(replace(PAPER, frames=(armtempo.ArmFrame("tray", tray.matrix),)))
        here = armtempo.forward(PAPER, board.posture_deg())[:3, 3]
        axes = board.arm.frame("tray")
        local = axes[:3, :3].T @ (here - axes[:3, 3]) + [0, 4, -3]
        board.goto(board.arm.in_base(armtempo.Pose.of_angles(local, {}), "tray"))
        there = armtempo.forward(PAPER, board.posture_deg())[:3, 3]
        assert there - here == pytest.approx(axes[:3, :3] @ [0, 4, -3], abs=0.4)
        board.jog(axis="tray-x", by_mm=5)
        gone = armtempo.forward(PAPER, board.posture_deg())[:3, 3] - there
        assert gone == pytest.approx(5 * axes[:3, 0], abs=0.4)
        board.jog_to(2, before[1])
        with pytest.raises(InputError, match="drives no joint 9"):
            board.jog_to(9, 5.0)
        with board.held_jog(joint=1) as held:
            board.client.stop()
            while held.hold():
                pass


def test_the_shortest_press_moves_a_step_and_what_ends_by_itself_says_why() -> None:
    with homed() as port, armtempo.connect(port, PAPER) as board:
        board.configure(PAPER)
        before = board.posture_deg()
        with board.held_jog(joint=1, speed=0.01) as held:
            pass
        step_deg = 1 / PAPER.driven[0].steps_per_deg
        assert 0.9 * step_deg < board.posture_deg()[0] - before[0] < 0.5
        assert not held.ends
        with board.held_jog(joint=1, speed=0.05) as held:
            held.hold(0.2)
            time.sleep(0.8)  # a slow host
            while held.hold():
                pass
        assert re.match(r"this program was busy for \d\.\d s", held.ends)
        board.jog(joint=1, by_deg=PAPER.driven[0].range_deg[1] - board.posture_deg()[0] - 0.5)
        with board.held_jog(joint=1) as held:
            while held.hold():
                pass
        assert "joint 1 is at the end of its range" in held.ends
        with board.held_jog(joint=1, direction=-1) as held:
            held.hold(0.2)
            board.client.stop()
            while held.hold():
                pass
        assert "stopped, or no hold reached the board" in held.ends


def test_by_hand_the_position_comes_from_the_encoders() -> None:
    with homed() as port, armtempo.connect(port, PAPER) as board:
        board.configure(PAPER)
        board.jog(joint=1, by_deg=5)
        before = board.posture_deg()
        with board.by_hand() as guided:
            assert board.status().known == 0
            np.testing.assert_allclose(guided.angles_deg(), before, atol=0.2)
            with pytest.raises(armtempo.LinkError, match="unknown"):
                board.jog(joint=1, by_deg=1)
        np.testing.assert_allclose(board.posture_deg(), before, atol=0.2)
        board.jog(joint=1, by_deg=1)


def test_the_boards_button_takes_a_point() -> None:
    """A press is told by a notice; those from before do not count, and other notices are none."""
    with homed() as port, armtempo.connect(port, PAPER) as board:
        board.configure(PAPER)
        board.client.session.events.append(Notice("button: error 9"))
        with board.by_hand() as guided:
            assert not guided.button_pressed()
            points = TaughtPoints(PAPER, guided.angles_deg)
            presses = iter([Notice("a traceback"), Notice("button: error 9"), None])

            class Quiet:
                """No key is pressed before the button was."""

                def flush(self) -> None:
                    """There are none."""

                def read(self, timeout_s: float) -> str:
                    event = next(presses)
                    if event is None:
                        return "q"
                    board.client.session.events.append(event)
                    return ""

            by_hand(Quiet(), points, guided.button_pressed)
            assert len(points.points_deg) == 1
            assert points.points_deg[0] == pytest.approx(list(guided.angles_deg()), abs=0.01)


class Terminal:
    """An armtempo command at a terminal of its own."""

    def __init__(self, *arguments: str, folder: Path) -> None:
        import pty

        self._master, slave = pty.openpty()
        self.errors = folder / "errors.txt"
        with self.errors.open("w") as errors:
            self.process = subprocess.Popen(
                [*commandline.COMMAND, *arguments],
                cwd=folder,
                stdin=slave,
                stdout=slave,
                stderr=errors,
                start_new_session=True,
            )
        os.close(slave)
        self.shown = ""

    def look(self, seconds: float) -> None:
        """Take what it shows."""
        until_s = time.monotonic() + seconds
        while (left_s := until_s - time.monotonic()) > 0:
            if select.select([self._master], [], [], left_s)[0]:
                try:
                    self.shown += os.read(self._master, 4096).decode(errors="replace")
                except OSError:  # it has ended
                    return

    def wait_for(self, text: str) -> None:
        """Until it shows ``text``, from the last time on."""
        limit_s = time.monotonic() + commandline.SLOW_S
        while text not in self.shown:
            assert time.monotonic() < limit_s, (text, self.shown)
            assert self.process.poll() is None or text in self.shown, (text, self.shown)
            self.look(0.1)
        self.shown = self.shown.partition(text)[2]

    def press(self, keys: str) -> None:
        """Press keys."""
        os.write(self._master, keys.encode())

    def vanish(self) -> int:
        """The window is closed; the exit code."""
        os.close(self._master)
        return self.process.wait(commandline.SLOW_S)

    def end(self) -> int:
        """Its exit code."""
        limit_s = time.monotonic() + commandline.SLOW_S
        while self.process.poll() is None and time.monotonic() < limit_s:
            self.look(0.1)
        self.look(0.2)
        os.close(self._master)
        return self.process.wait(1)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo terminals")
def test_keys_move_the_arm_in_steps_and_while_held(tmp_path: Path) -> None:
    with homed() as port:
        screen = Terminal("jog", "--arm", "paper", "--port", port, folder=tmp_path)
        screen.wait_for("joint 1, step 1°, 25 % | 0.00 -60.00 39.99°")
        screen.press("2")
        screen.wait_for("joint 2, step 1°")
        screen.press("\x1b[C")
        screen.wait_for("| 0.00 -59.00 39.99°")
        screen.press("s+")
        screen.wait_for("step 10°, 25 % | 0.00 -48.99 39.99°")
        screen.press("z")
        screen.wait_for("tool along z, step 10 mm")
        screen.press("k")
        screen.wait_for("the key 'k' does nothing here")
        screen.press("1h")
        screen.wait_for("joint 1, held")
        screen.press("+")
        screen.wait_for("hold the key down")
        before = screen.shown
        limit_s = time.monotonic() + commandline.SLOW_S
        while "moving; after release at rest within" not in screen.shown and time.monotonic() < limit_s:
            screen.press("+")
            screen.look(0.05)
        assert "moving; after release" in screen.shown, before
        screen.look(2.0)
        screen.press("q")
        assert screen.end() == 0, screen.shown
        assert "position:" in screen.shown
        joint_1, joint_2, _ = where(port)
        assert 0.0 < joint_1 < 190.0
        assert joint_2 == pytest.approx(-49.0, abs=0.02)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo terminals")
def test_a_terminal_that_vanishes_ends_it_with_the_arm_at_rest(tmp_path: Path) -> None:
    with homed() as port:
        screen = Terminal("jog", "--arm", "paper", "--port", port, folder=tmp_path)
        screen.wait_for("joint 1, step 1°")
        assert screen.vanish() == 1
        assert "Traceback" not in screen.errors.read_text()
        np.testing.assert_allclose(where(port), [0, -60, 40], atol=0.02)


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo terminals")
def test_teach_collects_points_into_a_job_that_plans(tmp_path: Path) -> None:
    with homed() as port:
        arguments = ("teach", "shelf.toml", "--arm", "paper", "--port", port)
        screen = Terminal(*arguments, folder=tmp_path)
        screen.wait_for("p            take a point")
        screen.wait_for("joint 1, step 1°")
        screen.press("p")
        screen.wait_for("point 1 taken: 0, -60, 39.99")
        screen.press("p")
        screen.wait_for("not taken: the arm is at")
        screen.press("s+")
        screen.wait_for("| 10.01 -60.00")
        screen.press("pu")
        screen.wait_for("point 2 removed")
        screen.press("p")
        screen.wait_for("point 2 taken")
        screen.press("q")
        assert screen.end() == 0, screen.shown
        assert "written: shelf.toml, 2 via points" in screen.shown
        assert Terminal(*arguments, folder=tmp_path).end() == 2  # it already exists
        hand = Terminal(*arguments, "--replace", "--by-hand", folder=tmp_path)
        hand.wait_for("hold the arm")
        hand.press("\n")
        hand.wait_for("0 points |")
        hand.press("p")
        hand.wait_for("point 1 taken")
        hand.press("q")
        assert hand.end() == 2, hand.shown  # one point is no motion; what was taught is said
        assert "[[via]]" in hand.errors.read_text()
        assert where(port)[0] == pytest.approx(10.0, abs=0.2)
    done = commandline.run("plan", "--job", "shelf.toml", "--arm", "paper", "-o", "x.json", folder=tmp_path)
    assert done.exit_code == 0, done.errors
    assert armtempo.Plan.load(tmp_path / "x.json").job.name == "shelf"


def test_a_joint_without_an_encoder_cannot_be_taught_by_hand(tmp_path: Path) -> None:
    text = shipped.arm_path().read_text()
    start = text.index("encoder = {")
    path = tmp_path / "arm.toml"
    path.write_text(text[:start] + text[text.index("\n", start) :])
    arm = armtempo.Arm.load(path)
    with launch(LaunchOptions(arm=arm)) as virtual, armtempo.connect(virtual.port, arm) as board:
        board.home(arm)
        with pytest.raises(InputError, match="joint 1: no encoder"):
            board.by_hand()
        assert board.status().known == 0b111


# a posture is taught, and gone to by name


TAUGHT_DEG = (5.0, -61.0, 41.0)


def test_a_posture_is_taught_and_gone_to_by_name(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(shipped.arm_path().read_text())
    with launch(LaunchOptions(arm=armtempo.Arm.load(path))) as virtual:

        def run(*arguments: str, code: int = 0) -> str:
            result = CliRunner().invoke(main, [*arguments, "--arm", str(path), "--port", virtual.port])
            assert result.exit_code == code, result.output
            return result.output

        assert "is unknown" in run("teach", "--posture", "rack", code=1)
        run("home")
        run("goto", ",".join(map(str, TAUGHT_DEG)))
        assert "joint 1 5.01°, joint 2 -61°" in run("teach", "--posture", "rack")
        assert "[posture.rack]" in path.read_text()
        assert "did you mean 'rack'" in run("goto", "rak", code=2)
        run("goto", "home")
        assert "--replace" in run("teach", "--posture", "rack", code=2)
        run("goto", "rack")
        run("teach", "--posture", "rack", "--replace")
        arm = armtempo.Arm.load(path)
        with armtempo.connect(virtual.port, arm) as board:
            board.configure(arm)
            np.testing.assert_allclose(board.posture_deg(), TAUGHT_DEG, atol=0.02)
            board.goto("home")
            np.testing.assert_allclose(board.posture_deg(), arm.home_deg, atol=0.01)
            with pytest.raises(armtempo.InputError, match="did you mean 'rack'"):
                board.goto("rck")
