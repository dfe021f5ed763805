"""Planning: the shipped job, problems of a file, 800 random jobs, refusals; fitness; what per-joint timing costs."""

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
from armtempo.model.parts import Limits, LimitSwitches
from armtempo.model.plan import Plan
from armtempo.model.tool_segment import ToolSegment
from armtempo.planning import checks, lower_bounds, path_deviation, planner, torque
from armtempo.planning.fitness import Fitness, scale_of
from armtempo.planning.lower_bounds import Floor
from armtempo.report import text_summary
from armtempo.splines import bspline, extremes, time_axis
from armtempo.splines.trajectory import JointSpline
from armtempo_shared.limits import MAX_STEP_RATE

from tests.host import problems
from tests.host.problems import FEEDING, LIMITS, dense

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
        assert search.floor_s <= search.total_s * 1.001, label


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
def test_joint_1_over_ten_seeds() -> None:
    via = tuple((angles[0],) for angles in JOB.via if isinstance(angles, tuple))
    arm = replace(ARM, joints=ARM.joints[:1])
    totals = [planner.plan(arm, replace(JOB, via=via, seed=seed)).trajectory.duration_s for seed in range(10)]
    assert np.median(totals) <= 6.04, f"seeds 0 to 9: {totals}"


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
    """200 jobs each; floors have their own test."""
    monkeypatch.setattr(lower_bounds, "of_path", lambda *_: Floor(math.ulp(0.0), "rests"))
    planned = 0
    for number in range(200 * seed, 200 * seed + 200):
        arm, job = problems.random_problem(number)
        if np.all(np.ptp(job.via, axis=0) == 0):
            with pytest.raises(PlanError, match="nothing moves"):
                planner.plan(arm, job)
            continue
        plan = planner.plan(arm, job)
        (check_thoroughly if number % 20 == 0 else check)(plan, f"job {number}")
        planned += 1
    assert planned > 140


@pytest.mark.slow
@pytest.mark.parametrize("timing", ["shared", "per-joint"])
def test_what_the_driver_needs_is_a_limit_of_planning(timing: str) -> None:
    """Of a step every 60 us, and of opposite steps 1.2 ms apart."""
    slow = replace(ARM.driver, pulse_us=30.0, low_us=30.0, dir_setup_us=500.0, dir_hold_us=500.0)
    fast = Limits(500.0, 5000.0, 50_000.0)
    arm = replace(ARM, driver=slow, joints=tuple(replace(each, limits=fast) for each in ARM.joints))
    plan = planner.plan(arm, replace(JOB, timing=timing, refine=2, starts=1))
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


def with_limits(*limits: float) -> Arm:
    """The shipped arm with other limits in joint 1."""
    first = replace(ARM.joints[0], limits=Limits(*limits))
    return replace(ARM, joints=(first, *ARM.joints[1:]))


@pytest.mark.parametrize(
    ("arm", "changes", "message"),
    [
        (ARM, {"via": ((0.0, -60.0, 40.0),)}, "at least 2 via points with 3 angles"),
        (ARM, {"via": ((0.0, -60.0), (1.0, -60.0))}, "at least 2 via points with 3 angles"),
        (ARM, {"via": ((0.0, -60.0, math.nan), (1.0, -60.0, 40.0))}, "via is .*finite number"),
        (ARM, {"timing": "both"}, "'both'"),
        (ARM, {"refine": 0}, "refine 0"),
        (ARM, {"optimiser": "magic"}, "'magic'"),
        (ARM, {"parameters": {"fitness": "magic"}}, "'magic'"),
        (ARM, {"parameters": {"speed": 1.0}}, "'speed'"),
        (with_limits(-1.0, 50.0, 150.0), {}, "positive numbers"),
        (with_limits(50_000.0, 50.0, 150.0), {}, "1777778 steps/s"),
        (Arm("bare", ARM.joints[3:]), {}, "no joint has a motor"),
    ],
)
def test_refuses_wrong_input(arm: Arm, changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        planner.plan(arm, replace(JOB, **changes))


def test_no_plan_goes_beyond_a_switch_within_the_range() -> None:
    arms = [
        replace(ARM, joints=(replace(ARM.joints[0], switches=switches), *ARM.joints[1:]))
        for switches in (LimitSwitches(low=1, low_deg=0.0), LimitSwitches(low="PD0", low_deg=0.0))
    ]
    job = Job("back", via=((20.0, -60.0, 40.0), (-5.0, -60.0, 40.0)))
    with pytest.raises(PlanError, match="beyond its low switch, which stops it at 0"):
        planner.plan(arms[0], job)
    assert planner.plan(arms[1], job).total_s  # read while homing only
    assert planner.plan(arms[0], replace(job, via=((20.0, -60.0, 40.0), (0.0, -60.0, 40.0)))).total_s


def test_no_motor_is_faster_than_its_torque_curve_goes() -> None:
    """Joint 1 at 40 deg/s is 13.3 rpm."""
    first = ARM.joints[0]
    assert first.motor is not None
    motor = replace(first.motor, curve_rpm_nm=((0.0, 0.5), (10.0, 0.4)))
    arm = replace(ARM, joints=(replace(first, motor=motor), *ARM.joints[1:]))
    plan = planner.plan(arm, Job("turn", via=((0.0, -60.0, 40.0), (180.0, -60.0, 40.0))))
    most = 60.0 / motor.gear_ratio
    assert plan.extremes[0].speed_deg_s == pytest.approx(most, rel=1e-3)
    assert torque.held_nm(arm.driven[0], np.radians(plan.extremes[0].speed_deg_s * motor.gear_ratio)) > 0.39
    assert any(f"its curve_rpm_nm ends at 10 rpm: planned with {most:.4g}" in note for note in plan.notes)


@pytest.mark.parametrize(
    ("via", "limits", "bounds_s"),
    [
        ((0.0, 10.0, 30.0), (1e-200, 1e-200, 1e-200), (0.1, 3.0)),
        ((0.0, 10.0, 30.0), (50.0, 50.0, 150.0), (1e300, 1e301)),
        ((0.0, 10.0, 30.0), (50.0, 50.0, 150.0), (1e-200, 1e-199)),
        ((0.0, 1e150, 3e150), (50.0, 50.0, 150.0), (0.1, 3.0)),
    ],
)
def test_refuses_sizes_that_cannot_be_computed_with(
    via: tuple[float, ...], limits: tuple[float, ...], bounds_s: tuple[float, float]
) -> None:
    arm = problems.make_arm([limits], (-1e160, 1e160))
    job = Job("far", tuple((angle,) for angle in via), bounds_s=bounds_s, iterations=5, path="through")
    with pytest.raises(PlanError, match="too different in magnitude"):
        planner.plan(arm, job)


@pytest.mark.slow
def test_refuses_more_steps_than_the_board_makes_together() -> None:
    fast = problems.make_arm([[0.9 * MAX_STEP_RATE / 200 * 360 / 8, 1e9, 1e12]] * 6, microsteps=8)
    via = (tuple([0.0] * 6), tuple([1e6] * 6))
    with pytest.raises(PlanError, match="steps/s"):
        planner.plan(fast, Job("fast", via, iterations=5, path="through"))


def exact_ratios(points: np.ndarray, intervals: np.ndarray, degree: int) -> np.ndarray:
    """(J, 3)."""
    axis = time_axis.control_points(intervals, degree)
    joints = [JointSpline(degree, 1, column, axis) for column in points.T]
    return np.array([found.values for found in extremes.of_joints(joints)]) / [x.values for x in LIMITS]


@pytest.mark.parametrize("degree", [3, 5])
def test_sees_the_extremes(degree: int) -> None:
    points = bspline.fit(FEEDING, degree)
    fitness = Fitness(points, degree, LIMITS)
    population = np.random.default_rng(2).uniform(0.5, 2.5, (12, 6))
    peaks = fitness.peaks(population).max(axis=2)
    for number, intervals in enumerate(population):
        expected = exact_ratios(points, intervals, degree)
        assert pytest.approx(expected, rel=0.02) == peaks[:, :, number].T


@pytest.mark.parametrize("seed", range(5))
def test_the_scale_is_that_of_the_highest_peaks(seed: int) -> None:
    rng = np.random.default_rng(seed)
    fitness = Fitness(bspline.fit(rng.normal(0, 30, (9, 3)), 5), 5, LIMITS)
    population = rng.uniform(0.1, 3.0, (30, 8))
    assert np.array_equal(fitness.scale(population), scale_of(fitness.peaks(population).max(axis=(1, 2))))


def test_stretched_is_the_time_that_just_keeps_the_limits() -> None:
    points = bspline.fit(FEEDING, 5)
    population = np.random.default_rng(3).uniform(0.5, 2.5, (20, 6))
    found = Fitness(points, 5, LIMITS).stretched(population)
    for value, intervals in zip(found, population, strict=True):
        factor = scale_of(exact_ratios(points, intervals, 5).T).max()
        assert value == pytest.approx(factor * intervals.sum(), rel=0.005)
        assert scale_of(exact_ratios(points, intervals * factor, 5).T).max() == pytest.approx(1, rel=1e-9)


def test_stretched_does_not_depend_on_the_unit_of_time() -> None:
    fitness = Fitness(bspline.fit(FEEDING, 5), 5, LIMITS)
    population = np.random.default_rng(4).uniform(0.5, 2.5, (5, 6))
    assert fitness.stretched(population * 1e-4) == pytest.approx(fitness.stretched(population))


def segment_ratios(intervals_s: np.ndarray) -> np.ndarray:
    """Largest |speed|, |acceleration|, |jerk| over their limits in each segment, (3, J, m), on a fine grid."""
    axis = bspline.polynomials(time_axis.control_points(intervals_s, 5), 5)
    path = bspline.polynomials(bspline.fit(FEEDING, 5), 5)
    u = np.linspace(0.0, 1.0, 2001)
    q = [bspline_at(path, order, u) for order in range(4)]  # (m, U, J)
    t = [bspline_at(axis, order, u)[..., None] for order in range(4)]
    speed = q[1] / t[1]
    acceleration = (q[2] - speed * t[2]) / t[1] ** 2
    jerk = (q[3] - speed * t[3] - 3 * acceleration * t[1] * t[2]) / t[1] ** 3
    limits = np.array([limit.values for limit in LIMITS])
    found = [
        np.abs(each).max(axis=1).T / limits[:, [k]] for k, each in enumerate((speed, acceleration, jerk))
    ]
    return np.array(found)


def bspline_at(pieces: np.ndarray, order: int, u: np.ndarray) -> np.ndarray:
    """(m, U, ...)."""
    derived = bspline.derivative(pieces, order)
    return np.einsum("up,mp...->mu...", u[:, None] ** np.arange(derived.shape[1]), derived)


def test_penalised_is_the_time_where_limits_are_kept_and_more_elsewhere() -> None:
    fitness = Fitness(bspline.fit(FEEDING, 5), 5, LIMITS)
    assert fitness.penalised(np.full((1, 6), 3.0)) == pytest.approx([18.0])
    rng = np.random.default_rng(21)
    for fast in rng.uniform(0.3, 1.5, (5, 6)):
        excess = np.maximum(segment_ratios(fast) - 1.0, 0.0)
        assert (excess > 0).any(), "seed 21"
        assert fitness.penalised(fast[None])[0] == pytest.approx(fast.sum() + 30 * excess.sum(), rel=2e-3), (
            "seed 21"
        )


def test_one_joint_in_a_population_is_the_same_as_alone() -> None:
    fitness = Fitness(bspline.fit(FEEDING, 5), 5, LIMITS)
    population = np.random.default_rng(5).uniform(0.1, 3, (30, 6))
    together = fitness.stretched(population)
    alone = [fitness.stretched(one[None])[0] for one in population]
    assert together == pytest.approx(alone, rel=1e-12)


# what per-joint timing costs, and the summary that says so


SHORT = replace(Job.paper(ARM), iterations=120)


@pytest.fixture(scope="module")
def apart() -> Plan:
    return planner.plan(ARM, SHORT)


@pytest.fixture(scope="module")
def together() -> Plan:
    return planner.plan(ARM, replace(SHORT, timing="shared"))


def test_shared_timing_keeps_joints_and_tool_together(together: Plan) -> None:
    assert path_deviation.via_spread_s(together.trajectory) == pytest.approx(np.zeros(7), abs=1e-12)
    assert path_deviation.tool_stray_mm(ARM, together.trajectory) < 0.05


def test_per_joint_timing_separates_joints(apart: Plan) -> None:
    spread = path_deviation.via_spread_s(apart.trajectory)
    durations = [joint.duration_s for joint in apart.trajectory.joints]
    assert spread[0] == 0
    assert spread[-1] == pytest.approx(max(durations) - min(durations))
    assert spread.max() > 0.5


@pytest.mark.slow
def test_tool_strays_as_far_as_the_nearest_point_of_the_path_is(apart: Plan) -> None:
    """Against a plain search over u for the worst of a few times."""
    from armtempo.kinematics.forward import forward
    from armtempo.kinematics.geometry import Geometry
    from armtempo.splines.trajectory import Trajectory

    first = apart.trajectory.joints[0]
    same = tuple(replace(joint, time_points_s=first.time_points_s) for joint in apart.trajectory.joints)
    path = Trajectory("path", same, True)

    def tool(driven: np.ndarray) -> np.ndarray:
        angles = np.concatenate([driven, np.zeros((len(driven), 3))], axis=1)
        return forward(Geometry.of(ARM), np.radians(angles))[:, :3, 3]

    on_path = tool(path(np.linspace(0, path.duration_s, 20_001)))
    strays = [
        np.sqrt(((tool(apart.trajectory(np.array([time]))) - on_path) ** 2).sum(axis=1)).min()
        for time in np.linspace(0, apart.trajectory.duration_s, 300)
    ]
    assert path_deviation.tool_stray_mm(ARM, apart.trajectory) == pytest.approx(max(strays), rel=2e-3)


@pytest.mark.slow
def test_summary_says_times_floors_limits_and_strays(apart: Plan, together: Plan) -> None:
    text = text_summary.lines(apart)
    assert f"{apart.trajectory.duration_s:.4f} s" in text[0]
    for joint, search, line in zip(ARM.driven, apart.searches, text[3:6], strict=True):
        assert line.startswith(joint.name)
        assert f"{search.total_s:.4f}" in line
        assert f"{search.floor_s:.4f}" in line
        assert joint.limits is not None
        assert f"/ {joint.limits.speed_deg_s:g}" in line
    assert any("strays up to" in line for line in text)
    assert not any("strays" in line for line in text_summary.lines(together))
    assert all(len(line) <= 110 for line in text)


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
