"""Users' programs on the virtual board: the page's example, pins; how programs end on MicroPython; commands."""

from __future__ import annotations

import itertools
import json
import re
from dataclasses import replace
from pathlib import Path

import armtempo
import numpy as np
import pytest
from armtempo.basics.errors import BoardError
from armtempo.cli import state
from armtempo.encoding import encode
from armtempo.robot.stop_request import Stopped, StopRequest
from armtempo.simulator import LaunchOptions, edgelog, launch

from tests import interpreters
from tests.host.test_user_program import HEAD, example
from tests.system import commandline
from tests.system.sequences import ARM, FOLDER, GRIPPER, SHIPPED, part_lies_there
from tests.system.test_virtual_arm import step_signs

INTERPRETERS = [name for name in interpreters.AVAILABLE if name != "micropython-arm"]


def options(interpreter: str, **more: object) -> LaunchOptions:
    return LaunchOptions(arm=ARM, interpreter=interpreters.starter(interpreter), **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", INTERPRETERS[-1:])
def test_pick_and_place(name: str, tmp_path: Path) -> None:
    """The example; a part lies there always, so it is stopped after the first one. Joints have backlash, which the
    steps on the pins cross."""
    joints = [
        replace(joint, motor=joint.motor and replace(joint.motor, backlash_deg=0.3)) for joint in ARM.joints
    ]
    arm = replace(ARM, joints=tuple(joints))
    path = example("pick_place.py", tmp_path)
    stop, said = StopRequest(), []

    def listen(text: str) -> None:
        said.append(text)
        if text == "part 1":
            stop.ask("the test")

    edges = tmp_path / "edges"
    with (
        launch(options(name, faults=[part_lies_there()], edge_log=edges)) as process,
        armtempo.connect(process.port, arm) as board,
    ):
        board.home(arm)
        board.goto([5.0, -58.0, 42.0])  # the part lies there from this motion on
        with pytest.raises(Stopped):
            board.run_program(path, listen, stop=stop)
        assert board.counters == {"parts": 1}
        (line,) = [line for line in state.lines(board.state()) if line.startswith("program   pick_place")]
        assert re.fullmatch(r"program   pick_place\.py: stopped, line \d+; parts 1", line)
        (listed,) = board.list()
        assert listed.program
        assert not listed.sequence
        stands_deg = board.posture_deg()
    assert said == ["part 1"]
    (power,) = edgelog.read(edges)
    for joint, row, at_deg in zip(arm.driven, encode.backlash(arm), stands_deg, strict=True):
        signs, moved = step_signs(power, joint), (at_deg - joint.home_deg) * joint.steps_per_deg
        assert np.count_nonzero(np.diff(signs)) > 1, joint.name
        crossed = row["steps"] * (signs[-1] - signs[0]) / 2
        assert signs.sum() - crossed == pytest.approx(moved, abs=0.6), joint.name
    widths = [width for width, _ in itertools.groupby(p.high_ticks for p in power.pulses[GRIPPER]) if width]
    opened, closed = widths[0], max(widths)
    assert widths[:3] == [opened, closed, opened]


ENDINGS = {
    "raises": (
        "def move():\n    cell.goto([60, -50, 40], wait=False)\n    cell.sleep(0.3)\n    return [][3]\n\nmove()\n",
        "program_failed",
        5,
        "IndexError",
    ),
    "fills": (
        "cell.goto([60, -50, 40], wait=False)\nkeep = []\nwhile True:\n    keep.append(bytearray(1 << 20))\n",
        "program_failed",
        5,
        "MemoryError",
    ),
    "blocks": (
        "import time\ncell.goto([60, -50, 40], wait=False)\ncell.sleep(0.2)\ntime.sleep_us(300000)\nprint(1)\n",
        "underrun",
        4,
        "",
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in INTERPRETERS if name != "cpython"])
def test_how_programs_end_on_micropython(name: str, tmp_path: Path) -> None:
    """An exception, a full heap, a call that lasts: the arm stops on its way, its position is known."""
    with launch(options(name)) as process, armtempo.connect(process.port, ARM) as board:
        board.home(ARM)
        for stem, (source, fault, line, word) in ENDINGS.items():
            (tmp_path / f"{stem}.py").write_text(HEAD + source)
            said: list[str] = []
            with pytest.raises(BoardError, match=f"in line {line}") as raised:
                board.run_program(tmp_path / f"{stem}.py", said.append)
            found = board.state()
            assert found.fault == fault, (stem, raised.value)
            assert all(joint.known for joint in found.joints)
            assert 0.0 <= board.posture_deg()[0] < 60.0
            assert [text for text in said if f'"{stem}.py", line {line}' in text and word in text] or not word
            board.clear()
            board.goto("home")
        (tmp_path / "makes.py").write_text(
            HEAD + "cell.goto([60, -50, 40], wait=False)\nn = 0\n"
            "while cell.moving():\n    rows = [bytearray(1000) for _ in range(20)]\n    n += 1\nprint(n > 100)\n"
        )
        said = []
        assert board.run_program(tmp_path / "makes.py", said.append).ending == "finished"
        assert said == ["True"]


def test_commands_around_a_program(tmp_path: Path) -> None:
    """An endless loop without a call: 'status' has its line, 'stop' ends it; 'run' starts what is stored."""
    (tmp_path / "pick.py").write_text(HEAD + "print('begins')\nwhile True:\n    pass\n")
    arm = FOLDER / "arm.toml"
    with launch(LaunchOptions(arm=SHIPPED, interpreter=interpreters.starter("cpython"))) as process:
        port = {"ARMTEMPO_PORT": process.port}
        with armtempo.connect(process.port, SHIPPED) as board:
            board.home(SHIPPED)
            key = board.upload_program(tmp_path / "pick.py")
            board.client.start(key.name, key.crc)
            for _ in range(2):
                with pytest.raises(BoardError, match="the board is moving"):
                    board.client.start(key.name, key.crc)
            with pytest.raises(BoardError, match="the board is moving"):
                board.client.upload("other", b"x" * 100)
        told = json.loads(commandline.run("status", "--json", folder=tmp_path, **port).output)["sequence"]
        assert (told["name"], told["ending"], told["step"]) == ("pick.py", "running", 3)
        assert commandline.run("stop", folder=tmp_path, **port).exit_code == 0
        done = commandline.run(
            "upload", "pick.py", "--name", "pack", "--arm", arm, "--default", folder=tmp_path, **port
        )
        assert (done.exit_code, "has the name of its file" in done.errors) == (2, True)
        done = commandline.run("upload", "pick.py", "--arm", arm, "--default", folder=tmp_path, **port)
        assert (done.exit_code, "bytes stored" in done.output) == (0, True), done.errors
        done = commandline.run("list", folder=tmp_path, **port)
        assert re.search(r"pick \* +\d+ +program ", done.output)
        with armtempo.connect(process.port, SHIPPED) as board:
            assert board.client.sequence().ending == "stopped"
            board.configure(SHIPPED)
            (tmp_path / "pick.py").write_text(HEAD + "print('new')\n")
            board.upload_program(tmp_path / "pick.py")
        done = commandline.run("run", "pick", "--arm", arm, folder=tmp_path, **port)
        assert (done.exit_code, "new" in done.output, "finished" in done.output) == (0, True, True), (
            done.errors
        )
        (tmp_path / "pick.py").write_text(HEAD + "import asyncio\nasyncio.sleep(0)\n")
        assert commandline.run("program", "pick.py", "--arm", arm, folder=tmp_path, **port).exit_code == 1
        for _ in range(2):
            done = commandline.run("status", folder=tmp_path, **port)
            assert re.search(
                r'^said +File "pick.py", line 3.*\n +ImportError: asyncio', done.output, re.MULTILINE
            )
        assert commandline.run("clear", folder=tmp_path, **port).exit_code == 0
        assert "said" not in commandline.run("status", folder=tmp_path, **port).output
