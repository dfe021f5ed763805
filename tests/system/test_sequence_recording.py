"""Sequences that a host records: each row and sample, the report, and what is known after a power failure."""

from __future__ import annotations

import json
from pathlib import Path

import armtempo
import numpy as np
import pytest
from armtempo.basics.errors import LinkError, RunFolderError
from armtempo.link.board_messages import SequenceState
from armtempo.report import sequence_report
from armtempo.report.sequence_report import results
from armtempo.simulator import LaunchOptions, launch

from tests import interpreters
from tests.system import commandline
from tests.system.conftest import FASTEST
from tests.system.sequences import ARM, FOLDER, part_lies_there, small

LEGS = 3
ROWS_OF_A_CYCLE = 10
"""Of ``small``, with the end of the repeat; the repeat itself comes once."""


def options() -> LaunchOptions:
    return LaunchOptions(arm=ARM, faults=[part_lies_there()], interpreter=interpreters.starter(FASTEST))


def test_every_row_and_sample_is_recorded(tmp_path: Path) -> None:
    plan = small(tmp_path, 3)
    with launch(options()) as process, armtempo.connect(process.port, ARM) as board:
        board.home(ARM)
        board.run_sequence(plan, out=tmp_path / "runs")
        by_file = board.last_sequence
        board.run_sequence("small", out=tmp_path / "runs")
        by_name = board.last_sequence
    assert by_file
    assert by_name
    for found in (by_file, by_name):
        assert found.state == "finished"
        assert found.meta["ended"]["counters"] == {"parts": 3}
        passed = 1 + 3 * ROWS_OF_A_CYCLE
        assert [row.passed for row in found.rows] == list(range(1, passed + 1))
        assert found.rows_lost == 0
        assert [row.value for row in found.rows if row.words == "count parts"] == [1, 2, 3]
        assert np.all(found.row >= 0)
        assert {found.motion_of(row) for row in found.row} == set(range(1, LEGS + 1))
        legs = results(found)
        assert [(leg.number, leg.runs, leg.whole) for leg in legs] == [(n, 3, 3) for n in range(1, LEGS + 1)]
        assert max(leg.end_off_steps.max() for leg in legs) <= 0.51
        assert max(leg.command_off_steps.max() for leg in legs) < 2.5
    assert by_file.rows[1].words == "goto pick"
    assert by_name.rows[1].words == "run small-1"
    told = sequence_report.verdict(by_file, results(by_file))
    assert told.state != sequence_report.BAD, told.line
    page = sequence_report.write(by_file.path).read_text()
    assert "rows.csv" in page
    assert "samples.csv" in page
    assert "finished after 3 whole cycles" in page
    assert "goto pick" in page


def test_after_a_power_failure_the_folder_says_where_it_stood(tmp_path: Path) -> None:
    """The board forgets it: its flash is not written while a sequence runs."""
    plan = small(tmp_path, "for ever")
    states: list[SequenceState] = []
    with launch(options()) as process, armtempo.connect(process.port, ARM) as board:
        board.home(ARM)
        board.client.session.reopen = None  # nobody waits for the cable

        def cut(state: SequenceState) -> None:
            states.append(state)
            if state.cycle == 2 and process.running:
                process.stop()

        with pytest.raises(LinkError):
            board.run_sequence(plan, cut, out=tmp_path / "runs")
        found = board.last_sequence
    assert found
    assert found.state == "broken"
    assert found.last
    assert found.last.cycle >= 2
    assert found.last.step >= states[-1].step - 1
    assert [row.passed for row in found.rows] == list(range(1, len(found.rows) + 1))
    told = sequence_report.verdict(found, results(found))
    assert told.state == sequence_report.BAD
    assert "step" in told.line
    assert "2 whole cycles" in told.line
    with (found.path / "rows.csv").open("a") as file:
        file.write("99,1")  # cut in the midst of a line
    assert armtempo.SequenceRun.load(found.path).rows == found.rows


def test_from_the_command_line(tmp_path: Path) -> None:
    plan = small(tmp_path, 2)
    plan.save(tmp_path / "small.json")
    report = "runs/small-001"
    fitted = tmp_path / "arm.toml"
    fitted.write_text(
        (FOLDER / "arm.toml").read_text().replace("estop_fitted = false", "estop_fitted = true")
    )
    with launch(options()) as process:

        def said(*arguments: str, code: int = 0) -> str:
            done = commandline.run(*arguments, folder=tmp_path, ARMTEMPO_PORT=process.port)
            assert done.exit_code == code, done.output + done.errors
            return done.output

        with armtempo.connect(process.port, ARM) as board:
            board.home(ARM)
        assert f"recorded in {report}" in said("run", "small.json")
        told = json.loads(said("run", "small", "--arm", str(fitted), "--json").splitlines()[-1])
    assert (told["ending"], told["cycles"], told["counters"]) == ("finished", 2, {"parts": 2})
    assert told["folder"].endswith("small-002")
    assert said("report", report).startswith(f"wrote {report}/report.html")
    assert (tmp_path / report / "report.html").is_file()
    with pytest.raises(RunFolderError, match="is the run of a sequence"):
        armtempo.Run.load(tmp_path / report)
