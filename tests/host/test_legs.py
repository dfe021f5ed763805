"""Runs of several legs: recorded, read, reported and compared as a run of one is; and the folders of version 1."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import armtempo
import numpy as np
import pytest
from armtempo.basics.errors import ArmtempoError, InputError, RunFolderError
from armtempo.cli import main
from armtempo.encoding import encoded_plan
from armtempo.report import verdict
from armtempo.report.evaluation import evaluate
from armtempo.report.run_folder import ARM
from armtempo.report.verdict import BAD, GOOD, OPEN
from armtempo.robot import goto
from click.testing import CliRunner

from tests.host import made_runs

VERSION_1 = Path(__file__).with_name("runs_of_version_1")
"""A motion and a sequence, as armtempo of version 1 of the format had recorded them."""


def findings(folder: Path) -> list[tuple[str, str]]:
    return [(item.state, item.text) for item in verdict.of(evaluate(folder)).findings]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three passes of two legs."""
    return made_runs.make_sequence(tmp_path_factory.mktemp("runs") / "pick-001")


def test_a_sequence_is_read_as_a_run_of_its_legs(recorded: Path) -> None:
    run = armtempo.Run.load(recorded)
    plan = made_runs.small_sequence()
    assert (run.name, run.state, run.complete, run.rows_lost) == ("pick", "finished", True, 0)
    for leg, planned in zip(run.legs, [leg.trajectory for leg in plan.legs], strict=True):
        times = np.linspace(0.0, planned.duration_s, 9)
        np.testing.assert_allclose(leg(times), planned(times), atol=1e-6)
    assert [row.passed for row in run.rows] == list(range(1, len(run.rows) + 1))
    assert [row.value for row in run.rows if row.words == "count parts"] == [1, 2, 3]
    assert run.last == run.rows[-1]
    assert {run.leg_of(row) for row in run.samples.row} == {1, 2}
    assert sorted(set(run.samples["run"])) == list(range(1, 7))
    assert run.samples.angle_deg.shape == (len(run.samples), 3)
    assert run.entries[0].ended == {"step": 4, "cycle": 3, "counters": {"parts": 3}}
    assert run.results == ()
    assert run.plan is not None
    assert run.plan.rows == plan.rows
    assert run.to_json()["repetitions"] == ["finished"]
    with pytest.raises(RunFolderError, match="ran 2 motions"):
        _ = run.trajectory


def test_a_motion_is_a_run_of_one_leg(tmp_path: Path) -> None:
    run = armtempo.Run.load(made_runs.make(tmp_path / "run", repetitions=2))
    assert run.legs == (run.trajectory,)
    assert (run.rows, run.last, run.state) == ((), None, "complete")
    assert (set(run.samples.row), set(run.samples.repetition)) == ({0}, {1, 2})
    assert run.leg_of(0) == 1


def test_a_whole_run(recorded: Path) -> None:
    assert findings(recorded) == [
        (GOOD, "finished after 3 whole cycles"),
        (GOOD, "no sample is missing"),
        (GOOD, "the board made every step pulse of 6 whole motions"),
        (GOOD, "the arm followed: at most 0.04° from the plan (joint 2)"),
        (GOOD, "speed and acceleration stayed within 5% of their limits, as measured"),
    ]


@pytest.mark.parametrize(
    ("changes", "state", "text"),
    [
        ({"lost_rows": (4, 5)}, OPEN, "rows-01.csv: 2 rows were not reported"),
        ({"drop": (9,)}, OPEN, "samples-01.csv run 1: its end is missing"),
        ({"drop": (2, 3)}, OPEN, "samples-01.csv run 1: samples 2 to 3 are missing"),
        ({"steps_off": 7}, BAD, "joint 1 ended up to 7 steps from where motion 1 (goto 3, -58, 41°) ends"),
        ({"blind": True}, OPEN, "joint 1 has no encoder"),
        ({"state": "stopped"}, OPEN, "stopped in step 4 of cycle 4"),
        ({"state": "refused", "code": "busy"}, BAD, "refused (busy) in step 4 of cycle 4"),
        ({"scatter_deg": 3.0}, BAD, "joint 1 was up to "),
    ],
)
def test_what_is_not_as_it_should_be_comes_first(
    tmp_path: Path, changes: dict[str, object], state: str, text: str
) -> None:
    first_state, first_text = findings(made_runs.make_sequence(tmp_path / "run", **changes))[0]  # type: ignore[arg-type]
    assert first_state == state
    assert first_text.startswith(text)


def test_many_places_of_one_problem_are_one_sentence(tmp_path: Path) -> None:
    folder = made_runs.make_sequence(tmp_path / "run", cycles=4)
    path = folder / "samples-01.csv"
    head, *lines = path.read_text().splitlines()
    kept = [line for line in lines if not line.startswith("1,")]
    path.write_text("\n".join([head, *kept]) + "\n")
    (text,) = evaluate(folder).complaints
    runs = ", ".join(f"samples-01.csv run {run}" for run in (1, 2, 3))
    assert text == f"{runs} and 5 more: samples 1 to 1 are missing"


@pytest.mark.slow
def test_the_page_and_the_comparison_take_a_sequence(
    recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made_runs.draw_nothing(monkeypatch)
    result = CliRunner().invoke(main, ["report", str(recorded), "--json"])
    assert result.exit_code == 0, result.output
    (told,) = json.loads(result.output)["runs"]
    assert told["verdict"] == GOOD
    page = Path(told["page"]).read_text()
    for text in ("Its motions", "counter parts", "armtempo run sequence.json<", "rows-01.csv"):
        assert text in page
    motion = made_runs.make(tmp_path / "feed-001", repetitions=1)
    page = armtempo.compare([recorded, motion], tmp_path / "page.html").read_text()
    assert page.count("pick-001, motion 2") == 3
    assert "feed-001" in page
    assert page.count("<figure") == 3


def test_a_sequence_without_a_motion_has_a_page(tmp_path: Path) -> None:
    folder = made_runs.make_sequence(tmp_path / "run")
    samples = folder / "samples-01.csv"
    samples.write_text(samples.read_text().splitlines()[0] + "\n")
    assert "No motion was recorded" in armtempo.Run.load(folder).report().read_text()
    for file in (samples, folder / "rows-01.csv"):
        file.write_text("")
    with pytest.raises(RunFolderError, match="contains no samples"):
        evaluate(folder)


class Stored:
    """A client of a board that has the small sequence."""

    def __init__(self) -> None:
        encoded = encoded_plan.of_plan(made_runs.small_sequence())
        self.records = {motion.name: motion.data for motion in encoded.legs} | {"pick": encoded.data}

    def fetch(self, name: str) -> bytes:
        return self.records[name]


def test_what_is_recorded_of_a_stored_sequence_is_that_of_its_plan() -> None:
    plan = made_runs.small_sequence()
    planned = encoded_plan.of_plan(plan)
    board = Stored()
    stored = encoded_plan.of_board("pick", plan.arm, board.fetch)
    assert stored.records == planned.records
    assert stored.start_deg == pytest.approx(planned.start_deg, abs=1e-6)
    assert [replace(row, words="") for row in stored.rows] == [replace(row, words="") for row in planned.rows]
    assert [row.words for row in stored.rows] == [
        *("repeat for ever", "run pick-1", "run pick-2", "count parts", "end of repeat")
    ]
    board.records["pick"] = board.records["pick"][:-1]
    with pytest.raises(ArmtempoError, match="sequence 'pick' on the board"):
        encoded_plan.of_board("pick", plan.arm, board.fetch)


def test_a_sequence_is_run_and_gone_to_as_a_motion_is(tmp_path: Path) -> None:
    plan = made_runs.small_sequence()
    plan.save(tmp_path / "pick.json")
    assert goto.posture_deg(tmp_path / "pick.json", plan.arm) == pytest.approx(plan.start_deg)
    board: Any = None
    with pytest.raises(InputError, match="a sequence takes no repeat"):
        armtempo.Board(board, "port").run(tmp_path / "pick.json", repeat=2)


# version 1: a motion had its record in motion.bin, a sequence its samples in samples.csv


def of_version_1(name: str, folder: Path) -> armtempo.Run:
    """A run of the paper's arm, which both of them have in their folders."""
    path = shutil.copytree(VERSION_1 / name, folder / name)
    shutil.copy(VERSION_1 / ARM, path)
    return armtempo.Run.load(path)


def test_a_motion_of_version_1_is_read(tmp_path: Path) -> None:
    run = of_version_1("small-001", tmp_path)
    assert (run.name, run.complete, len(run.repetitions)) == ("small", True, 2)
    assert run.plan is None
    assert run.trajectory.duration_s == pytest.approx(1.0627, abs=1e-4)
    assert set(run.samples.row) == {0}
    assert max(abs(joint.error_deg) for joint in run.results) < 0.2
    assert (GOOD, "the board made every step pulse of the motion") in findings(run.path)


def test_a_sequence_of_version_1_is_read(tmp_path: Path) -> None:
    run = of_version_1("pick-001", tmp_path)
    assert (run.name, run.state, run.complete, run.rows_lost) == ("pick", "finished", True, 0)
    assert run.entries[0].ended == {"step": 1, "cycle": 2, "counters": {"parts": 2}}
    assert {run.leg_of(row) for row in run.samples.row} == {1, 2}
    assert len(run.legs) == 2
    assert findings(run.path)[:3] == [
        (OPEN, "samples.csv run 5, samples.csv run 7: its end is missing"),
        (GOOD, "finished after 2 whole cycles, on a virtual board"),
        (GOOD, "the board made every step pulse of 2 whole motions"),
    ]


def test_a_later_version_is_refused_with_what_to_do(recorded: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(recorded, tmp_path / "run")
    meta = json.loads((folder / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps({**meta, "version": 3}))
    with pytest.raises(RunFolderError, match="version 3; this armtempo reads 1 and 2") as caught:
        armtempo.Run.load(folder)
    assert "update armtempo" in caught.value.hint
