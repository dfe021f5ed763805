"""The wear of the flash: the virtual board's file system against MicroPython's own, a day of use, what is shown."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.encoding import encode, encoded_plan
from armtempo.encoding.encoded_plan import Encoded
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point
from armtempo.robot.connect import connect
from armtempo.robot.store import store
from armtempo.simulator import LaunchOptions, launch, launcher

from tests import scripted
from tests.system import commandline
from tests.system.test_whole_board import HOME_STEPS, PROGRAM

CASES = Path(__file__).parent / "scripts" / "cases"
FEWER = "10"
SEEDS = (20261127, 7, 99)
ARM = Arm.paper()
HOME_DEG = np.array(ARM.home_deg)


@scripted.each(scripted.cases(CASES / "flash_blocks.py"))
@pytest.mark.parametrize("seed", SEEDS)
def test_it_writes_the_blocks_that_micropythons_own_writes(case: scripted.Case, seed: int) -> None:
    case.run(str(seed))


def way(name: str, *by_deg: list[float]) -> Encoded:
    """A short motion between two postures, given by their distances from home."""
    start, end = (HOME_DEG + np.array(away) for away in by_deg)
    return encoded_plan.of_trajectory(point_to_point.straight(name, start, end, ARM), ARM)


@pytest.fixture
def day(tmp_path: Path) -> Path:
    """Flash and records for the case."""
    home, near, far = [0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.1, -0.2]
    feed = way("feed", home, [0.15, 0.1, 0.1])
    records = {
        "there": way("there", home, near).data,
        "back": way("back", near, home).data,
        "far": way("far", home, far).data,
        "near": way("near", far, home).data,
        "feed": feed.data,
        "food": way("feed", home, [0.1, 0.1, 0.1]).data,
        "way": encoded_plan.way_back(feed),
    }
    for number in range(2):
        safety = replace(ARM.safety, link_timeout_ms=ARM.safety.link_timeout_ms + 1 + number)
        records[f"arm{number}"] = encode.arm_record(replace(ARM, safety=safety))
    for name, data in records.items():
        (tmp_path / "day").mkdir(exist_ok=True)
        (tmp_path / "day" / name).write_bytes(data)
    (tmp_path / "finish" / "armtempo").mkdir(parents=True)
    (tmp_path / "finish" / "armtempo" / "arm.ata").write_bytes(encode.arm_record(ARM))
    return tmp_path


@pytest.mark.long
@scripted.each(scripted.cases(CASES / "flash_day.py"))
def test_a_day(case: scripted.Case, day: Path) -> None:
    """A tenth of its moves, all that it stores; each kind's erasures are counted in the case."""
    case.run(str(day), PROGRAM, ",".join(map(str, HOME_STEPS)), FEWER)
    counted = json.loads((day / "finish.erasures").read_text())
    assert set(counted) <= {"1", "2", "3", "4"}


@pytest.mark.long
def test_status_shows_erasures_and_moves_add_none(tmp_path: Path) -> None:
    port = f"sim:{tmp_path / 'board'}"
    with connect(port) as board:
        board.home(ARM)
        store(board.client, way("feed", [0.0, 0.0, 0.0], [1.0, 0.5, 0.5]).records)
        before = board.state().erasures
        assert set(before) == {"1", "2"}
        board.jog(ARM.driven[0].name, by_deg=0.5)
        with board.held_jog(ARM.driven[0].name) as held:
            held.hold(0.2)
        board.goto(HOME_DEG)
        board.goto(HOME_DEG + 2.0, line=True)
        board.goto(HOME_DEG)
        board.run("feed", out=tmp_path, repeat=3)
        assert board.state().erasures == before
        assert [entry.name for entry in board.list()] == ["feed"]
    shown = commandline.run("status", "--port", port, folder=tmp_path).output
    assert f"sector of the flash: 1: {before['1']}, 2: {before['2']};" in shown


def test_a_virtual_board_in_another_terminal_shows_them_too(tmp_path: Path) -> None:
    with launch(LaunchOptions(tmp_path / "flash")) as process, connect(process.port) as board:
        assert board.state().erasures
    assert not launcher.erasures(process.port)
