"""Gradient solvers: derivatives, optimality, refinement, and the totals on the paper's motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.planning import local_search, planner
from armtempo.planning.constraints import Constraints, Path, near_rows, peak_rows
from armtempo.splines import bspline, time_axis

from tests.host import problems
from tests.host.feeding import FEEDING, LIMITS

pytestmark = pytest.mark.slow

PROBLEMS = {problem.name: problem for problem in problems.load()}


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("parts", [1, 3])
def test_gradients_are_those_of_the_values(degree: int, parts: int) -> None:
    path = Path(bspline.fit(FEEDING, degree), degree, LIMITS, time_axis.free_map(6 * parts, degree))
    rng = np.random.default_rng(7)
    y = rng.uniform(0.3, 1.0, len(path.weights))
    rows = near_rows(path, y, 4, 2.0) + peak_rows(path, y, 8, 2.0)
    constraints = Constraints(path, rows, y)
    gradient = constraints.gradient(y)
    step = 1e-6
    for number, unit in enumerate(np.eye(len(y))):
        rise = (constraints.values(y + step * unit) - constraints.values(y - step * unit)) / (2 * step)
        assert gradient[:, number] == pytest.approx(rise, abs=1e-7 * np.abs(gradient).max())


def test_values_are_what_is_left_of_the_limits() -> None:
    path = Path(bspline.fit(FEEDING, 5), 5, LIMITS, time_axis.step_map(6, 5))
    y = np.full(6, 1.2)
    values = Constraints(path, near_rows(path, y, 8, 2.0), y).values(y)
    assert values.min() == pytest.approx(path.slack(8, y).min())
    assert path.slack(64, path.stretched(y)).min() == pytest.approx(0, abs=1e-4)


@pytest.mark.parametrize("name", ["feeding", "feeding-shared", "feeding-cubic"])
def test_polished_plan_is_the_best_known_to_1e_6(name: str) -> None:
    """From a short search on purpose, so that the solver has work to do."""
    problem = PROBLEMS[name]
    plan = planner.plan(problem.arm, replace(problem.job, polish=True, iterations=150))
    for search, best in zip(plan.searches, problem.best_s, strict=True):
        assert search.total_s <= search.searched_s
        assert search.total_s == pytest.approx(best, rel=2e-6)
        assert search.optimum_s <= search.total_s <= search.optimum_s * (1 + 1e-6)


def test_polish_never_makes_it_worse() -> None:
    rng = np.random.default_rng(11)
    for _ in range(10):
        points = bspline.fit(rng.normal(0, 40, (int(rng.integers(2, 9)), 2)), 5)
        path = Path(points, 5, LIMITS[:2], time_axis.step_map(len(points) - 5, 5))
        start = path.stretched(rng.uniform(0.3, 2, len(points) - 5))
        found = local_search.polish(path, start)
        assert found.total_s <= path.duration_s(start) * (1 + 1e-12)
        assert path.duration_s(path.stretched(found.y)) == pytest.approx(found.total_s, rel=1e-9)


def refined(joints: list[int], timing: str, refine: int) -> tuple[float, float]:
    """Motion time and floor on the paper's motion."""
    feeding = PROBLEMS["feeding"]
    via = tuple(tuple(row) for row in FEEDING[:, joints].tolist())
    arm = replace(feeding.arm, joints=tuple(feeding.arm.joints[joint] for joint in joints))
    plan = planner.plan(arm, replace(feeding.job, via=via, timing=timing, refine=refine))
    assert plan.trajectory.joints[0].refine == refine
    assert plan.searches[0].total_s == pytest.approx(plan.trajectory.duration_s, rel=1e-12)
    return plan.trajectory.duration_s, plan.searches[0].floor_s


@pytest.mark.parametrize(("joint", "most_s"), [(0, 4.96), (1, 6.1), (2, 5.59)])
def test_refined_joints_come_near_their_floor(joint: int, most_s: float) -> None:
    total, floor = refined([joint], "per-joint", 8)
    assert floor < total <= most_s
    assert total <= 1.006 * floor


@pytest.mark.parametrize(("refine", "most_s"), [(4, 7.31), (8, 7.26)])
def test_refined_shared_timing(refine: int, most_s: float) -> None:
    total, floor = refined([0, 1, 2], "shared", refine)
    assert floor == pytest.approx(6.748, abs=0.002)
    assert total <= most_s


def test_shared_timing_without_refinement() -> None:
    total, _ = refined([0, 1, 2], "shared", 1)
    assert total <= 8.19


def test_a_solution_at_the_wall_of_its_box_is_no_optimum() -> None:
    path = Path(bspline.fit(FEEDING, 5), 5, LIMITS, time_axis.step_map(6, 5))
    y = path.stretched(np.full(6, 1.2))
    rows = near_rows(path, y, 8, 0.3)
    assert not local_search._solve(path, rows, y, 1e-3)[2]
    best = local_search.polish(path, y).y
    assert local_search._solve(path, near_rows(path, best, 8, 0.3), best, 0.3)[2]
