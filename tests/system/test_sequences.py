"""Sequences on the virtual board: file, plan, records, board, pins; what a host records, and the report."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import armtempo
import numpy as np
import pytest
from armtempo.basics.errors import BoardError, LinkError
from armtempo.cli import state
from armtempo.link.board_messages import SequenceState
from armtempo.link.session import OnLoss
from armtempo.report import verdict
from armtempo.report.evaluation import evaluate
from armtempo.simulator import InjectedFault, LaunchOptions, edgelog, launch
from armtempo_shared.limits import TICK_HZ

from tests import interpreters
from tests.system import commandline, sequences
from tests.system.conftest import FASTEST
from tests.system.sequences import ARM, GRIPPER, net_steps, part_lies_there, small

CYCLES = 5
LEGS = 3


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in interpreters.AVAILABLE if name != "micropython-arm"])
def test_cycles_lead_back_to_the_step(name: str, tmp_path: Path) -> None:
    plan = small(tmp_path, CYCLES)
    options = LaunchOptions(
        arm=ARM,
        faults=[part_lies_there()],
        edge_log=tmp_path / "edges",
        interpreter=interpreters.starter(name),
    )
    seen = []
    with launch(options) as process, armtempo.connect(process.port, ARM) as board:
        board.home(ARM)
        end = board.run_sequence(plan, seen.append)
        assert (end.ending, end.cycle) == ("finished", CYCLES)
        assert board.counters == {"parts": CYCLES}
        status = commandline.run("status", "--json", folder=tmp_path, ARMTEMPO_PORT=process.port)
        told = json.loads(status.output)["sequence"]
        assert (told["name"], told["ending"], told["counters"]) == ("small", "finished", {"parts": CYCLES})
        assert f"small: finished, {CYCLES} whole cycles; parts {CYCLES}" in status_lines(board)
        home = [round(joint.home_deg * joint.steps_per_deg) for joint in ARM.driven]
        assert list(board.status().positions.commanded_steps) == home
    assert [state.cycle for state in seen] == sorted(state.cycle for state in seen)
    (power,) = edgelog.read(tmp_path / "edges")
    assert net_steps(power) == [0, 0, 0]
    assert len(power.starts) == LEGS * CYCLES
    widths = [pulses.high_ticks for pulses in power.pulses[GRIPPER]]
    opened, closed = widths[0], max(widths)
    changes = [width for width, _ in itertools.groupby(widths) if width]
    assert changes == [opened, closed] * CYCLES + [opened]
    assert closed > opened
    grips = [pulses.tick for pulses in power.pulses[GRIPPER] if pulses.high_ticks == closed]
    for cycle, grip in enumerate(grips):  # between the end of the first motion and the start of the next
        begun = power.starts[LEGS * cycle]
        assert begun + plan.legs[0].trajectory.duration_s * TICK_HZ < grip < power.starts[LEGS * cycle + 1]
    assert len(sequences.pauses_s(power, plan)) == CYCLES - 1


def status_lines(board: armtempo.Board) -> list[str]:
    """What the status command prints of it, without the names of the lines."""
    return [line[10:] for line in state.lines(board.state())]


@pytest.mark.long
def test_whatever_ends_it_leaves_a_board_that_says_where(tmp_path: Path) -> None:
    """E-stop in a motion, no part, a stop; after each one the next sequence starts where the arm is."""
    plan = small(tmp_path, 20, "fault")
    faults = [InjectedFault("input", 0.1, 2, name=sequences.ESTOP, level=0)]
    options = LaunchOptions(arm=ARM, faults=[part_lies_there(), *faults])
    with launch(options) as process, armtempo.connect(process.port, ARM) as board:
        board.home(ARM)
        with pytest.raises(BoardError, match="E-stop input tripped") as caught:
            board.run_sequence(plan)
        assert "in step 5" in str(caught.value)
        assert board.client.sequence().ending == "fault"
        assert board.output("gripper").state == "open"  # its safe state
    with launch(LaunchOptions(arm=ARM)) as process, armtempo.connect(process.port, ARM) as board:
        board.home(ARM)
        with pytest.raises(BoardError, match="an input of a sequence did not change in time") as caught:
            board.run_sequence(plan)
        assert "in step 3 of cycle 1" in str(caught.value)
        with pytest.raises(BoardError, match="a fault is pending"):
            board.run_sequence("small")
        board.clear()
        with pytest.raises(BoardError, match="is not at the start of the motion"):
            board.run_sequence("small")
        with pytest.raises(LinkError, match="is not at the start of sequence 'small'"):
            board.run_sequence(plan)
        board.goto(plan)
        stop = armtempo.StopRequest()
        with pytest.raises(armtempo.Stopped):
            board.run_sequence(plan, lambda state: setattr(stop, "wanted", True), stop)
        assert board.client.sequence().ending == "stopped"
        assert board.status().state == "idle"


# ``armtempo demo --pick-and-place``: the shipped sequence, with the part sensor imitated


@pytest.mark.long
def test_two_parts_are_placed(tmp_path: Path) -> None:
    environment = {"ARMTEMPO_MICROPYTHON": interpreters.starter("cpython")}
    done = commandline.run("demo", "--pick-and-place", folder=tmp_path, **environment)
    assert done.exit_code == 0, done.errors
    assert "cycle (step 2, 2 times):" in done.output
    assert done.output.splitlines()[-1] == "finished after 2 whole cycles"
    assert not list(tmp_path.iterdir())


def test_it_is_for_a_virtual_board(tmp_path: Path) -> None:
    done = commandline.run("demo", "--pick-and-place", "--port", "/dev/ttyACM0", folder=tmp_path)
    assert done.exit_code == 2
    done.said("--pick-and-place needs a virtual board")


# sequences that a host records: each row and sample, the report, and what is known after a power failure


ROWS_OF_A_CYCLE = 10
"""Of ``small``, with the end of the repeat; the repeat itself comes once."""


def options() -> LaunchOptions:
    return LaunchOptions(arm=ARM, faults=[part_lies_there()], interpreter=interpreters.starter(FASTEST))


@pytest.mark.long
def test_every_row_and_sample_is_recorded(tmp_path: Path) -> None:
    plan = small(tmp_path, 3)
    with launch(options()) as process, armtempo.connect(process.port, ARM) as board:
        board.home(ARM)
        board.run_sequence(plan, out=tmp_path / "runs")
        by_file = board.last_sequence
        by_name = board.run("small", out=tmp_path / "runs")
    assert by_file
    for found in (by_file, by_name):
        assert found.state == "finished"
        assert found.entries[0].ended["counters"] == {"parts": 3}
        passed = 1 + 3 * ROWS_OF_A_CYCLE
        assert [row.passed for row in found.rows] == list(range(1, passed + 1))
        assert found.rows_lost == 0
        assert [row.value for row in found.rows if row.words == "count parts"] == [1, 2, 3]
        assert np.all(found.samples.row >= 0)
        assert {found.leg_of(row) for row in found.samples.row} == set(range(1, LEGS + 1))
        told = evaluate(found.path)
        whole = [(leg.number, len(leg.repetitions), leg.whole) for leg in told.legs]
        assert whole == [(n, 3, 3) for n in range(1, LEGS + 1)]
        planned_deg = [one.trajectory(run.path_s) for one in told.legs for run in one.repetitions]
        commanded_deg = [run.commanded_deg for one in told.legs for run in one.repetitions]
        off_deg = np.abs(np.concatenate(commanded_deg) - np.concatenate(planned_deg)).max(axis=0)
        assert np.all(off_deg * [joint.steps_per_deg for joint in ARM.driven] < 2.5)
        made = f"the board made every step pulse of {3 * LEGS} whole motions"
        assert made in str(verdict.of(told))
    assert by_file.rows[1].words == "goto pick"
    assert by_name.rows[1].words == "run small-1"
    judged = verdict.of(evaluate(by_file.path))
    assert judged.state != verdict.BAD, judged.line
    page = by_file.report().read_text()
    assert "rows-01.csv" in page
    assert "samples-01.csv" in page
    assert "finished after 3 whole cycles" in page
    assert "goto pick" in page


@pytest.mark.long
def test_after_a_power_failure_the_folder_says_where_it_stood(tmp_path: Path) -> None:
    """The board forgets it: its flash is not written while a sequence runs."""
    plan = small(tmp_path, "for ever")
    states: list[SequenceState] = []
    with launch(options()) as process, armtempo.connect(process.port, ARM) as board:
        board.home(ARM)

        def cut(state: SequenceState) -> None:
            states.append(state)
            if state.cycle == 2 and process.running():
                process.stop()

        nobody_waits = board.client.session.on_loss(OnLoss(retry_s=0.0))
        with pytest.raises(LinkError), nobody_waits:
            board.run_sequence(plan, cut, out=tmp_path / "runs")
        found = board.last_sequence
    assert found
    assert found.state == "broken"
    assert found.last
    assert found.last.cycle >= 2
    assert found.last.step >= states[-1].step - 1
    assert [row.passed for row in found.rows] == list(range(1, len(found.rows) + 1))
    told = verdict.of(evaluate(found.path))
    assert told.state == verdict.BAD
    assert "step" in told.line
    assert "of cycle 3" in told.line
    with (found.path / "rows-01.csv").open("a") as file:
        file.write("99,1")  # cut in the midst of a line
    assert armtempo.Run.load(found.path).rows == found.rows
