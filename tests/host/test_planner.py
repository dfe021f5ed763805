"""Planning: the shipped job, problems of a file, random jobs; seeds, progress, and a planner for each job."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from armtempo.basics import progress
from armtempo.basics.errors import InputError, PlanError
from armtempo.encoding import encode
from armtempo.model.arm import Arm
from armtempo.model.job import Job, Stop
from armtempo.model.parts import Limits
from armtempo.model.plan import Plan
from armtempo.model.tool_segment import ToolSegment
from armtempo.planning import checks, lower_bounds, planner
from armtempo.planning.lower_bounds import LowerBound

from tests.host import problems
from tests.host.problems import dense

ARM = Arm.paper()
JOB = Job.paper(ARM)
PROBLEMS = problems.load()


def check(plan: Plan, label: str) -> None:
    """What every plan must be."""
    for joint, spline, reached in zip(plan.arm.driven, plan.trajectory.joints, plan.extremes, strict=True):
        assert joint.limits is not None
        assert np.all(reached.values <= np.array(joint.limits.values) * (1 + 1e-9)), label
        assert np.all(np.diff(spline.time_points_s) > 0), label
        assert spline.time_polynomials[0, 0] == pytest.approx(0, abs=1e-12 * spline.duration_s), label
    for search in plan.searches:
        assert search.lower_bound_s <= search.total_s * 1.001, label


def check_thoroughly(plan: Plan, label: str) -> None:
    """The same from a dense grid, and via angles, ends and times."""
    check(plan, label)
    size = max(1.0, float(np.abs(plan.via_deg).max()))
    for number, (joint, spline) in enumerate(zip(plan.arm.driven, plan.trajectory.joints, strict=True)):
        assert joint.limits is not None
        for order, limit in enumerate(joint.limits.values, 1):
            assert dense(spline, order, 60) <= limit * (1 + 1e-9), label
        assert spline(spline.via_times_s) == pytest.approx(plan.via_deg[:, number], abs=1e-9 * size), label
        ends = np.array([0.0, spline.duration_s])
        for order in (1, 2) if spline.degree == 5 else (1,):
            assert spline(ends, order) == pytest.approx([0, 0], abs=1e-6 * joint.limits.values[order - 1]), (
                label
            )


def test_shipped_job_keeps_its_limits_and_meets_the_paper() -> None:
    plan = planner.plan(ARM, JOB)
    check_thoroughly(plan, "shipped job")
    totals = [spline.duration_s for spline in plan.trajectory.joints]
    assert totals == pytest.approx([6.0321, 6.4096, 6.7944], rel=3e-3)
    for search in plan.searches:
        assert search.evaluations <= 2 * 10 * 500
        assert search.intervals_s.sum() == pytest.approx(search.total_s, rel=1e-12)
        assert len(search.history_s) == 501
        assert np.all(np.diff(search.history_s) <= 0)


@pytest.mark.slow
def test_joint_1_over_five_seeds() -> None:
    via = tuple((angles[0],) for angles in JOB.via if isinstance(angles, tuple))
    arm = replace(ARM, joints=ARM.joints[:1])
    totals = [planner.plan(arm, replace(JOB, via=via, seed=seed)).trajectory.duration_s for seed in range(5)]
    assert np.median(totals) <= 6.04, f"seeds 0 to 4: {totals}"


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda problem: problem.name)
def test_problem(problem: problems.Problem) -> None:
    job = replace(problem.job, iterations=60)
    if problem.expect == "plan":
        check_thoroughly(planner.plan(problem.arm, job), problem.name)
    else:
        with pytest.raises((PlanError, InputError), match=problem.expect):
            planner.plan(problem.arm, job)


@pytest.mark.slow
@pytest.mark.seeds(2)
def test_random_jobs_keep_their_limits_or_say_why_not(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """100 jobs each; bounds have their own test."""
    monkeypatch.setattr(lower_bounds, "of_path", lambda *_: LowerBound(math.ulp(0.0), "rests"))
    planned = 0
    for number in range(100 * seed, 100 * seed + 100):
        arm, job = problems.random_problem(number)
        steps = arm.transmission.steps(np.array(job.via))
        if job.via[0] == job.via[-1] and np.all(np.abs(steps - steps[0]) < 1.0):
            with pytest.raises(PlanError, match="nothing moves"):
                planner.plan(arm, job)
            continue
        plan = planner.plan(arm, job)
        (check_thoroughly if number % 20 == 0 else check)(plan, f"job {number}")
        planned += 1
    assert planned > 70


@pytest.mark.slow
@pytest.mark.parametrize("timing", ["shared", "per-joint"])
def test_what_the_driver_needs_is_a_limit_of_planning(timing: str) -> None:
    """Of a step every 60 us, and of opposite steps 1.2 ms apart."""
    slow = replace(ARM.driver, pulse_us=30.0, low_us=30.0, dir_setup_us=500.0, dir_hold_us=500.0)
    fast = Limits(500.0, 5000.0, 50_000.0)
    arm = replace(ARM, driver=slow, joints=tuple(replace(each, limits=fast) for each in ARM.joints))
    plan = planner.plan(arm, replace(JOB, timing=timing, refine=2, starts=1, iterations=60))
    check(plan, timing)
    rates = [
        one.speed_deg_s * joint.steps_per_deg for joint, one in zip(arm.driven, plan.extremes, strict=True)
    ]
    assert max(rates) == pytest.approx(1e6 / 60.0, rel=1e-3)
    for joint, one in zip(arm.driven, plan.extremes, strict=True):
        assert one.acceleration_deg_s2 * joint.steps_per_deg * 1.23e-3**2 <= 0.16
    assert any("a step every 60 us" in note for note in plan.notes)
    encode.motion_record(plan.trajectory, arm)


@pytest.mark.parametrize("timing", ["per-joint", "shared"])
def test_a_seed_repeats(timing: str) -> None:
    job = replace(JOB, timing=timing, iterations=40, seed=17)
    first, second = planner.plan(ARM, job), planner.plan(ARM, job)
    other = planner.plan(ARM, replace(job, seed=18))
    for one, two, three in zip(
        first.trajectory.joints, second.trajectory.joints, other.trajectory.joints, strict=True
    ):
        assert np.array_equal(one.time_points_s, two.time_points_s)
        assert not np.array_equal(one.time_points_s, three.time_points_s)


def test_shared_timing_passes_via_points_together() -> None:
    plan = planner.plan(ARM, replace(JOB, timing="shared", iterations=60))
    first, *others = plan.trajectory.joints
    assert plan.trajectory.shared
    assert all(np.array_equal(first.time_points_s, joint.time_points_s) for joint in others)
    assert plan.trajectory(first.via_times_s) == pytest.approx(plan.via_deg, abs=1e-9)


def test_a_joint_that_rests_takes_the_longest_axis() -> None:
    problem = next(problem for problem in PROBLEMS if problem.name == "one-joint-rests")
    plan = planner.plan(problem.arm, problem.job)
    assert [search.joints for search in plan.searches] == [(0,)]
    assert plan.trajectory.joints[1].duration_s == plan.trajectory.duration_s
    assert plan.trajectory(np.linspace(0, plan.trajectory.duration_s, 50))[:, 1] == pytest.approx(25.0)


@pytest.mark.parametrize("fitness", ["stretched", "penalised"])
@pytest.mark.parametrize("optimiser", ["acs", "cs", "pso"])
def test_other_searches_make_plans_too(fitness: str, optimiser: str) -> None:
    job = replace(JOB, optimiser=optimiser, parameters={"fitness": fitness}, iterations=60)
    check(planner.plan(ARM, job), optimiser)


@pytest.mark.parametrize(("refine", "polish"), [(1, False), (1, True), (2, True)])
def test_a_tiny_motion_takes_a_hundredth_of_a_second(refine: int, polish: bool) -> None:
    """Limits alone would let it take a tenth of that; a tenth of the time between two samples is the least."""
    arm = problems.make_arm([[100.0, 1e4, 1e8]])
    job = Job("tiny", ((0.0,), (1e-6,), (2e-6,)), iterations=20, refine=refine, polish=polish, path="through")
    plan = planner.plan(arm, job)
    assert plan.trajectory.duration_s == pytest.approx(0.01, rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("refine", [1, 2])
@pytest.mark.parametrize("polish", [False, True])
def test_progress_grows_to_the_whole(refine: int, polish: bool) -> None:
    seen: list[float] = []
    job = replace(JOB, iterations=5, refine=refine, polish=polish)
    planner.plan(ARM, job, lambda done, whole: seen.append(done / whole))
    assert seen == sorted(seen)
    assert 0.0 < seen[0] <= 0.1  # the first of five iterations, in the first of the stages
    assert seen[-1] == pytest.approx(1.0)


@pytest.mark.long
@pytest.mark.parametrize(
    "changes",
    [{}, {"path": "free", "refine": 4, "starts": 1}, {"path": "free", "corridor_mm": 0.01, "refine": 4}],
    ids=["through", "free", "corridor"],
)
def test_a_plan_can_be_ended_at_any_time(changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """By an exception out of its progress, called in each step of a solve 0.05 s after the last."""
    monkeypatch.setattr(progress, "_EVERY_S", 0.0)
    job = replace(JOB, via=JOB.via[:4], timing="shared", iterations=5, **{"refine": 8, **changes})
    watch = Ends(at=10**9)
    planner.plan(ARM, job, watch)
    assert watch.calls > 40
    assert len(set(watch.stages)) >= 2
    for at in (1, watch.calls // 3, watch.calls // 2, watch.calls - 1):
        with pytest.raises(InterruptedError):
            planner.plan(ARM, job, Ends(at))


class Ends:
    """A progress that ends the work with its call number ``at``."""

    def __init__(self, at: int) -> None:
        self.at, self.calls, self.stages = at, 0, list[str]()

    def __call__(self, done: float, whole: float) -> None:
        self.calls += 1
        if self.calls >= self.at:
            raise InterruptedError

    def stage(self, name: str) -> None:
        self.stages.append(name)


def test_each_job_has_a_planner_of_the_table() -> None:
    led = replace(JOB, tool_segments=(ToolSegment(1, line=True),))
    asked = {
        "through": replace(JOB, path="through"),
        "free": replace(JOB, path="free", stops=(Stop(1),)),
        "line": replace(JOB, path="through", stops=(Stop(1),)),
    }
    assert {name: checks.planner_of(job) for name, job in asked.items()} == {
        name: name for name in planner.PLANNERS
    }
    assert checks.planner_of(led) == checks.planner_of(replace(led, path="free")) == "line"
