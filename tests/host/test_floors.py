"""Floors: no plan beats them; brake times: changes of speed that take them keep the limits, shorter ones do not."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Limits
from armtempo.planning import (
    brake_time,
    dual_bound,
    lower_bounds,
    planner,
    point_to_point,
    ramp_excess,
    rest_to_rest,
    via_bound,
)
from armtempo.planning.dual_bound import Cells, Multipliers
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.splines import bspline
from armtempo.splines.trajectory import Trajectory
from armtempo_shared.motion import EVEN_RAMP

from tests import ramps
from tests.host import problems
from tests.host.problems import FEEDING, LIMITS


def test_joint_1_from_rest_to_rest() -> None:
    assert rest_to_rest.lower_bound_s(np.array([0.0, 180.0]), LIMITS[0]) == pytest.approx(
        4.0 + 0.6 + 1 / 3, rel=1e-12
    )


def test_short_way_reaches_neither_speed_nor_acceleration() -> None:
    """Four jerk phases: way 2 J t³, t each."""
    phase = 0.1
    assert rest_to_rest.lower_bound_s(np.array([0.0, 2 * 150 * phase**3]), LIMITS[0]) == pytest.approx(
        4 * phase, rel=1e-9
    )


def test_a_turn_may_keep_its_acceleration() -> None:
    """Between two turns: hold a, swing to -a, hold it."""
    limits = Limits(1e9, 10.0, 20.0)
    both_free = rest_to_rest.lower_bound_s(
        np.array([0.0, 7.0, 0.0, 7.0]), limits
    ) - rest_to_rest.lower_bound_s(np.array([0.0, 7.0, 0.0]), limits)
    hold, swing = _between_turns(7.0, limits)
    assert both_free == pytest.approx(2 * hold + swing, rel=1e-6)


@pytest.mark.parametrize("seed", [3406, 4629, 5963])
def test_ways_of_a_millionth_of_a_degree_at_1000_deg(seed: int) -> None:
    """The last digits of such angles are a part of the way; these plans are the fastest there are."""
    arm, job = problems.random_problem(seed)
    searches = planner.plan(arm, job).searches
    assert all(0.0 < search.lower_bound_s < search.total_s for search in searches)
    assert any(search.lower_bound_s > (1 - 1e-8) * search.total_s for search in searches)


def _between_turns(way: float, limits: Limits) -> tuple[float, float]:
    """Time at full acceleration on each side, and of the swing between, by integration."""
    a, swing = limits.acceleration_deg_s2, 2 * limits.acceleration_deg_s2 / limits.jerk_deg_s3
    low, high = 0.0, 10.0
    for _ in range(60):
        hold = (low + high) / 2
        time = np.linspace(0, 2 * hold + swing, 20_001)
        acceleration = np.clip(a - limits.jerk_deg_s3 * (time - hold), -a, a)
        speed = np.concatenate([[0], np.cumsum((acceleration[1:] + acceleration[:-1]) / 2) * time[1]])
        reached = float(np.sum((speed[1:] + speed[:-1]) / 2) * time[1])
        low, high = (hold, high) if reached < way else (low, hold)
    return low, swing


def test_floor_falls_with_every_limit() -> None:
    turns = np.array([-60.0, -110.0, -38.0])
    base = rest_to_rest.lower_bound_s(turns, LIMITS[1])
    for factors in ((2, 1, 1), (1, 2, 1), (1, 1, 2)):
        looser = Limits(*(value * factor for value, factor in zip(LIMITS[1].values, factors, strict=True)))
        assert rest_to_rest.lower_bound_s(turns, looser) < 0.999 * base, factors


def test_turns_of_the_paper_joints() -> None:
    points = bspline.fit(FEEDING, 5)
    assert lower_bounds.turns(points[:, 0], 5) == pytest.approx([0, 180], abs=1e-9)
    assert lower_bounds.turns(points[:, 1], 5) == pytest.approx([-60, -110.32, -38], abs=0.01)
    assert lower_bounds.turns(points[:, 2], 5) == pytest.approx([40, 70.05, -52], abs=0.01)


def test_path_floor_of_the_paper_motion() -> None:
    """With jerk: within 2 % of the best motion known on this path, 7.2269 s, and below it."""
    found = lower_bounds.of_path(bspline.fit(FEEDING, 5), 5, LIMITS, 7.25)
    assert found.kind == "path"
    assert 0.98 * 7.2269 <= found.time_s <= 7.2268


@pytest.mark.parametrize("about_s", [3.0, 7.0, 40.0])
def test_path_floor_depends_little_on_the_time_it_is_told(about_s: float) -> None:
    assert lower_bounds.of_path(bspline.fit(FEEDING, 5), 5, LIMITS, about_s).time_s == pytest.approx(
        7.14, rel=0.02
    )


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("joint", range(3))
def test_duality_comes_near_the_closed_form_of_one_joint(joint: int, degree: int) -> None:
    points = bspline.fit(FEEDING[:, [joint]], degree)
    exact = rest_to_rest.lower_bound_s(
        lower_bounds.turns(points[:, 0], degree), LIMITS[joint], from_rest=degree == 5
    )
    found = lower_bounds._path_s(points, degree, [LIMITS[joint]], exact)
    assert 0.97 * exact <= found <= exact


def test_a_straight_path_takes_its_slowest_joint() -> None:
    """All joints in proportion: no floor is higher than the time of the joint with the least room."""
    points = bspline.fit(np.outer([0.0, 1.0, 2.0, 3.0], [30.0, 10.0]), 5)
    both = [Limits(50, 50, 500), Limits(10, 5, 50)]
    found = lower_bounds.of_path(points, 5, both, 5.0)
    ways = zip((90.0, 30.0), both, strict=True)
    alone = [rest_to_rest.lower_bound_s(np.array([0.0, way]), limit) for way, limit in ways]
    assert found.time_s == pytest.approx(max(alone), rel=1e-8)


@pytest.mark.parametrize("seed", range(20))
def test_whatever_the_multipliers_the_bound_is_below_every_motion(seed: int) -> None:
    """By weak duality: multipliers that are far from the best only make it lower."""
    rng = np.random.default_rng(seed)
    points = bspline.fit(FEEDING, 5)
    pieces = bspline.subdivide(bspline.polynomials(points, 5), 4)
    unit_s = 7.25 / len(pieces)
    cells = Cells(pieces, np.array([limit.values for limit in LIMITS]) * unit_s ** np.arange(1, 4), True)
    best = dual_bound.best_multipliers(cells)
    scattered = (
        each * np.exp(rng.normal(0, 0.3, each.shape)) for each in (best.jerk, best.acceleration, best.speed)
    )
    assert lower_bounds.value(cells, Multipliers(*scattered)) * unit_s <= 7.2268, f"seed {seed}"


def random_motion(seed: int, most: int = 25) -> tuple[Arm, Job]:
    """Two to ``most`` via points, limits over some decades, on one axis."""
    rng = np.random.default_rng(seed)
    count = int(np.exp(rng.uniform(np.log(2), np.log(most))))
    joints = int(rng.integers(2, 5))
    via = rng.normal(0, 30, (count, joints))
    if seed % 3 == 0:
        via = np.cumsum(via, axis=0)
    limits = 10.0 ** rng.uniform([0.5, 0.5, 1], [2.5, 3.5, 5], (joints, 3))
    job = Job(
        "random",
        tuple(map(tuple, via.tolist())),
        iterations=5,
        population=4,
        refine=1,
        seed=seed,
        path="through",
    )
    return problems.make_arm(limits.tolist()), job


@pytest.mark.slow
@pytest.mark.seeds(*range(2))
def test_no_plan_is_below_its_floor(seed: int) -> None:
    arm, job = random_motion(seed)
    plan = planner.plan(arm, job)
    (search,) = plan.searches
    assert 0.0 < search.lower_bound_s <= plan.total_s, f"seed {seed}"


@pytest.mark.long
@pytest.mark.slow
def test_many_via_points_and_jerk_that_hardly_matters() -> None:
    """Where a floor without an error bound was 8 % above the plan."""
    rng = np.random.default_rng(1)
    via = tuple(map(tuple, rng.normal(0, 40, (100, 3)).tolist()))
    arm = problems.make_arm([[50.0, 50.0, 1e5]] * 3)
    plan = planner.plan(arm, Job("many", via, refine=1, iterations=5, population=4, path="through"))
    assert 0.85 * plan.total_s <= plan.searches[0].lower_bound_s <= plan.total_s


def test_floor_of_a_free_path_counts_turns_stops_and_dwells() -> None:
    via = np.array([[0.0, 5.0], [40.0, 6.0], [10.0, 7.0]])
    limits = [Limits(50, 50, 150)] * 2
    through = lower_bounds.of_vias(via, limits, {})
    assert through.kind == "vias"
    assert through.time_s == pytest.approx(rest_to_rest.lower_bound_s(via[:, 0], limits[0]), rel=1e-8)
    resting = lower_bounds.of_vias(via, limits, {1: 0.0})
    alone = [rest_to_rest.lower_bound_s(np.array([0.0, way]), limits[0]) for way in (40.0, 30.0)]
    assert resting.time_s == pytest.approx(sum(alone), rel=1e-8)
    assert lower_bounds.of_vias(via, limits, {1: 2.5}).time_s == pytest.approx(resting.time_s + 2.5, rel=1e-8)
    loose = lower_bounds.of_vias(via, limits, {}, {1})
    assert loose.time_s == pytest.approx(
        rest_to_rest.lower_bound_s(np.array([0.0, 10.0]), limits[0]), rel=1e-8
    )


@pytest.mark.slow
@pytest.mark.parametrize(("name", "kind"), [("feeding", "vias"), ("feeding-shared", "together")])
def test_floor_of_a_free_path_is_little_below_its_plan(name: str, kind: str) -> None:
    problem = next(each for each in problems.load() if each.name == name)
    job = replace(problem.job, path="free", refine=6, starts=1)
    for search in planner.plan(problem.arm, job).searches:
        assert search.lower_bound_kind == kind
        assert 0.97 * search.total_s <= search.lower_bound_s <= search.total_s


ABOUT_S = np.array([1.123, 1.597, 1.296, 0.8, 0.609, 1.397])
"""From via point to via point on the best free motion known through those of FEEDING, 6.822 s."""


@pytest.mark.parametrize("factors", [1.0, 0.8, 2.0, np.array([1, 3, 1, 1, 0.2, 1])])
def test_free_floor_holds_for_any_expected_times(factors: float | np.ndarray) -> None:
    limits = np.array([limit.values for limit in LIMITS])
    found = via_bound.lower_bound_s(FEEDING, limits, ABOUT_S * factors)
    assert (0.98 if np.all(factors == 1.0) else 0.0) * 6.8222 <= found <= 6.8222


@pytest.mark.parametrize("seed", range(5))
def test_free_floor_holds_for_any_multipliers(seed: int) -> None:
    """The bound of E between two durations holds, too."""
    rng = np.random.default_rng(seed)
    size = np.ptp(FEEDING, axis=0)
    ways, limits = (
        np.diff(FEEDING, axis=0) / size,
        np.array([limit.values for limit in LIMITS]) / size[:, None],
    )
    chosen = rng.normal(0, 0.3, (6, 3, 3, via_bound._COLUMNS))
    ends = rng.normal(0, 0.3, (7, 3, 2))
    chosen[..., via_bound._ENDS] = np.concatenate([ends[:-1], ends[1:]], axis=-1)[:, None]
    scan = via_bound._Scan(ways, limits, ABOUT_S[:, None] * via_bound._TRIAL_TIMES, chosen)
    low = scan._between()
    for s in rng.uniform(0, 1, 20):
        times, x = (each[:-1] + s * np.diff(each, axis=0) for each in (scan.times, scan.x))
        cost = via_bound._Cost.of(ways[scan.leg[:-1]], limits, times)
        together = np.isfinite(low)
        assert np.all((cost.exact(x, cost.arguments(x)) + 1e-7 * (1 + np.abs(low)) >= low)[together])
    assert scan.lower_bounds().sum() <= 6.8222


@pytest.mark.parametrize(("count", "joints"), [(1, 2), (2, 1), (5, 3), (9, 6)])
def test_equations_of_the_dual_are_solved(count: int, joints: int) -> None:
    """Like the dense matrix D + S' B S that they stand for; how wide the band is does not depend on the joints."""
    rng = np.random.default_rng(count)
    pieces = bspline.polynomials(rng.normal(0, 1, (count + 5, joints)), 5)
    kkt = dual_bound._Dual(Cells(pieces, np.ones((joints, 3)), True)).kkt
    size, points = int(kkt._columns.max()) + 1, kkt._slopes.shape[1] // 2 * count
    slopes = np.zeros((count, 2 * points // count, size))
    for cell, own in enumerate(kkt._columns):
        slopes[cell][:, own] = kkt._slopes[cell]
    roots = rng.normal(0, 1, (2, 2, points))
    blocks = np.einsum("abp,cbp->acp", roots, roots)
    diagonal = rng.uniform(0.5, 2, size)
    flat = slopes.reshape(points, 2, size)
    dense = np.diag(diagonal) + np.einsum("pax,abp,pby->xy", flat, blocks, flat)
    gradient = rng.normal(0, 1, size)
    step = kkt.factor(np.concatenate([blocks.ravel(), diagonal])).solve(gradient, np.empty(0))
    assert dense @ step == pytest.approx(-gradient, rel=1e-8, abs=1e-8)
    assert kkt._rows == 24


# brake times: changes of speed that take them keep the limits from anywhere, and shorter ones do not


PROBLEMS = {problem.name: problem for problem in problems.load()}


def changed_excess(
    trajectory: Trajectory,
    limits: list[Limits],
    starts_s: Array,
    lengths_s: Array,
    rate: tuple[float, float],
    shapes: Array,
) -> Array:
    """Largest speed, and acceleration or jerk, over their limits as the rate goes from one to the other: (starts, 2).

    By differences of the stretched motion; after its end it rests, so differences there do not count.
    """
    before, after = rate
    x = np.linspace(0.0, 1.0, 151)
    passed = np.array([ramps.passed(x, before, after, shape) for shape in shapes])
    times = starts_s[:, None] + lengths_s[:, None] * passed
    values = trajectory(times.ravel()).reshape(*times.shape, -1)
    allowed = np.array([limit.values for limit in limits])
    worst = []
    for order in (1, 2, 3):
        values = np.diff(values, axis=1) * 150 / lengths_s[:, None, None]
        inside = times[:, order:, None] < trajectory.duration_s
        worst.append(np.max(np.abs(values) * inside / allowed[:, order - 1], axis=(1, 2)))
    return np.column_stack([worst[0], np.maximum(*worst[1:])])


def every_start(trajectory: Trajectory, count: int = 61) -> Array:
    """Starts that are no multiples of those that were tried."""
    return np.linspace(0.0, trajectory.duration_s, count, endpoint=False)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["feeding", "feeding-shared", "there-and-back"])
def test_every_change_keeps_its_limits_from_anywhere_and_quicker_ones_do_not(name: str) -> None:
    plan = planner.plan(PROBLEMS[name].arm, replace(PROBLEMS[name].job, iterations=100))
    limits = [joint.limits for joint in plan.arm.driven if joint.limits]
    brakes = brake_time.of_motion(plan.trajectory, limits)
    starts = every_start(plan.trajectory)
    for lengths, rates in (
        (brakes.rest_s(starts), ((1.0, 0.0), (0.6, 0.0))),
        (brakes.change_s(starts), ((0.0, 1.0), (0.95, 0.6), (0.1, 0.7))),
    ):
        for rate in rates:
            shapes = np.full(len(starts), EVEN_RAMP) if rate[1] else brakes.rest_shapes(starts)
            found = changed_excess(plan.trajectory, limits, starts, lengths, rate, shapes)
            assert found[:, 0].max() <= 1 + 1e-6
            assert found[:, 1].max() <= ramp_excess.EXCESS * 1.02, rate
    quicker = changed_excess(
        plan.trajectory, limits, starts, 0.85 * brakes.rest_s(starts), (1.0, 0.0), brakes.rest_shapes(starts)
    )
    assert np.mean(quicker[:, 1] > ramp_excess.EXCESS) > 0.6


def test_braking_near_an_end_is_quick() -> None:
    """The times follow the motion: at its ends, where it is slow, it takes a part of what the worst takes."""
    arm = Arm.paper()
    motion = point_to_point.straight("go", [0.0, -60.0, 40.0], [40.0, -50.0, 50.0], arm)
    brakes = brake_time.of_motion(motion, [joint.limits for joint in arm.driven])
    late = brakes.rest_s(0.9 * motion.duration_s)
    assert late < 0.3 * brakes.longest_rest_s


def test_a_long_slow_jog_brakes_within_its_limits_in_its_ramps() -> None:
    """Its ramps are a thousandth of it: with equidistant entries, braking in them took 1.85 times what is allowed."""
    arm = Arm.load("moveo")
    limits = [joint.limits for joint in arm.driven]
    motion = jog_motion.plan("jog", arm, arm.home_deg, JogMove(math.inf, joint=3), 0.01).trajectory
    brakes = brake_time.of_motion(motion, limits)
    ramps_s = np.linspace(0.0, 0.4, 20)
    starts = np.concatenate(
        [ramps_s, motion.duration_s - ramps_s[1:], np.linspace(1.0, motion.duration_s - 1.0, 9)]
    )
    for lengths, rate, shapes in (
        (brakes.rest_s(starts), (1.0, 0.0), brakes.rest_shapes(starts)),
        (brakes.change_s(starts), (0.0, 1.0), np.full(len(starts), EVEN_RAMP)),
    ):
        assert (
            changed_excess(motion, limits, starts, lengths, rate, shapes)[:, 1].max()
            <= 1.02 * ramp_excess.EXCESS
        )


def test_the_worst_change_of_rate_needs_the_whole_brake_time() -> None:
    """In a motion of 0.7 s, where it matters how far the motion continues meanwhile."""
    arm = Arm.paper()
    motion = point_to_point.straight("go", [0.0, -60.0, 40.0], [1.0, -60.0, 40.0], arm)
    limits = [joint.limits for joint in arm.driven]
    brakes = brake_time.of_motion(motion, limits)
    starts = every_start(motion, 121)
    worst = max(
        changed_excess(motion, limits, starts, lengths, rate, shapes)[:, 1].max()
        for lengths, rate, shapes in (
            (brakes.rest_s(starts), (1.0, 0.0), brakes.rest_shapes(starts)),
            (brakes.change_s(starts), (0.0, 1.0), np.full(len(starts), EVEN_RAMP)),
        )
    )
    assert 0.97 * ramp_excess.EXCESS <= worst <= 1.01 * brake_time.EXCESS


def test_a_motion_beyond_its_limits_has_no_brake_times() -> None:
    arm = Arm.paper()
    motion = point_to_point.straight("go", [0.0, -60.0, 40.0], [40.0, -50.0, 50.0], arm)
    tight = [replace(joint.limits, jerk_deg_s3=joint.limits.jerk_deg_s3 / 2) for joint in arm.driven]
    with pytest.raises(InputError, match="beyond the arm's acceleration or jerk limits"):
        brake_time.of_motion(motion, tight)


def test_a_brake_beyond_the_longest_ramp_has_the_longest() -> None:
    """Entries cannot be longer than the record's; those next to them still end up within the limits."""
    arm = Arm.paper()
    limits = Limits(speed_deg_s=90.0, acceleration_deg_s2=0.5, jerk_deg_s3=0.05)
    slow = replace(
        arm, joints=[replace(joint, limits=limits) if joint.limits else joint for joint in arm.joints]
    )
    motion = point_to_point.straight("go", [0.0, -60.0, 40.0], [60.0, -50.0, 50.0], slow)
    brakes = brake_time.of_motion(motion, [limits] * 3)
    assert brakes.longest_rest_s == pytest.approx(ramp_excess.LONGEST_S)
    assert brakes.rest_s(0.0) < 1.0


def evaluated(trajectory: Trajectory, limits: list[Limits], monkeypatch: pytest.MonkeyPatch) -> int:
    """How many pairs of acceleration and jerk the brake times of a motion take."""
    excess, found = ramp_excess.Ramps.excess, []

    def counted(ramps: ramp_excess.Ramps, starts: Array, *rest: Any) -> Array:
        _, rates, _, phases = rest
        found.append(len(starts) * len(rates) * 3 * phases * len(ramps._factors))
        return excess(ramps, starts, *rest)

    with monkeypatch.context() as patched:
        patched.setattr(ramp_excess.Ramps, "excess", counted)
        brake_time.of_motion(trajectory, limits)
    return sum(found)


def test_joints_that_stand_still_or_move_in_proportion_cost_no_brake_times(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A bisection for every shape, start and joint took some 15 million for six joints, the same starts for all 1."""
    arm = Arm.load("ar4")
    limits = [joint.limits for joint in arm.driven]
    here = np.array([20.0, 10.0, -20.0, 15.0, 40.0, 30.0])
    one = point_to_point.straight("go", here, here + np.array([0, 9, 0, 0, 0, 0]), arm)
    all_of_them = point_to_point.straight("go", here, here + np.array([9, 9, -9, 9, 9, -9]), arm)
    alone = evaluated(one, limits, monkeypatch)
    assert alone < 150_000
    assert evaluated(all_of_them, limits, monkeypatch) < 1.2 * alone
    for single, whole in zip(
        brake_time.of_motion(one, limits).to_rest,
        brake_time.of_motion(all_of_them, limits).to_rest,
        strict=True,
    ):
        assert single == pytest.approx(whole, abs=2.0)
