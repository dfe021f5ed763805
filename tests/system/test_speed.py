"""Runs at another speed than planned, changes of it while they run, pauses: library, commands, report."""

from __future__ import annotations

from pathlib import Path

import armtempo
import numpy as np
import pytest
from armtempo.basics.errors import BoardError, InputError
from armtempo.link.board_messages import Sample
from armtempo.planning import brake_time, ramp_excess
from armtempo.report import replayed
from armtempo.report.evaluation import evaluate
from armtempo.report.run import Run
from armtempo.robot.recording import Watcher
from armtempo.simulator import LaunchOptions, launch
from armtempo_shared.motion import EVEN_RAMP

from tests import ramps
from tests.system import commandline
from tests.system.commandline import small_plan

NEAR_DEG = 0.03
"""More than half a step and a sample's 20 us."""


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> armtempo.Plan:
    return armtempo.Plan.load(small_plan(tmp_path_factory.mktemp("speed") / "small.json"))


def check_on_path(run: Run, plan: armtempo.Plan) -> None:
    """Every sample is where the plan is at the sample's own time of the motion, and that continues to the end."""
    samples = run.samples[run.samples["repetition"] == 1]
    off = samples["commanded_deg"] - plan.trajectory(samples["path_s"])
    assert np.max(np.abs(off)) < NEAR_DEG
    assert np.all(np.diff(samples["path_s"]) >= 0)
    assert np.all(samples["path_s"] <= samples["time_s"] + 1e-6)
    assert samples["path_s"][-1] >= plan.total_s - 1e-6


@pytest.mark.long
def test_half_the_speed_takes_twice_the_time_on_the_same_path(plan: armtempo.Plan, tmp_path: Path) -> None:
    with armtempo.connect("sim", plan.arm) as board:
        board.speed(0.5)
        run = board.run(plan, repeat=2, out=tmp_path)
    assert run.complete
    check_on_path(run, plan)
    first = run.samples[run.samples["repetition"] == 1]
    np.testing.assert_allclose(first["path_s"], first["time_s"] / 2, atol=1e-6)
    assert first["time_s"][-1] == pytest.approx(2 * plan.total_s, abs=1e-4)
    found = evaluate(run.path)
    assert [text for text in found.complaints if "ran at 50 % of the planned speed" in text]
    curves = found.legs[0].curves
    assert np.nanmax(np.abs(curves.mean[0] - curves.theory[0])) < 0.5
    speed = np.abs(curves.theory[1]).max(axis=0)
    planned = np.abs(plan.trajectory(np.linspace(0, plan.total_s, 200), 1)).max(axis=0)
    np.testing.assert_allclose(speed, planned / 2, rtol=0.05)


class Changing(Watcher):
    """Changes the speed, pauses and continues as samples come."""

    def __init__(self, board: armtempo.Board) -> None:
        self._board = board
        self.pause_s: list[float] = []

    def on_sample(self, sample: Sample, duration_s: float) -> None:
        at = {3: 0.0, 40: -1.0, 70: 1.0}.get(sample.index)
        if at == 0.0:
            self._board.pause()
        elif at == -1.0:
            self._board.resume()
        elif at is not None:
            self._board.speed(at)


@pytest.mark.long
def test_changes_and_a_pause_while_it_runs(plan: armtempo.Plan, tmp_path: Path) -> None:
    with armtempo.connect("sim", plan.arm) as board:
        board.speed(0.3)
        run = board.run(plan, out=tmp_path, watcher=Changing(board))
        with pytest.raises(BoardError, match="nothing is moving"):
            board.pause()
        for wrong in (0.0, 0.005, 1.2, -1.0):
            with pytest.raises(InputError, match=r"0\.01 to 1|finite number"):
                board.speed(wrong)
    assert run.complete
    check_on_path(run, plan)
    resting = np.sum(np.diff(run.samples["path_s"]) == 0.0)
    assert resting > 10
    (repetition,) = run.repetitions
    assert "ran between 0 and" in replayed.speed_note(repetition)
    assert run.report().is_file()


def test_another_program_changes_the_speed(plan: armtempo.Plan, tmp_path: Path) -> None:
    file = tmp_path / "small.json"
    plan.save(file)
    with launch(LaunchOptions(tmp_path / "flash", virtual_time=False, instant_flash=True)) as board:

        def on_board(*arguments: str | Path, code: int = 0) -> str:
            return commandline.armtempo(*arguments, "--port", board.port, folder=tmp_path, code=code)

        on_board("home", "--arm", "paper")
        assert "nothing moves" in on_board("speed", "50", code=1)
        on_board("speed", "0.5", code=2)
        on_board("run", file, "--speed", "101", code=2)
        on_board("goto", file, "--arm", "paper")
        running = commandline.start("run", file, "--speed", "5", "--port", board.port, folder=tmp_path)

        def slow() -> bool:
            assert running.poll() is None, running.communicate()
            return "at 5 % of the planned speed" in on_board("status")

        commandline.wait_for(slow, "the run")
        assert "through" in on_board("pause")
        assert "paused" in on_board("status")
        on_board("resume")
        assert "at 5 %" in on_board("status")
        on_board("speed", "100")
        output, _ = running.communicate(timeout=commandline.SLOW_S)
        assert running.returncode == 0, output
        assert "complete" in output


@pytest.mark.long
def test_changes_keep_the_brake_times_limits() -> None:
    """Numerically, on the stretched path itself: any two rates, anywhere, acceleration and jerk within EXCESS."""
    rng = np.random.default_rng(20_264)
    arm = commandline.ARM
    limits = [joint.limits for joint in arm.driven]
    allowed = np.array([limit.values for limit in limits])
    for _ in range(2):
        ends = [np.array([30.0, -70.0, 20.0]) + rng.uniform(-25, 25, 3) for _ in range(2)]
        job = armtempo.Job(
            "any",
            via_deg=[ends[0], (ends[0] + ends[1]) / 2 + 3, ends[1]],
            population=5,
            iterations=5,
            path="through",
        )
        trajectory = armtempo.plan(arm, job).trajectory
        brakes = brake_time.of_motion(trajectory, limits)
        worst = 0.0
        for _ in range(60):
            before, after = (
                rng.uniform(0.01, 1.0, 2)
                if rng.random() < 0.6
                else rng.permutation([0.0, rng.uniform(0.1, 1.0)])
            )
            start = rng.uniform(0, trajectory.duration_s)
            step = float(brakes.change_s(start) if after else brakes.rest_s(start)) / 1500
            x = np.arange(1501) / 1500
            shape = EVEN_RAMP if after else int(brakes.rest_shapes(start))
            passed = 1500 * step * ramps.passed(x, before, after, shape)
            values = trajectory(np.minimum(start + passed, trajectory.duration_s))
            for order in range(3):
                values = np.diff(values, axis=0) / step
                if order:
                    worst = max(worst, float(np.max(np.abs(values[: -3 or None]) / allowed[:, order])))
        assert worst < ramp_excess.EXCESS * 1.02, worst
