"""How many calls a start passes from the public call to the bytes, on a board in the same process."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.cli.jog_screen import JogScreen
from armtempo.encoding import encoded_plan
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point
from armtempo.robot.board import Board
from armtempo_shared import wire

from tests.host.test_jog_keys import Typed
from tests.inprocess import Pipe, connect

START = wire.COMMAND["start"][1]
ARM = Arm.paper()
WRAPPERS = ("basics.arguments", "robot.board")
"""They check arguments, and hand the names of the library on."""
MOST_OF_A_KEY = 6


class Listening(Pipe):
    """A pipe that notes who calls whom when a start is written."""

    def __init__(self, root: Path) -> None:
        self.starts: list[list[str]] = []
        super().__init__(root)

    def write(self, data: bytes) -> None:
        if data[4] == START:
            self.starts.append(callers())
        super().write(data)


def callers() -> list[str]:
    """The functions of armtempo that are being called, "module.function", from the outermost on."""
    found: list[str] = []
    frame: Any = sys._getframe(1)
    while frame:
        name = frame.f_globals["__name__"]
        if name.startswith("armtempo.") and (short := name.removeprefix("armtempo.")) not in WRAPPERS:
            found.insert(0, f"{short}.{frame.f_code.co_name}")
        frame = frame.f_back
    return found


@pytest.fixture
def made(tmp_path: Path) -> tuple[Board, Listening]:
    """A board with an arm at home, and its pipe."""
    pipe = Listening(tmp_path / "flash")
    pipe.run_samples = 3
    board = Board(connect(pipe), "pipe")
    board.configure(ARM, replace=True)
    board.home(ARM)
    return board, pipe


def modules(calls: list[str]) -> list[str]:
    """Their modules, each once in a row."""
    return list(dict.fromkeys(call.rpartition(".")[0] for call in calls))


def test_a_start_goes_from_board_to_client_to_session(made: tuple[Board, Listening], tmp_path: Path) -> None:
    board, pipe = made
    move = point_to_point.straight("move", ARM.home_deg, np.array(ARM.home_deg) + 1.0, ARM)
    board.run(encoded_plan.of_trajectory(move, ARM), out=tmp_path / "runs")
    (calls,) = pipe.starts
    assert modules(calls) == ["robot.motions", "link.client", "link.session"]


def test_a_jog_key_passes_few_modules(made: tuple[Board, Listening]) -> None:
    """On the way to the start; what is planned and encoded before returns to them."""
    board, pipe = made
    JogScreen(board, Typed())._act("+")  # type: ignore[arg-type]
    (calls,) = pipe.starts
    assert len(modules(calls)) <= MOST_OF_A_KEY, calls
