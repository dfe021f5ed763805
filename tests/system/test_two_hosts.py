"""Two programs at one virtual board: a stop that gets in, a port taken over, and no arm or motion replaced unasked."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from armtempo.cli import main
from armtempo.link.transport import SerialTransport
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import planner
from armtempo.robot.board_state import record_crc
from armtempo.simulator import LaunchOptions, launch
from click.testing import CliRunner, Result

from tests.system import commandline
from tests.system.commandline import small_plan, start

SEED = 1
ORDERS = 30
OTHER_FIGURES = ("microsteps = 8", "microsteps = 16")
HOSTS = ("a", "b")
START, END = (0.0, -60.0, 40.0), (20.0, -75.0, 50.0)


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, list(arguments))


class Two:
    """Two hosts with an arm each, and what the board must hold after all that they did."""

    def __init__(self, folder: Path, port: str) -> None:
        self.port = port
        self.arms, self.files, self.crcs = {}, {}, {}
        text = shipped.arm_path().read_text()
        for host, content in zip(HOSTS, (text, text.replace(*OTHER_FIGURES)), strict=True):
            self.arms[host] = str(folder / f"{host}.toml")
            Path(self.arms[host]).write_text(content)
            arm = Arm.load(self.arms[host])
            self.crcs[host] = record_crc(arm)
            self.files[host] = str(folder / f"{host}.json")
            planner.plan(arm, Job("small", (START, END), population=5, iterations=5, path="through")).save(
                self.files[host]
            )
        self.arm = self.motion = self.default = ""
        self.known = False

    def do(self, what: str, host: str) -> None:
        """One command of a host; what it must end with follows from what was said to the board before."""
        mine = self.arm in ("", host)
        free = self.motion in ("", host)
        command, wanted = {
            "home": (("home", "--arm", self.arms[host]), mine),
            "configure": (("configure", "--arm", self.arms[host]), True),
            "upload": (("upload", self.files[host]), mine and free),
            "default": (("upload", self.files[host], "--default"), mine and free),
            "force": (("upload", self.files[host], "--force"), mine),
            "goto": (("goto", "home", "--arm", self.arms[host]), mine and self.known),
            "stop": (("stop",), True),
            "status": (("status", "--arm", self.arms[host]), True),
        }[what]
        done = run(*command, "--port", self.port)
        assert (done.exit_code == 0) == wanted, f"{what} by {host}: {done.output}"
        if not mine and not wanted:
            assert "set up for a different arm" in done.output
        if wanted:
            self.follow(what, host)

    def follow(self, what: str, host: str) -> None:
        """What the board holds now."""
        if what == "configure" and self.arm != host:
            self.arm, self.known = host, False
        if what in ("home", "upload", "default", "force", "goto"):
            self.arm = host
        if what == "home":
            self.known = True
        if what in ("upload", "default", "force"):
            self.motion = host
        if what == "default":
            self.default = host

    def check(self, said: str) -> None:
        """The board holds just that."""
        state = json.loads(run("status", "--json", "--port", self.port).stdout)
        assert state["virtual"], said
        assert state["arm_crc"] == (self.crcs[self.arm] if self.arm else 0), said
        if self.arm:
            assert {joint["known"] for joint in state["joints"]} == {self.known}, said
        motions = json.loads(run("list", "--json", "--port", self.port).stdout)["motions"]
        assert len(motions) == bool(self.motion), said
        for motion in motions:
            assert motion["default"] == (self.default == self.motion), said


@pytest.mark.long
def test_two_arms_in_every_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    numbers = random.Random(SEED)
    kinds = ("home", "configure", "upload", "default", "force", "goto", "stop", "status")
    with launch(LaunchOptions(tmp_path / "flash")) as board:
        two = Two(tmp_path, board.port)
        said = []
        for _ in range(ORDERS):
            what, host = numbers.choice(kinds), numbers.choice(HOSTS)
            said.append(f"{what} {host}")
            two.do(what, host)
            two.check(f"seed {SEED}: {', '.join(said)}")


@contextmanager
def moving(folder: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A program that runs a long motion on a virtual board in real time, and the port."""
    plan = planner.plan(
        Arm.paper(), Job("long", (START, (170.0, -10.0, -50.0)), population=5, iterations=5, path="through")
    )
    plan.save(folder / "long.json")
    with launch(LaunchOptions(folder / "flash", virtual_time=False, instant_flash=True)) as board:
        commandline.ended(start("home", "--arm", "paper", "--port", board.port, folder=folder))
        owner = start("run", "long.json", "--speed", "10", "--port", board.port, folder=folder)
        try:
            samples = folder / "runs" / "long-001" / "samples-01.csv"
            commandline.wait_for(lambda: samples.exists() and samples.read_text().count("\n") > 2, "samples")
            yield owner, board.port
        finally:
            owner.kill()
            owner.communicate()


@pytest.mark.parametrize(
    "now", [(), pytest.param(("--now",), marks=pytest.mark.long)], ids=["brake", "freeze"]
)
def test_a_stop_gets_in_and_the_run_says_who_asked(now: tuple[str, ...], tmp_path: Path) -> None:
    with moving(tmp_path) as (owner, port):
        looked = commandline.run("status", "--port", port, folder=tmp_path)
        assert looked.exit_code == 0, looked.errors
        assert "state     moving" in looked.output
        refused = commandline.run("clear", "--port", port, folder=tmp_path)
        assert refused.exit_code == 1
        refused.said("is in use by", "process")
        stopped = commandline.run("stop", *now, "--port", port, folder=tmp_path)
        assert stopped.exit_code == 0, stopped.errors
        stopped.said("frozen" if now else "braking", "through")
        ended = commandline.ended(owner)
        assert ended.exit_code == 130, ended.errors
        ended.said("'armtempo stop' asked for a stop")


@pytest.mark.long
def test_a_program_that_hangs_loses_the_port(tmp_path: Path) -> None:
    with moving(tmp_path) as (owner, port):
        owner.send_signal(signal.SIGSTOP)
        refused = commandline.run("goto", "home", "--arm", "paper", "--port", port, folder=tmp_path)
        assert refused.exit_code == 1
        refused.said("does not answer, and the arm moves", "armtempo stop", f"end process {owner.pid} first")
        stopped = commandline.run("stop", "--port", port, folder=tmp_path)
        assert stopped.exit_code == 0, stopped.errors
        stopped.said("does not answer", "taking the port over")
        assert "state     moving" not in stopped.output
        owner.send_signal(signal.SIGCONT)
        ended = commandline.ended(owner)
        assert ended.exit_code == 1, ended.errors
        ended.said("has taken", "over")


@pytest.mark.long
def test_a_program_that_died_gives_the_port_free(tmp_path: Path) -> None:
    with moving(tmp_path) as (owner, port):
        owner.kill()
        owner.wait()
        stopped = commandline.run("stop", "--port", port, folder=tmp_path)
        assert stopped.exit_code == 0, stopped.errors
        stopped.said("has ended without closing", "may still run")
        assert "state     moving" not in stopped.output


def test_a_command_waits_for_one_that_is_about_to_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A port that another program has for a moment: both wait, what needs the port and what would look on."""
    with launch(LaunchOptions(tmp_path / "flash")) as board:
        for words in (("clear",), ("status",), ("stop",)):
            held = SerialTransport(board.port)
            timer = threading.Timer(0.5, held.close)
            timer.start()
            done = commandline.run(*words, "--port", board.port, folder=tmp_path)
            timer.join()
            assert done.exit_code == 0, done.errors
        held = SerialTransport(board.port)
        try:
            refused = commandline.run("status", "--port", board.port, folder=tmp_path)
        finally:
            held.close()
        assert refused.exit_code == 1
        refused.said("is in use by another program")


def test_a_run_and_commands_that_only_ask_share_a_port(tmp_path: Path) -> None:
    """Others look in all the time while a run starts: it gets the port, and they are answered."""
    small_plan(tmp_path / "small.json")
    with launch(LaunchOptions(tmp_path / "flash")) as board:
        assert commandline.run("home", "--arm", "paper", "--port", board.port, folder=tmp_path).exit_code == 0
        ended = threading.Event()
        answers: list[commandline.Ended] = []

        def ask() -> None:
            while not ended.is_set():
                answers.append(commandline.run("status", "--port", board.port, folder=tmp_path))

        asking = threading.Thread(target=ask)
        asking.start()
        try:
            run = commandline.run("run", "small.json", "--port", board.port, folder=tmp_path)
        finally:
            ended.set()
            asking.join()
        assert run.exit_code == 0, run.errors
        assert answers
        for answer in answers:
            assert answer.exit_code == 0, answer.errors
