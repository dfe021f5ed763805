"""Paths that are free between via points: what holds exactly, what is faster, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from math import comb

import numpy as np
import pytest
from armtempo.basics.errors import InputError, PlanError
from armtempo.kinematics.forward import forward
from armtempo.kinematics.geometry import Geometry
from armtempo.model.arm import Arm
from armtempo.model.job import Job, Stop
from armtempo.model.plan import Plan
from armtempo.model.tool_pose import Pose
from armtempo.optimise.reduced_kkt import ReducedFactor, ReducedKkt
from armtempo.planning import checks, collocation, motion_program, planner, rest_to_rest
from armtempo.planning.collocation import Curve, Ratios
from armtempo.planning.free import corridor, free_path, free_start
from armtempo.planning.free.angle_bounds import AngleRows
from armtempo.planning.free.free_motion import Demand, FreeMotion, Improver, Tolerance
from armtempo.planning.limit_rows import LimitRows
from armtempo.planning.tool import Tool
from armtempo.planning.variables import MotionVariables
from armtempo.splines import bspline

from tests.host import problems
from tests.host.problems import faults, sampled

ARM = Arm.paper()
FEED = Job("feed", Job.paper(ARM).via, path="free", refine=6, starts=1)


def tool_mm(arm: Arm, angles_deg: np.ndarray) -> np.ndarray:
    """Tool positions (K, 3) for driven angles (K, J)."""
    every = np.tile(np.array(arm.all_home_deg), (len(angles_deg), 1))
    every[:, list(arm.driven_indices)] = angles_deg
    return forward(Geometry.of(arm), np.radians(every))[:, :3, 3]


@pytest.mark.slow
def test_the_shipped_motion_is_5_percent_faster_and_keeps_everything() -> None:
    plan = planner.plan(ARM, replace(FEED, refine="auto"))
    assert faults(plan) == []
    assert plan.total_s <= 6.83
    assert 0.985 * plan.total_s <= plan.searches[0].lower_bound_s <= plan.total_s
    assert plan.searches[0].lower_bound_kind == "together"


def refusal(arm: Arm, job: Job) -> str:
    """Why a job's points cannot be planned, as a dwell that would be at an end of the motion; "" if they can."""
    try:
        planner.points_of(arm, job)
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.slow
@pytest.mark.seeds(79, 83, 92, 109)
def test_random_jobs_keep_their_limits_and_pass_their_via_points(seed: int) -> None:
    """These have repeated via points, a dwell at angles
    that hardly differ, and one far shorter than the rest: there rounding exceeded limits, the dwell came out too short,
    and time ran backwards.
    """
    arm, job = problems.random_free_problem(seed)
    if np.all(np.ptp(job.via, axis=0) == 0):
        return
    if refused := refusal(arm, job):
        assert "less than a step apart" in refused, f"seed {seed}"
        return
    plan = planner.plan(arm, job)
    assert faults(plan) == [], f"seed {seed}"
    for search in plan.searches:
        assert search.lower_bound_s <= search.total_s, f"seed {seed}"


@pytest.mark.slow
@pytest.mark.seeds(54)
def test_what_stops_would_keep_is_not_refused(seed: int) -> None:
    """A move of 0.05 degrees, and via points at both ends of a range."""
    assert faults(planner.plan(*problems.tight_free_problem(seed))) == [], f"seed {seed}"


@pytest.mark.slow
@pytest.mark.parametrize("pieces", [3, pytest.param(4, marks=pytest.mark.long)])
def test_one_dwell_after_the_other_on_few_pieces(pieces: int) -> None:
    """No control point is held by two dwells, which lie five pieces apart at least."""
    plan = planner.plan(ARM, replace(FEED, refine=pieces, stops=(Stop(1, 0.5), Stop(2, 0.5))))
    assert faults(plan) == []
    assert plan.trajectory.joints[0].via_segments[1:3] == (pieces, pieces + 10)


@pytest.mark.slow
def test_ranges_hold_between_the_via_points() -> None:
    """The spline through these swings out of its range; a free path need not, and turns at the end of it."""
    arm = problems.make_arm([[50.0, 50.0, 150.0]] * 2, (-10.0, 100.0))
    via = ((0.0, 0.0), (100.0, 30.0), (100.0, 60.0), (0.0, 90.0))
    with pytest.raises(PlanError, match="its range is -10 to 100"):
        planner.plan(arm, Job("out", via, refine=1, path="through"))
    plan = planner.plan(arm, Job("out", via, path="free", refine=6, starts=1))
    assert faults(plan) == []


@pytest.mark.slow
def test_the_motion_rests_at_stops_and_dwells() -> None:
    plan = planner.plan(ARM, replace(FEED, stops=(Stop(2), Stop(4, 0.75))))
    assert faults(plan) == []
    spline = plan.trajectory.joints[0]
    arrival = spline.via_times_s
    for order in (1, 2):
        assert plan.trajectory(arrival[[2, 4]], order) == pytest.approx(0.0, abs=1e-6)
    during = plan.trajectory(np.linspace(arrival[4], arrival[4] + 0.75, 50))
    assert during == pytest.approx(np.tile(plan.via_deg[4], (50, 1)), abs=1e-9)
    assert np.abs(plan.trajectory(arrival[4] + 0.85) - plan.via_deg[4]).max() > 1e-4
    assert plan.total_s > 6.83 + 0.75  # longer than without stops, see above
    assert 0.985 * plan.total_s <= plan.searches[0].lower_bound_s <= plan.total_s


def _away_deg(plan: Plan) -> float:
    through = bspline.fit(plan.via_deg, 5)
    away = 0.0
    for joint, spline in enumerate(plan.trajectory.joints):
        at = sampled(spline, 25)
        pieces = (len(spline.angle_points_deg) - 5) // (len(plan.via_deg) - 1)
        other = sampled(replace(spline, angle_points_deg=bspline.refined(through, pieces, 5)[:, joint]), 25)
        away = max(away, float(np.abs(at.angle_deg - other.angle_deg).max()))
    return away


@pytest.mark.long
def test_a_corridor_of_the_tool_holds_everywhere() -> None:
    plan = planner.plan(ARM, replace(FEED, corridor_mm=2.0))
    assert faults(plan) == []
    splines = plan.trajectory.joints
    pieces = (len(splines[0].angle_points_deg) - 5) // (len(plan.via_deg) - 1)
    through = bspline.refined(bspline.fit(plan.via_deg, 5), pieces, 5)
    here = np.stack([sampled(spline).angle_deg for spline in splines], axis=1)
    there = np.stack(
        [
            sampled(replace(spline, angle_points_deg=through[:, joint])).angle_deg
            for joint, spline in enumerate(splines)
        ],
        axis=1,
    )
    away = np.linalg.norm(tool_mm(ARM, here) - tool_mm(ARM, there), axis=1)
    assert 1.0 < away.max() <= 2.0
    assert plan.total_s < planner.plan(ARM, replace(FEED, path="through")).total_s


@pytest.mark.long
@pytest.mark.slow
def test_wider_corridors_are_never_slower_and_none_is_the_spline() -> None:
    """Those of degrees hold everywhere."""
    totals = []
    for width in (0.0, 0.2, 2.0):
        plan = planner.plan(ARM, replace(FEED, corridor_deg=width))
        assert faults(plan) == []
        assert _away_deg(plan) <= width * (1 + 1e-9) + 1e-9
        assert not width or any("deg (proven)" in note for note in plan.notes)
        totals.append(plan.total_s)
    assert totals[0] > totals[1] > totals[2]
    assert planner.plan(ARM, FEED).total_s <= 1.001 * totals[2]
    on_spline = planner.plan(ARM, replace(FEED, path="through"))
    assert totals[0] == pytest.approx(on_spline.total_s, rel=1e-9)


def random_corridors(seed: int) -> tuple[Arm, Job, list[float]]:
    """An arm, a job on the spline, and corridors from narrow to wide, in the unit of the job's parameter ``unit``."""
    rng = np.random.default_rng(seed)
    arm = Arm.paper() if rng.random() < 0.7 else Arm.load("parol6")
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    still = rng.random(len(middle)) < 0.3
    still[rng.integers(len(still))] = False
    via = middle + half * np.where(still, 0.0, rng.uniform(-0.5, 0.5, (int(rng.integers(3, 9)), len(middle))))
    widths = sorted(10.0 ** rng.uniform(-1.5, 2, 3))
    return (
        arm,
        Job(f"random-{seed}", via_deg=via.tolist(), seed=seed, path="through"),
        [float(width) for width in widths],
    )


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.seeds(1)
def test_a_corridor_is_never_slower_than_the_spline_nor_than_a_narrower_one(seed: int) -> None:
    arm, job, widths = random_corridors(seed)
    try:
        on_spline = planner.plan(arm, job).total_s
    except PlanError:
        return  # the spline itself leaves a range
    least = np.inf
    for width in widths:
        own = {"corridor_mm": width} if seed % 2 else {"corridor_deg": 0.1 * width}
        total = planner.plan(arm, replace(job, path="free", **own)).total_s
        assert total <= on_spline * (1 + 1e-9), f"seed {seed}, corridor {width}"
        assert total <= least * 1.001, f"seed {seed}, corridor {width}"
        least = min(least, total)


@pytest.mark.long
def test_a_corridor_too_narrow_to_prove_is_the_spline_in_bounded_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = []
    chained = Tool.positions_mm
    monkeypatch.setattr(
        Tool, "positions_mm", lambda tool, angles: seen.append(len(angles)) or chained(tool, angles)
    )
    plan = planner.plan(ARM, replace(FEED, corridor_mm=0.0001))
    assert plan.total_s == planner.plan(ARM, replace(FEED, path="through", refine="auto")).total_s
    assert any("no faster path" in note for note in plan.notes)
    assert faults(plan) == []
    assert max(seen) <= 3 * corridor._MOST_PIECES
    assert 'with refine = 6; try refine = "auto" (--refine auto)' in plan.notes[-1]
    assert len(seen) < 500


@pytest.mark.slow
@pytest.mark.parametrize("width", [2.0, pytest.param(20.0, marks=pytest.mark.long)])
def test_a_corridor_of_the_tool_that_the_stops_leave_no_room_in_is_refused(width: float) -> None:
    """The spline through the via points does not rest there, and a motion that is drawn to it would not either."""
    with pytest.raises(PlanError, match=rf"no path could be proven to stay within corridor_mm = {width:g}\b"):
        planner.plan(ARM, replace(FEED, corridor_mm=width, stops=(Stop(3),)))


@pytest.mark.parametrize("linkage", [False, True])
def test_slopes_of_the_tool_are_those_of_its_position(linkage: bool) -> None:
    joints = [replace(joint, parallel_linkage=linkage and n == 2) for n, joint in enumerate(ARM.joints)]
    arm = replace(ARM, joints=tuple(joints))
    tool = Tool(arm, [0, 1, 2], np.zeros(3))
    angles = np.array([[10.0, -70.0, 45.0]])
    state = tool.at(angles)
    assert state.position_mm == pytest.approx(tool_mm(arm, angles), abs=1e-9)
    step = 1e-5
    for joint, unit in enumerate(np.eye(3)):
        one, two = tool.at(angles + step * unit), tool.at(angles - step * unit)
        slope = (one.position_mm - two.position_mm) / (2 * step)
        assert state.slope_mm_deg[0, :, joint] == pytest.approx(slope[0], abs=1e-6)
        turn = (one.rotation - two.rotation)[0] / (2 * step) @ state.rotation[0].T
        axis = np.array([turn[2, 1], turn[0, 2], turn[1, 0]])
        assert state.axes_deg[0, :, joint] == pytest.approx(axis, abs=1e-8)


def poses(tolerance_mm: float, tolerance_deg: float) -> Job:
    """Three poses, the middle one with a tolerance; all joints have motors."""
    angles = np.array([[0.0, -60.0, 40.0], [60.0, -80.0, 60.0], [20.0, -50.0, 30.0]])
    tool = forward(Geometry.of(ARM), np.radians(np.pad(angles, ((0, 0), (0, 3)))))
    middle = replace(Pose.of_matrix(tool[1]), tolerance_mm=tolerance_mm, tolerance_deg=tolerance_deg)
    return Job("poses", (tuple(angles[0]), middle, tuple(angles[2])), path="free", refine=8, starts=1)


@pytest.mark.slow
def test_a_pose_with_a_tolerance_is_passed_within_it_and_sooner() -> None:
    exact = planner.plan(ARM, poses(0.1, 0.1))
    assert faults(exact) == []
    job = poses(10.0, 8.0)
    loose = planner.plan(ARM, job)
    assert loose.total_s < 0.999 * exact.total_s
    passed = loose.trajectory(loose.trajectory.joints[0].via_times_s[1])
    pose = job.via[1]
    assert isinstance(pose, Pose)
    miss = Tool(ARM, [0, 1, 2], np.zeros(3)).miss(passed, pose)
    assert 0.2 < miss.position_mm <= 10.0 * (1 + 1e-6)
    assert miss.rotation_deg <= 8.0 * (1 + 1e-6)
    assert loose.searches[0].lower_bound_s <= loose.total_s


def test_what_exceeds_a_tolerance_by_little_moves_back_by_little() -> None:
    via = np.array([[0.0, -60.0, 40.0], [20.0, -75.0, 50.0], [40.0, -60.0, 70.0]])
    low, high = via.min(axis=0) - 90.0, via.max(axis=0) + 90.0
    limits = np.array([joint.limits.values for joint in ARM.driven])
    tool, tolerances = Tool(ARM, [0, 1, 2], via[0]), {1: Tolerance(10.0, np.inf)}
    demand = Demand(("1", "2", "3"), via, limits, low, high, {}, tool=tool, tolerances=tolerances)
    exact = free_start.along_spline(demand, 8, np.ones(2)).scaled(limits)
    improver = Improver(demand, exact.layout)
    bump = np.zeros_like(exact.angle_points_deg)
    bump[8:13, 0] = 1.0

    def moved(by_deg: float) -> FreeMotion:
        return replace(exact, angle_points_deg=exact.angle_points_deg + by_deg * bump)

    inside, outside = 0.0, 90.0
    for _ in range(40):
        middle = 0.5 * (inside + outside)
        inside, outside = (inside, middle) if improver._strays(moved(middle)) else (middle, outside)
    kept = improver._inside(moved(1.0003 * outside), exact)
    assert not improver._strays(kept)
    assert 0.99 * outside < np.abs(kept.angle_points_deg - exact.angle_points_deg).max() <= outside


@pytest.mark.slow
def test_per_joint_timing_takes_each_joint_through_its_own_angles() -> None:
    plan = planner.plan(ARM, replace(FEED, timing="per-joint", refine="auto"))
    assert faults(plan) == []
    for search in plan.searches:
        assert search.total_s <= 1.002 * search.lower_bound_s


@pytest.mark.slow
def test_a_seed_repeats_and_starts_are_reported() -> None:
    job = replace(FEED, via=FEED.via[:3], refine=4, starts=2)
    one, two = planner.plan(ARM, job), planner.plan(ARM, job)
    assert np.array_equal(one.trajectory.joints[0].time_points_s, two.trajectory.joints[0].time_points_s)
    assert len(one.searches[0].starts_s) == 2


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"path": "short"}, "'through' or 'free'"),
        ({"path": "through", "corridor_deg": 1.0}, 'add path = "free"'),
        ({"corridor_deg": 1.0, "corridor_mm": 1.0}, "not both"),
        ({"corridor_deg": -1.0}, "0 or more"),
        ({"degree": 3}, "degree 5"),
        ({"timing": "per-joint", "stops": (Stop(1),)}, 'needs timing = "shared"'),
        ({"timing": "per-joint", "corridor_deg": 1.0}, 'needs timing = "shared".*; give timing = "shared"'),
        ({"stops": (Stop(0),)}, "between the ends"),
        ({"stops": (Stop(2), Stop(2))}, "two stops at one via point"),
        ({"stops": (Stop(2, 1.0),), "corridor_deg": 1.0}, "corridor and a dwell"),
        ({"path": "through", "stops": (Stop(2),), "timing": "per-joint"}, "--split"),
        ({"refine": 64, "via": FEED.via * 8}, "the board's record holds"),
        ({"starts": 0}, "starts 0"),
    ],
)
def test_refuses_what_a_free_path_cannot_be(changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        planner.plan(ARM, replace(FEED, **changes))


@pytest.mark.slow
def test_time_that_does_not_increase_is_refused() -> None:
    plan = planner.plan(ARM, replace(FEED, path="through", refine=1, iterations=5))
    spline = plan.trajectory.joints[0]
    times = spline.time_points_s.copy()
    times[4] = times[3]
    joints = (replace(spline, time_points_s=times), *plan.trajectory.joints[1:])
    with pytest.raises(PlanError, match="increases everywhere"):
        checks.check_time(replace(plan.trajectory, joints=joints))


@pytest.mark.parametrize(("away_deg", "linkage"), [(0.003, False), (0.3, True), (10.0, False), (60.0, True)])
def test_the_tools_deviation_is_bounded_sharply(away_deg: float, linkage: bool) -> None:
    """Against the distance at many places of random pieces that are farthest apart off their middles and ends."""
    rng = np.random.default_rng(20261123)
    posture = np.array([0.0, -60.0, 40.0])
    through = posture + rng.uniform(-15.0, 15.0, (4, 6, 3))
    path = through.copy()
    path[:, 1] += rng.uniform(0.5, 1.0, (4, 3)) * away_deg
    joints = [replace(joint, parallel_linkage=linkage and n == 2) for n, joint in enumerate(ARM.joints)]
    tool = Tool(replace(ARM, joints=tuple(joints)), [0, 1, 2], posture)
    u = np.linspace(0.0, 1.0, 2001)
    at = np.array([comb(5, k) * u**k * (1.0 - u) ** (5 - k) for k in range(6)])
    places = [
        tool.at(np.einsum("ku,skj->suj", at, pieces).reshape(-1, 3)).position_mm for pieces in (path, through)
    ]
    reached = np.linalg.norm(places[0] - places[1], axis=1).max()
    bound = corridor.tool_deviation_mm(path, through, tool)
    assert reached <= bound <= reached * (1.0 + 2.0 * corridor.SHARP) + 1e-6


@pytest.mark.slow
def test_where_the_spline_leaves_a_range_the_free_path_is_named_and_plans_it() -> None:
    via = ((0, -60, 40), (0, -62, 42), (0, -64, 44), (90, -70, 42), (90, -72, 40), (90, -74, 38))
    job = Job("tight", via_deg=via, starts=1)
    with pytest.raises(PlanError, match=r'its range is .* take path = "free"'):
        planner.plan(ARM, replace(job, path="through", optimiser="gradient"))
    assert planner.plan(ARM, job).total_s > 0.0


@pytest.mark.slow
def test_a_plan_takes_few_and_small_matrices() -> None:
    """Counted, because seconds depend on the load: of six joints with 1378 variables on the final segments."""
    counted: list[int] = []

    class Counted(ReducedKkt):
        def factor(self, entries: np.ndarray) -> ReducedFactor:
            factor = super().factor(entries)
            width, size = factor.lower.shape
            counted.append(width**2 * size)
            return factor

    arm, job = problems.spread_out(0, 6, 7)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(motion_program, "ReducedKkt", Counted)
        planner.plan(arm, replace(job, starts=1))
    assert len(counted) <= 40
    assert sum(counted) <= 85_000_000, "operations of Cholesky's factors"


def test_rows_of_a_free_path_have_their_derivatives_and_the_products_of_these() -> None:
    rng = np.random.default_rng(3)
    variables = MotionVariables(3, 5, 2)
    x = variables.pack(rng.normal(size=(8, 2)), rng.uniform(0.5, 1.5, 7))
    low = np.where(rng.random((3, 6, 2)) < 0.5, -5.0, -np.inf)
    at = Ratios.grid(3, 2, (1, 2, 9))
    for rows in (LimitRows(variables, at, np.full((2, 3), 9.0)), AngleRows(variables.size, low, 5.0 - low)):
        slopes = rows.linearise(x)
        matrix = np.array([slopes.forward(one) for one in np.eye(variables.size)]).T
        moved = [(rows.values(x + step) - rows.values(x - step)) / 2e-6 for step in 1e-6 * np.eye(len(x))]
        assert matrix == pytest.approx(np.array(moved).T, rel=1e-5, abs=1e-5 * np.abs(matrix).max())
        weights = rng.uniform(0.1, 1.0, rows.count)
        assert slopes.backward(weights) == pytest.approx(matrix.T @ weights)
        products = np.zeros((len(x), len(x)))
        np.add.at(products, (rows.rows, rows.columns), slopes.hessian(weights, weights, False))
        assert products == pytest.approx(matrix.T @ (weights[:, None] * matrix))
    assert np.array_equal(at.kind[LimitRows(variables, at, np.ones((2, 3))).order], np.sort(at.kind))


def test_ratios_added_keep_their_places_and_peaks_lower_what_is_allowed_next_to_them() -> None:
    curve = Curve(
        np.array([[[0.0, 1.0, 0.0, 1.0]] * 2]),
        np.array([[0.0, 1.0, 0.0, 0.0]] * 2),
        np.array([[9.0, 9.0, 4.0]]),
    )
    at = Ratios.grid(2, 1, (1, 2, 4))
    assert len(at.kind) == 3 + 5 + 9
    peaks = collocation.peaks(curve, 4, 1.1)
    assert set(peaks.kind.tolist()) == {2}
    both = at + peaks
    assert np.array_equal(both.points.u[: len(at.kind)], at.points.u)
    assert np.array_equal((both + peaks).points.u, both.points.u)
    lower = both.tightened(curve, peaks)
    assert lower.share[both.kind < 2] == pytest.approx(1.0)
    assert lower.share[both.kind == 2] == pytest.approx(4.0 / 6.0)


@pytest.mark.slow
def test_a_solve_that_ends_far_beyond_the_limits_is_not_the_last() -> None:
    """A joint of three turns far; at few points the fastest path looks feasible, but is not between them."""
    via = [[110.19, -81.1, -28.18], [121.99, -83.18, -105.21], [123.35, -80.61, -108.5]]
    plan = planner.plan(ARM, Job("uneven", via_deg=via))
    stopping_s = rest_to_rest.stopping_s(np.array(via), [joint.limits for joint in ARM.driven])
    assert plan.total_s < 0.9 * stopping_s
    assert faults(plan) == []


@pytest.mark.slow
def test_what_ends_slower_than_stopping_starts_from_the_stops_too(monkeypatch: pytest.MonkeyPatch) -> None:
    finished = free_path._finished
    slow = iter([5.0])

    def slower(demand: Demand, motion: FreeMotion, effort: free_path.Effort, even: bool) -> FreeMotion:
        """The first result takes five times as long."""
        return finished(demand, motion, effort, even).slower(next(slow, 1.0))

    monkeypatch.setattr(free_path, "_finished", slower)
    via = [[0.0, 0.0], [40.0, 30.0], [45.0, 60.0]]
    arm = problems.make_arm([[50.0, 50.0, 150.0]] * 2)
    plan = planner.plan(arm, Job("slow", via_deg=via, refine=4, starts=1))
    assert plan.total_s < rest_to_rest.stopping_s(np.array(via), [joint.limits for joint in arm.driven])
    assert faults(plan) == []
