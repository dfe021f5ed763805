"""The comparison of searches: the same runs wherever they are computed, and none lost or done twice."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.cli import main
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.research.bench import cases, result_plot, result_store, result_table, worker_pool
from click.testing import CliRunner

pytestmark = pytest.mark.xdist_group("bench")  # what they share is made once

ITERATIONS = 6
SMALL = ["--populations", "4,6", "--seeds", "2", "--iterations", str(ITERATIONS), "--workers", "2"]


@pytest.fixture(scope="module")
def problem() -> cases.Problem:
    arm = Arm.paper()
    return cases.problem_of(arm, Job.paper(arm), 1, "stretched", ITERATIONS)


@pytest.fixture(scope="module")
def some() -> list[cases.Case]:
    return cases.cases(["acs", "ga", "pso"], [4, 6], [1, 2])


@pytest.fixture(scope="module")
def runs(problem: cases.Problem, some: list[cases.Case]) -> dict[cases.Case, cases.Trial]:
    return {case: cases.solve(problem, case) for case in some}


def _numbers(run: cases.Trial) -> tuple[object, ...]:
    """All of a run but the time it took."""
    return run.case, run.intervals_s, run.evaluations, run.improvements


def test_cases_come_once_and_long_ones_first(some: list[cases.Case]) -> None:
    assert len(some) == len(set(some)) == 12
    assert [case.population for case in some] == [6] * 6 + [4] * 6


def test_problem_is_the_planners_fitness(problem: cases.Problem) -> None:
    table_6 = np.array([[1.514, 0.502, 1.628, 0.722, 0.253, 1.413]])
    assert problem.function()(table_6)[0] == pytest.approx(6.0319, rel=1e-3)


def test_problem_refuses_joints_that_cannot_be_timed() -> None:
    arm = Arm.paper()
    job = Job.paper(arm)
    with pytest.raises(InputError, match="give one of 1 to 3"):
        cases.problem_of(arm, job, 4, "stretched", 1)


def test_history_is_rebuilt_from_improvements() -> None:
    run = cases.Trial(cases.Case("ga", 4, 1), (), 4, 0.0, ((0, 9.0), (2, 7.5), (5, 7.0)))
    assert run.history(6).tolist() == [9.0, 9.0, 7.5, 7.5, 7.5, 7.0, 7.0]
    assert run.best_s == 7.0


@pytest.mark.slow
def test_processes_give_the_same_numbers(
    problem: cases.Problem, some: list[cases.Case], runs: dict[cases.Case, cases.Trial]
) -> None:
    with worker_pool.local(2) as executor:
        found = {run.case: run for run in cases.execute(problem, some, executor)}
    assert {case: _numbers(run) for case, run in found.items()} == {c: _numbers(r) for c, r in runs.items()}


@pytest.mark.slow
def test_a_cluster_of_two_workers_gives_the_same_numbers(
    tmp_path: Path, runs: dict[cases.Case, cases.Trial], problem: cases.Problem
) -> None:
    import distributed  # takes long, and every process that collects the tests would do it

    with distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster:
        more = ["--algorithms", "acs,ga,pso", "--scheduler", cluster.scheduler_address, "--no-plot"]
        done = CliRunner().invoke(main, ["bench", *SMALL, *more, "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    found = result_store.ResultStore(tmp_path, problem).runs
    assert {case: _numbers(run) for case, run in found.items()} == {c: _numbers(r) for c, r in runs.items()}


def test_no_scheduler_and_no_workers_are_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker_pool, "_CONNECT_S", 0.3)
    with pytest.raises(InputError, match="no Dask scheduler"), worker_pool.cluster("tcp://127.0.0.1:9"):
        pass
    with pytest.raises(InputError, match="is no address"), worker_pool.cluster("nonsense"):
        pass
    with pytest.raises(InputError, match="no workers"):
        worker_pool._check_workers("tcp://there", {})
    with pytest.raises(ArmtempoError, match="no armtempo"):
        worker_pool._check_workers("tcp://there", {"w": ImportError()})
    with pytest.raises(ArmtempoError, match=r"armtempo 0\.0\.0"):
        worker_pool._check_workers("tcp://there", {"w": "0.0.0"})


@pytest.mark.slow
def test_goes_on_where_it_was_interrupted(tmp_path: Path) -> None:
    arguments = ["--algorithms", "acs", "--populations", "60", "--seeds", "40", "--iterations", "60"]
    command = [
        sys.executable,
        "-c",
        "from armtempo.cli import main; main()",
        "bench",
        "--no-plot",
        *arguments,
    ]
    command += ["--workers", "2", "--out", str(tmp_path)]
    file = tmp_path / result_store.FILE
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        while process.poll() is None and not (file.exists() and file.read_bytes().count(b"\n") >= 3):
            time.sleep(0.01)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGINT)
        said = process.communicate(timeout=600)[1]
    assert process.returncode == 130, said
    kept = file.read_bytes()
    count = kept.count(b"\n") - 1
    assert said.strip().splitlines()[-1] == (
        f"armtempo: interrupted; {count} of 40 runs are kept in {file}, "
        "and the same command goes on from there"
    )
    assert 2 <= count < 40
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    assert file.read_bytes().startswith(kept)
    assert sorted(json.loads(line)["case"]["seed"] for line in file.read_bytes().splitlines()[1:]) == [
        *range(1, 41)
    ]


def test_a_line_cut_off_is_done_again(
    tmp_path: Path, problem: cases.Problem, runs: dict[cases.Case, cases.Trial]
) -> None:
    store = result_store.ResultStore(tmp_path, problem)
    for run in runs.values():
        store.add(run)
    content = store.path.read_bytes()
    store.path.write_bytes(content[:-7])
    again = result_store.ResultStore(tmp_path, problem)
    assert again.runs == dict(list(runs.items())[:-1])
    again.add(list(runs.values())[-1])
    assert store.path.read_bytes() == content


def test_runs_of_another_problem_and_other_files_are_refused(tmp_path: Path, problem: cases.Problem) -> None:
    result_store.ResultStore(tmp_path, problem)
    other = cases.Problem(**{**vars(problem), "iterations": 7, "fitness": "penalised"})
    with pytest.raises(InputError, match="differs in fitness, iterations"):
        result_store.ResultStore(tmp_path, other)
    (tmp_path / result_store.FILE).write_text("a shopping list\n")
    with pytest.raises(InputError, match="not a file of runs"):
        result_store.ResultStore(tmp_path, problem)
    (tmp_path / result_store.FILE).unlink()
    store = result_store.ResultStore(tmp_path, problem)
    head = store.path.read_text()
    for improvements in ([], [["a", "b"]], [[0]]):
        case = {"algorithm": "acs", "population": 4, "seed": 1}
        run = {"case": case, "intervals_s": [], "evaluations": 1, "seconds": 0, "improvements": improvements}
        store.path.write_text(f"{head}{json.dumps(run)}\n")
        with pytest.raises(InputError, match="not a file of runs"):
            result_store.ResultStore(tmp_path, problem)
    (tmp_path / "flat").write_text("")
    with pytest.raises(InputError, match="cannot be used"):
        result_store.ResultStore(tmp_path / "flat", problem)


def test_tables_say_what_the_runs_are(runs: dict[cases.Case, cases.Trial]) -> None:
    found = result_table.rows(runs.values(), ITERATIONS)
    assert [(row.algorithm, row.population) for row in found] == [
        ("ga", 4), ("ga", 6), ("pso", 4), ("pso", 6), ("acs", 4), ("acs", 6),
    ]  # fmt: skip
    table = list(csv.DictReader(result_table.table_csv(found, with_paper=True).splitlines()))
    mine = [runs[cases.Case("pso", 6, seed)] for seed in (1, 2)]
    row = next(row for row in table if (row["algorithm"], row["population"]) == ("pso", "6"))
    assert float(row["best_s"]) == pytest.approx(min(run.best_s for run in mine), abs=1e-6)
    assert float(row["worst_s"]) == pytest.approx(max(run.best_s for run in mine), abs=1e-6)
    assert float(row["median_s"]) == pytest.approx(sum(run.best_s for run in mine) / 2, abs=1e-6)
    assert int(row["evaluations"]) == 6 * (1 + 2 * ITERATIONS)
    curves = list(csv.DictReader(result_table.curves_csv(found).splitlines()))
    assert len(curves) == 6 * (ITERATIONS + 1)
    last = next(c for c in curves if (c["algorithm"], c["population"], c["iteration"]) == ("pso", "6", "6"))
    assert [last[name] for name in ("best_s", "median_s", "worst_s")] == [
        row[name] for name in ("best_s", "median_s", "worst_s")
    ]


@pytest.mark.slow
def test_the_paper_stands_beside_its_own_problem_only(tmp_path: Path) -> None:
    small = ["--algorithms", "ga", "--populations", "10", "--seeds", "1", "--iterations", "2", "--no-plot"]
    for joint, expected in (("1", True), ("2", False)):
        folder = str(tmp_path / joint)
        done = CliRunner().invoke(main, ["bench", *small, "--joint", joint, "--out", folder])
        assert done.exit_code == 0, done.output
        assert ("10.491" in done.output) is expected


@pytest.mark.slow
def test_draws_the_curves(runs: dict[cases.Case, cases.Trial], tmp_path: Path) -> None:
    figure = result_plot.convergence(result_table.rows(runs.values(), ITERATIONS))
    titles = [axis.get_title() for axis in figure.axes]
    assert titles == ["population 4", "population 6"]
    lines = {line.get_label(): line for line in figure.axes[1].lines}
    both = [runs[cases.Case("acs", 6, seed)].history(ITERATIONS) for seed in (1, 2)]
    assert lines["ACS"].get_ydata() == pytest.approx(np.mean(both, axis=0))


@pytest.mark.slow
def test_without_matplotlib_the_tables_stand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    small = ["--algorithms", "ga", "--populations", "4", "--seeds", "1", "--iterations", "2"]
    done = CliRunner().invoke(main, ["bench", *small, "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert "armtempo[plot]" in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["convergence.csv", "runs.jsonl", "table.csv"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--algorithms", "acs,moth"], "'moth' is not known"),
        (["--populations", "10,many"], "whole numbers"),
        (["--populations", "3"], "from 4 to 100000"),
        (["--populations", "10,1000000000"], "from 4 to 100000"),
        (["--joint", "7"], "give one of 1 to 3"),
    ],
)
def test_wrong_options_are_explained(arguments: list[str], said: str, tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["bench", *arguments, "--out", str(tmp_path / "none")])
    assert done.exit_code == 2
    assert said in done.output
    assert not (tmp_path / "none").exists()
