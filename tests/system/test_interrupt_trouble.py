"""Interrupts that meet a board that has fallen silent, or a user in a hurry."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from armtempo import simulator
from armtempo.link import open_board
from armtempo.model.arm import Arm
from armtempo.robot import arm_state
from armtempo.runs import reader
from armtempo.simulator import InjectedFault

from tests.system import commandline

ENDS_WITHIN_S = 60.0
"""Far more than braking and freezing may take, for loaded machines."""


@contextmanager
def board_at_home(*faults: InjectedFault) -> Iterator[simulator.VirtualBoard]:
    """A virtual board in real time whose arm stands where the shipped motion begins."""
    arm = Arm.paper()
    with simulator.launch(simulator.LaunchOptions(arm=arm, virtual_time=False, faults=faults)) as process:
        with open_board(process.port) as board:
            arm_state.configure(board, arm, replace=True)
            arm_state.home(board, arm)
        yield process


def samples_in(folder: Path) -> int:
    """Whole sample lines of the one run in ``folder``."""
    return sum(path.read_text().count("\n") for path in folder.glob("*-001/samples-01.csv"))


def test_sigterm_ends_a_run_whose_board_has_fallen_silent(
    plan_file: Callable[[str], Path], tmp_path: Path
) -> None:
    with board_at_home(InjectedFault("silence", at_s=0.5, ms=1e9)) as process:
        command = commandline.start(
            "run", plan_file("shipped"), "--port", process.port, "--out", tmp_path, folder=tmp_path
        )
        commandline.wait_for(lambda: samples_in(tmp_path) > 3, "the first samples")
        command.terminate()
        done = commandline.ended(command, ENDS_WITHIN_S)
    done.said("armtempo: the board was told to stop and does not", "switch off")
    assert done.exit_code == 1
    assert reader.load(tmp_path / "feed-001").meta["repetitions"][0]["state"] == "broken"


def test_a_second_ctrl_c_ends_it_at_once(plan_file: Callable[[str], Path], tmp_path: Path) -> None:
    with board_at_home() as process:
        command = commandline.start(
            "run", plan_file("shipped"), "--port", process.port, "--out", tmp_path, folder=tmp_path
        )
        commandline.wait_for(lambda: samples_in(tmp_path) > 5, "the first samples")
        command.send_signal(signal.SIGINT)
        commandline.wait_for(lambda: samples_in(tmp_path) > 7 or command.poll() == 130, "the brakes")
        command.send_signal(signal.SIGINT)
        done = commandline.ended(command, ENDS_WITHIN_S)
        with open_board(process.port) as board:
            assert not board.status().moving
    done.said("interrupted")
    assert done.exit_code == 130
    assert reader.load(tmp_path / "feed-001").meta["repetitions"][0]["state"] == "interrupted"
