"""Time axes by gradients: derivatives, optimality, refinement, and the totals on the paper's motion."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from armtempo.model.job import Job
from armtempo.planning import limit_rows, planner, time_parameterization
from armtempo.planning.fixed_path import FixedPath, Rows
from armtempo.planning.time_parameterization import Group
from armtempo.splines import bspline, trajectory

from tests.host import problems
from tests.host.problems import FEEDING, LIMITS

PROBLEMS = {problem.name: problem for problem in problems.load()}


def point(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Derivatives of two joints and of time at three points of u, and limits."""
    rng = np.random.default_rng(seed)
    return rng.normal(0, 10, (3, 3, 2)), rng.uniform(0.5, 2, (3, 3)), rng.uniform(1, 9, (2, 3))


@pytest.mark.parametrize("seed", range(5))
def test_derivatives_of_the_ratios_are_theirs(seed: int) -> None:
    angle, time, _ = point(seed)
    step = 1e-6
    for kind in range(3):
        for joint in range(2):
            own = angle[:, :, joint]
            slopes = np.concatenate(limit_rows.gradient(kind, own, time))
            for slope, number in zip(slopes, [*range(kind + 1), *range(3, kind + 4)], strict=True):
                moved = [
                    np.concatenate([own, time]) + sign * step * np.eye(6)[number][:, None] for sign in (1, -1)
                ]
                above, below = (trajectory.by_time(each[:3], each[3:], kind + 1)[kind] for each in moved)
                bent = (above - below) / (2 * step)
                assert slope == pytest.approx(bent, rel=1e-6, abs=1e-6 * np.abs(slopes).max())


@pytest.mark.long
@pytest.mark.parametrize("name", ["feeding", "feeding-shared", "feeding-cubic"])
def test_polished_plan_is_the_best_known_to_1e_6(name: str) -> None:
    """From a short search on purpose, so that the solver has work to do."""
    problem = PROBLEMS[name]
    plan = planner.plan(problem.arm, replace(problem.job, polish=True, iterations=150))
    for search, best in zip(plan.searches, problem.best_s, strict=True):
        assert search.total_s <= search.searched_s
        assert search.total_s == pytest.approx(best, rel=2e-6)
        assert search.optimum_s <= search.total_s <= search.optimum_s * (1 + 1e-6)


@pytest.mark.slow
@pytest.mark.seeds(0, 1)
def test_gradients_never_make_it_worse(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = bspline.fit(rng.normal(0, 40, (int(rng.integers(2, 9)), 2)), 5)
    path = FixedPath(points, 5, LIMITS[:2], mirrored=True)
    start = path.scaled(path.of_intervals(rng.uniform(0.3, 2, len(points) - 5)))
    found = path.optimum(start, 1e-8)
    assert found.total_s <= path.duration_s(start) * (1 + 1e-12)
    assert path.duration_s(path.scaled(found.differences_s)) == pytest.approx(found.total_s, rel=1e-9)
    assert found.bound_s <= found.total_s


@pytest.mark.slow
@pytest.mark.seeds(*range(1, 4))
def test_every_polished_axis_has_a_bound_near_it(seed: int) -> None:
    arm, job = problems.random_problem(seed)
    if np.all(np.ptp(job.via, axis=0) == 0):
        return
    for search in planner.plan(arm, replace(job, polish=True, bounds_s=None)).searches:
        assert 0.0 < search.optimum_s <= search.total_s, f"seed {seed}"
        assert search.total_s <= 1.02 * search.optimum_s, f"seed {seed}"


@pytest.mark.long
@pytest.mark.slow
def test_equal_plans_have_equal_bounds() -> None:
    plans = [
        planner.plan(problem.arm, replace(problem.job, polish=True, seed=seed))
        for problem in [PROBLEMS["feeding-shared"]]
        for seed in (1, 2)
    ]
    bounds = [plan.searches[0].optimum_s for plan in plans]
    assert bounds == pytest.approx([bounds[0]] * 2, rel=1e-6)


def refined(joints: list[int], timing: str, refine: int | str) -> tuple[float, float]:
    """Motion time and bound on the paper's motion."""
    feeding = PROBLEMS["feeding"]
    via = tuple(tuple(row) for row in FEEDING[:, joints].tolist())
    arm = replace(feeding.arm, joints=tuple(feeding.arm.joints[joint] for joint in joints))
    plan = planner.plan(arm, replace(feeding.job, via=via, timing=timing, refine=refine))
    assert refine in ("auto", plan.trajectory.joints[0].refine)
    assert plan.searches[0].total_s == pytest.approx(plan.trajectory.duration_s, rel=1e-12)
    return plan.trajectory.duration_s, plan.searches[0].lower_bound_s


@pytest.mark.parametrize(
    ("joint", "most_s"),
    [
        (0, 4.946),
        pytest.param(1, 6.014, marks=pytest.mark.slow),
        pytest.param(2, 5.576, marks=pytest.mark.slow),
    ],
)
def test_refined_joints_come_near_their_floor(joint: int, most_s: float) -> None:
    total, bound = refined([joint], "per-joint", 8)
    assert bound < total <= most_s
    assert total <= 1.006 * bound


@pytest.mark.long
@pytest.mark.parametrize(
    ("refine", "most_s"), [(1, 8.19), (4, 7.2975), (8, 7.254), (64, 7.2272), ("auto", 7.228)]
)
def test_refined_shared_timing(refine: int | str, most_s: float) -> None:
    total, bound = refined([0, 1, 2], "shared", refine)
    assert total <= most_s
    assert 7.15 <= bound <= total


@pytest.mark.long
@pytest.mark.slow
def test_more_refinement_is_never_slower() -> None:
    """Also if it is no multiple of what came before."""
    totals = [refined([0, 1, 2], "shared", refine)[0] for refine in (1, 2, 3, 8)]
    assert np.all(np.diff(totals) < 0)


@pytest.mark.long
@pytest.mark.slow
def test_automatic_refinement_stays_within_the_record() -> None:
    rng = np.random.default_rng(3)
    via = tuple(map(tuple, np.cumsum(rng.normal(0, 10, (120, 1)), axis=0).tolist()))
    arm = problems.make_arm([[50.0, 50.0, 150.0]])
    plan = planner.plan(arm, Job("long", via, optimiser="gradient", starts=1, path="through"))
    refine = plan.trajectory.joints[0].refine
    assert 1 < refine < 18
    assert 119 * refine <= 2048


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("name", ["feeding", "feeding-shared"])
def test_gradients_from_several_starts_find_the_best_known(name: str) -> None:
    problem = PROBLEMS[name]
    job = replace(problem.job, optimiser="gradient", polish=True, starts=4, bounds_s=None)
    for search, best in zip(planner.plan(problem.arm, job).searches, problem.best_s, strict=True):
        assert search.total_s == pytest.approx(best, rel=2e-6)
        assert len(search.starts_s) == search.evaluations == 4
        assert np.array_equal(search.history_s, np.minimum.accumulate(search.starts_s))


def uneven() -> tuple[np.ndarray, list[object]]:
    """One joint, ways of 0.01 and 1000 degrees: intervals more than 30 : 1."""
    return np.array([[0.0], [1000.0], [1000.01], [1000.02], [2000.0]]), [LIMITS[0]]


def test_bounds_follow_from_the_job() -> None:
    via, limits = uneven()
    box = time_parameterization.bounds_s(bspline.fit(via, 5), 5, limits)
    assert box[0, 1] / box[1, 0] > 30.0


def test_a_search_that_no_bound_holds_back_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    via, limits = uneven()
    boxes: list[np.ndarray] = []

    def once(points: object, limits: object, job: object, box: np.ndarray, *others: object) -> object:
        boxes.append(box)
        inside: Any = SimpleNamespace(x=np.sqrt(box[:, 0] * box[:, 1]), value=1.0)
        return time_parameterization.Found(inside, np.empty(0))

    monkeypatch.setattr(time_parameterization, "_once", once)
    job = Job("uneven", tuple(map(tuple, via.tolist())), optimiser="acs", path="through")
    found = time_parameterization.search(
        bspline.fit(via, 5), limits, job, np.random.default_rng(0), lambda done, whole: None
    )
    assert len(boxes) == 1
    assert found.notes == ()


@pytest.mark.slow
def test_bounds_that_hold_the_search_back_are_widened_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    via, _ = uneven()
    arm = problems.make_arm([[50.0, 50.0, 150.0]], microsteps=256)  # so 0.01 degrees are more than a step
    job = Job("uneven", tuple(map(tuple, via.tolist())), refine=1, path="through")
    best = planner.plan(arm, job).total_s
    given = planner.plan(arm, replace(job, bounds_s=(20.0, 21.0), polish=False))
    assert any("ended at bounds_s" in note for note in given.notes)
    assert given.total_s > 1.001 * best
    monkeypatch.setattr(time_parameterization, "_REACH", 1.05)
    held = planner.plan(arm, job)
    assert any("they were widened 6 times" in note for note in held.notes)
    assert held.total_s == pytest.approx(best, rel=1e-3)


@pytest.mark.slow
def test_gradients_start_within_bounds_and_are_not_held_by_them() -> None:
    via, _ = uneven()
    arm = problems.make_arm([[50.0, 50.0, 150.0]], microsteps=256)  # so 0.01 degrees are more than a step
    job = Job("uneven", tuple(map(tuple, via.tolist())), refine=1, optimiser="gradient", path="through")
    plan = planner.plan(arm, replace(job, bounds_s=(20.0, 21.0)))
    assert not any("bounds_s" in note for note in plan.notes)
    assert plan.total_s == pytest.approx(planner.plan(arm, job).total_s, rel=1e-4)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(
    ("vias", "joints", "timing", "room"),
    [(2, 3, "shared", 64), (7, 2, "per-joint", 64), (30, 1, "shared", 1)],
)
def test_auto_is_never_slower_than_any_fixed_refine(vias: int, joints: int, timing: str, room: int) -> None:
    """By no more than the least saving for which it continues; from 258 via points on the record has no finer axis."""
    points = bspline.fit(np.random.default_rng(vias).normal(0, 40, (vias, joints)), 5)
    together = [list(range(joints))] if timing == "shared" else [[joint] for joint in range(joints)]
    groups = [Group(tuple(own), points[:, own], LIMITS[: len(own)]) for own in together]
    job = Job("any", ((0.0,) * joints,) * vias, timing=timing, iterations=20, path="through")
    assert time_parameterization.most_refine(job, 257, joints) == 1
    most = min(room, time_parameterization.most_refine(job, vias - 1, joints))
    times = {
        refine: max(
            axis.total_s for axis in time_parameterization.axes(groups, replace(job, refine=refine), most)
        )
        for refine in ("auto", *range(1, min(most, 3) + 1), most)
    }
    assert times["auto"] <= min(times.values()) * 1.001, times


def rows_at(angle: np.ndarray, joint: int, kind: int, sign: float, limits: np.ndarray) -> Rows:
    """One row at each point."""
    count = angle.shape[1]
    slices = [slice(0, 0)] * kind + [slice(0, count)] + [slice(count, count)] * (2 - kind)
    slopes = sign * angle[:, :, joint] / limits[joint, kind]
    return Rows(np.arange(count), slopes, (slices[0], slices[1], slices[2]))


@pytest.mark.parametrize("kind", range(3))
def test_rows_of_a_path_are_its_ratios_and_have_their_derivatives(kind: int) -> None:
    angle, time, limits = point(kind)
    rows = rows_at(angle, 1, kind, -1.0, limits)
    assert rows.ratios(time) == pytest.approx(-limit_rows.ratios(angle, time, limits)[kind, :, 1], rel=1e-12)
    gradient, weights = rows.gradient(time), np.array([2.0, -1.0, 0.5])
    by_time = limit_rows.gradient(kind, angle[:, :, 1], time)[1]
    assert gradient[: kind + 1] == pytest.approx(-by_time / limits[1, kind], rel=1e-12)
    assert not gradient[kind + 1 :].any()
    whole, step = np.empty((3, 3, 3)), 1e-6
    for column, moved in enumerate(step * np.eye(3)):
        change = rows.gradient(time + moved[:, None]) - rows.gradient(time - moved[:, None])
        whole[:, column] = weights * change / (2 * step)
    for (row, column), bent in rows.curvature(time, weights).items():
        assert bent == pytest.approx(whole[row, column], rel=1e-6, abs=1e-6 * np.abs(whole).max())


@pytest.mark.parametrize("seed", range(4))
def test_no_row_that_is_left_out_can_be_reached_before_those_that_are_watched(seed: int) -> None:
    """t'' or t''' anywhere that the watched rows allow, at a t' that their speed allows, keeps the others too."""
    rng = np.random.default_rng(seed)
    angle, limits = rng.normal(0, 10, (3, 40, 3)), rng.uniform(5, 50, (3, 3))
    time = np.stack([rng.uniform(1, 3, 40), *rng.normal(0, 1, (2, 40))])
    rows = Rows.reachable(angle, [time], limits)
    for kind in (0, 1, 2):
        moved = np.repeat(time[:, :, None], 401, axis=2)
        moved[kind] += np.linspace(-20, 20, 401) if kind else np.linspace(-0.9, 20, 401)
        flat, own = moved.reshape(3, -1), rows.kinds[kind]
        every = np.abs(limit_rows.ratios(np.repeat(angle, 401, axis=1), flat, limits)[kind]).max(axis=1)
        inside = np.ones((40, 401), dtype=bool)
        for step in range(401):
            ratios = rows.ratios(moved[:, rows.point, step])[own]
            np.logical_and.at(inside[:, step], rows.point[own], ratios <= 1.0)
        assert np.all(every.reshape(40, 401)[inside] <= 1.0 + 1e-9), f"seed {seed}, kind {kind}"
