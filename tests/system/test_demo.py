"""``armtempo demo`` from the command line: what it prints and what it leaves."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from armtempo.model.plan import Plan
from armtempo.report import run_reader
from armtempo.report.run_folder import MOTION
from armtempo.report.run_report import PAGE

from tests import interpreters
from tests.system import commandline
from tests.system.commandline import Ended

pytestmark = pytest.mark.xdist_group("demo")  # what they share is made once

FIGURES = ("tracking", "errors", "convergence", "postures")
LIMITS = {"joint 1": (50.0, 50.0, 150.0), "joint 2": (40.0, 30.0, 120.0), "joint 3": (60.0, 40.0, 150.0)}
"""Speed, acceleration and jerk (Tables 5 and 7)."""
BLOCKED = "raise ImportError('not here')\n"


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Ended, Path]:
    """A demo with the report, under CPython, and its run folder."""
    folder = tmp_path_factory.mktemp("demo")
    environment = {"ARMTEMPO_MICROPYTHON": interpreters.starter("cpython")}
    return commandline.run("demo", folder=folder, **environment), folder / "runs" / "feed-001"


def rows(output: str, joint: str) -> list[list[float]]:
    """The numbers of each line about a joint."""
    lines = [line.removeprefix(joint) for line in output.splitlines() if line.startswith(joint)]
    return [[float(number) for number in re.findall(r"[-+]?\d+\.?\d*", line)] for line in lines]


def test_it_succeeds(demo: tuple[Ended, Path]) -> None:
    done, _ = demo
    assert done.exit_code == 0, done.errors
    assert done.errors == "port sim: a virtual board, which ends with this command\n"


def test_its_run_folder_is_whole(demo: tuple[Ended, Path]) -> None:
    done, folder = demo
    run = run_reader.load(folder)
    assert [repetition.state for repetition in run.repetitions] == ["complete"]
    assert (folder / MOTION).stat().st_size > 0
    assert Plan.load(folder / "trajectory.json").job.name == "feed"
    assert "samples-01.csv: complete, 6.795 s, 69 samples" in done.output


def test_its_report_is_there(demo: tuple[Ended, Path]) -> None:
    done, folder = demo
    assert f"report: {Path('runs') / folder.name / PAGE}" in done.output
    assert "armtempo panel --port sim" in done.output
    assert (folder / PAGE).read_text(encoding="utf-8").count("<figure") == len(FIGURES)
    for name in FIGURES:
        assert (folder / f"{name}.svg").stat().st_size > 0


@pytest.mark.parametrize("joint", LIMITS)
def test_it_sums_up_the_plan_beside_the_limits(joint: str, demo: tuple[Ended, Path]) -> None:
    done, folder = demo
    planned, _ = rows(done.output, joint)
    plan = Plan.load(folder / "trajectory.json")
    spline = plan.trajectory.joints[list(LIMITS).index(joint)]
    assert planned[0] == pytest.approx(spline.duration_s, abs=1e-4)
    assert tuple(planned[-5::2]) == LIMITS[joint]
    for reached, limit in zip(planned[-6::2], LIMITS[joint], strict=True):
        assert 0.3 * limit < reached <= limit


@pytest.mark.parametrize(("joint", "net_steps"), [*zip(LIMITS, (6400, 1955, -3271), strict=True)])
def test_it_sums_up_the_run(joint: str, net_steps: int, demo: tuple[Ended, Path]) -> None:
    """Net steps: those of Table 3's P6 less P0, each rounded to whole steps."""
    done, _ = demo
    _, (sent, _, error_deg) = rows(done.output, joint)
    assert sent == net_steps
    assert abs(error_deg) < 0.2  # two encoder counts


def test_its_trajectory_file_runs_again(demo: tuple[Ended, Path]) -> None:
    _, folder = demo
    again = commandline.run("run", folder / "trajectory.json", folder=folder.parent.parent)
    assert again.exit_code == 0, again.errors
    first, second = (
        run_reader.load(folder.with_name(name)).repetitions[0] for name in ("feed-001", "feed-002")
    )
    assert first.commanded_steps[-1].tolist() == second.commanded_steps[-1].tolist()


def test_without_matplotlib_it_says_what_is_missing_and_keeps_the_run(tmp_path: Path) -> None:
    blocked = tmp_path / "blocked"
    (blocked / "matplotlib").mkdir(parents=True)
    (blocked / "matplotlib" / "__init__.py").write_text(BLOCKED, encoding="utf-8")
    done = commandline.run("demo", folder=tmp_path, PYTHONPATH=str(blocked))
    assert done.exit_code == 0, done.errors
    done.said("no report", "matplotlib", "pip install 'armtempo[plot]'", "armtempo report")
    assert run_reader.load(tmp_path / "runs" / "feed-001").repetitions[0].state == "complete"
    assert "joint 1" in done.output
