"""What users get wrong, and boards that do not answer: one message saying what to do, never a traceback."""

from __future__ import annotations

import os
import pty
from collections.abc import Callable
from pathlib import Path

import pytest
from armtempo import simulator
from armtempo.link import open_board
from armtempo.model import shipped

from tests.system import commandline

ANSWERS_WITHIN_S = 30.0
"""Far more than the 2 s in which a silent board is given up, for loaded machines."""
SHIPPED = {"job": shipped.job_path(), "arm": shipped.arm_path()}
WRONG_FILES = {
    "no via point": ("job", None, "via_deg = []", "via_deg = []", "at least 2"),
    "one via point": ("job", None, "via_deg = [[0.0, -60.0, 40.0]]", "1 via point", "at least 2"),
    "NaN": ("job", "[90.0, -85.0, 40.0]", "[90.0, nan, 40.0]", "via_deg P3", "nan"),
    "unknown key": ("job", "degree = 5", "degree = 5\nsped = 3", "sped: unknown key", "did you mean"),
    "negative limit": (
        "arm",
        "speed_deg_s = 40.0",
        "speed_deg_s = -40.0",
        "speed_deg_s = -40.0 is not allowed",
        "at least 0.001",
    ),
}


@pytest.mark.parametrize(("kind", "old", "new", "what", "cure"), WRONG_FILES.values(), ids=list(WRONG_FILES))
def test_a_wrong_file(kind: str, old: str | None, new: str, what: str, cure: str, tmp_path: Path) -> None:
    text = SHIPPED[kind].read_text(encoding="utf-8")
    old = old or text[text.index("via_deg") :]
    assert old in text
    (tmp_path / "wrong.toml").write_text(text.replace(old, new), encoding="utf-8")
    done = commandline.run(
        "plan", f"--{kind}", "wrong.toml", *(("--arm", "paper") if kind == "job" else ()), folder=tmp_path
    )
    done.said("wrong.toml", what, cure)
    assert done.exit_code == 2
    assert [path.name for path in tmp_path.iterdir()] == ["wrong.toml"]


def test_a_trajectory_file_cut_in_half(plan_file: Callable[[str], Path], tmp_path: Path) -> None:
    whole = plan_file("shipped").read_bytes()
    (tmp_path / "half.json").write_bytes(whole[: len(whole) // 2])
    done = commandline.run("run", "half.json", folder=tmp_path)
    done.said("half.json", "damaged or cut", "plan it again")
    assert done.exit_code == 2
    assert [path.name for path in tmp_path.iterdir()] == ["half.json"]


def test_a_port_that_does_not_exist(tmp_path: Path) -> None:
    done = commandline.run("status", "--port", "/dev/no-such-port", folder=tmp_path)
    done.said("there is no port /dev/no-such-port", "armtempo ports")
    assert done.exit_code == 2


def test_a_port_in_use(tmp_path: Path) -> None:
    with simulator.launch() as board, open_board(board.port):
        done = commandline.run("status", "--port", board.port, folder=tmp_path)
    done.said(f"port {board.port} is in use", "close it")
    assert done.exit_code == 1


def test_a_board_that_does_not_answer(tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    try:
        command = commandline.start("status", "--port", os.ttyname(theirs), folder=tmp_path)
        done = commandline.ended(command, ANSWERS_WITHIN_S)
    finally:
        os.close(ours)
        os.close(theirs)
    done.said("does not answer within 2 s", "check the cable", "reset a board that hangs")
    assert done.exit_code == 1
