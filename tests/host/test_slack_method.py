"""The interior-point method with slacks, on programs whose optimum is known or found by scipy."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.basics.arrays import Array
from armtempo.optimise import slack_method
from armtempo.optimise.kkt import BandedKkt, Equalities
from armtempo.optimise.reduced_kkt import ReducedKkt
from armtempo.optimise.slack_method import Goal
from scipy.optimize import linprog

TIGHT = Goal(gap=1e-9, violation=1e-10, iterations=100)


class Disc:
    """The least x + y with 4 - x^2 - y^2 > 0 and x > -1: at x = -1, y = -sqrt(3)."""

    equalities = Equalities.none()

    def __init__(self) -> None:
        index = np.arange(2)
        self.kkt = BandedKkt(index.astype(float), np.repeat(index, 2), np.tile(index, 2), self.equalities)

    def objective(self, x: Array) -> float:
        return float(x.sum())

    def inequalities(self, x: Array) -> Array:
        return np.array([4.0 - x @ x, x[0] + 1.0])

    def linearise(self, x: Array) -> Slopes:
        return Slopes(np.ones(2), np.array([-2.0 * x, [1.0, 0.0]]))


class Halfplanes(Disc):
    """The least c x with A x < 1, and the sum of x given."""

    def __init__(self, cost: Array, rows: Array) -> None:
        self.cost, self.rows_of = cost, rows
        index = np.arange(len(cost))
        self.equalities = Equalities(
            np.zeros(len(cost), dtype=np.intp), index, np.ones(len(cost)), np.array([0.1]), np.array([0.5])
        )
        self.kkt = BandedKkt(
            index.astype(float), np.repeat(index, len(cost)), np.tile(index, len(cost)), self.equalities
        )

    def objective(self, x: Array) -> float:
        return float(self.cost @ x)

    def inequalities(self, x: Array) -> Array:
        return 1.0 - self.rows_of @ x

    def linearise(self, x: Array) -> Slopes:
        return Slopes(self.cost, -self.rows_of)


class Slopes:
    def __init__(self, gradient: Array, rows: Array) -> None:
        self.gradient, self.rows = gradient, rows

    def forward(self, step: Array) -> Array:
        return self.rows @ step

    def backward(self, weights: Array) -> Array:
        return weights @ self.rows

    def hessian(self, weights: Array, _: Array, __: bool) -> Array:
        return (self.rows.T @ (weights[:, None] * self.rows)).ravel()


@pytest.mark.parametrize("start", [(0.5, -0.5), (1.9, 0.1), (3.0, 3.0)], ids=["inside", "near", "outside"])
def test_a_curved_boundary_is_met_also_from_outside(start: tuple[float, float]) -> None:
    found = slack_method.minimise(Disc(), np.array(start), np.array([False, True]), TIGHT).x
    assert found == pytest.approx([-1.0, -np.sqrt(3.0)], abs=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_linear_programs_end_at_their_vertex_and_never_outside(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cost, rows = rng.normal(size=4), np.concatenate([rng.normal(size=(12, 4)), np.eye(4), -np.eye(4)])
    program = Halfplanes(cost, rows)
    found = slack_method.minimise(program, np.zeros(4), np.ones(len(rows), dtype=bool), TIGHT).x
    best = linprog(cost, rows, np.ones(len(rows)), np.ones((1, 4)), [0.1], bounds=[(None, None)] * 4)
    assert cost @ found == pytest.approx(best.fun, abs=1e-6), f"seed {seed}"
    assert np.all(rows @ found < 1.0), f"seed {seed}"


def test_a_start_beyond_a_linear_inequality_is_returned() -> None:
    start = np.array([-2.0, 0.0])
    assert slack_method.minimise(Disc(), start, np.array([False, True]), TIGHT).x is start


@pytest.mark.parametrize("seed", range(5))
def test_eliminated_equalities_leave_the_step_of_the_whole_matrix(seed: int) -> None:
    """With rows that share variables, some of which are solved for later, and one that fixes a variable."""
    rng = np.random.default_rng(seed)
    size, count = 30, 6
    row = np.repeat(np.arange(count), 5)
    column = (4 * np.arange(count)[:, None] + np.arange(5)).ravel()
    value = rng.normal(size=len(row)) * np.repeat(np.arange(count) != 3, 5)
    value[17] = 2.0
    equalities = Equalities(row, column, value, np.zeros(count), 4.0 * np.arange(count) + 2.0)
    rows, columns = np.nonzero(np.abs(np.subtract.outer(np.arange(size), np.arange(size))) <= 3)
    slopes = rng.normal(size=(size, 4))
    entries = np.where(rows == columns, 1.0, 0.0)
    for first in range(size - 3):
        within = (rows >= first) & (rows < first + 4) & (columns >= first) & (columns < first + 4)
        entries[within] += np.outer(slopes[first], slopes[first]).ravel()
    places = np.arange(size) + rng.uniform(0.0, 0.4, size)
    gradient, residual = rng.normal(size=size), rng.normal(size=count)
    whole, reduced = (
        kind(places, rows, columns, equalities).factor(entries).solve(gradient, residual)
        for kind in (BandedKkt, ReducedKkt)
    )
    assert reduced == pytest.approx(whole, rel=1e-9, abs=1e-9), f"seed {seed}"


def test_equalities_that_depend_on_each_other_and_indefinite_matrices_are_singular() -> None:
    index, twice = np.arange(3), np.array([0, 0, 1, 1])
    same = Equalities(twice, np.array([0, 1, 0, 1]), np.ones(4), np.zeros(2), np.zeros(2))
    for equalities, entries in ((same, np.ones(3)), (Equalities.none(), np.array([1.0, -1.0, 1.0]))):
        with pytest.raises(np.linalg.LinAlgError):
            ReducedKkt(index.astype(float), index, index, equalities).factor(entries)
