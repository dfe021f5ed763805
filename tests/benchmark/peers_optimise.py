"""The searches beside cma, scipy, nlopt, NiaPy and mealpy: same fitness, same evaluations, one run, one core.

    pip install --group bench
    python -m tests.benchmark.peers_optimise [--joints 1,2,3] [--seeds 11] [--fitness stretched]

Each peer gets the fitness in the form it likes best (a whole population where it can take one), the same
bounds, and is stopped at the same number of evaluations; the best point it has asked for counts. Seconds are
CPU time, median over the seeds. A peer that is not installed is left out and named. The searches by gradients
of this project do not ask for the fitness: their evaluations are starts. The other gradient methods take theirs from
differences, all of one step in one population.
"""

from __future__ import annotations

import argparse
import os
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass
from functools import partial
from io import StringIO
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402
from armtempo import optimise  # noqa: E402
from armtempo.model.arm import Arm  # noqa: E402
from armtempo.model.job import Job  # noqa: E402
from armtempo.optimise.tracker import Array  # noqa: E402
from armtempo.planning import interval_search  # noqa: E402
from armtempo.planning.fixed_path import FixedPath  # noqa: E402
from armtempo.research.bench import cases  # noqa: E402

NESTS = 10
PARTICLES = 20
DIFFERENCE = 1e-7
"""Step of forward differences, s."""


class Enough(Exception):
    """The evaluations are used up."""


class Counted:
    """The fitness, counted and timed, which ends the search when its evaluations are used up."""

    def __init__(self, problem: cases.Problem, most: int) -> None:
        self.problem = problem
        self._function = problem.function()
        self._left = most
        self.evaluations = 0
        self.seconds = 0.0
        self.best = np.inf
        self.bounds = np.array([problem.bounds_s] * (len(problem.via_deg) - 1))

    def population(self, points: Array) -> Array:
        """Values (N,) of points (N, m); what is beyond the last evaluation is not looked at."""
        allowed = self._left - self.evaluations
        if allowed <= 0:
            raise Enough
        start = time.process_time()
        values = self._function(np.asarray(points, dtype=float))
        self.seconds += time.process_time() - start
        self.evaluations += min(len(values), allowed)
        self.best = min(self.best, float(values[:allowed].min()))
        return values

    def point(self, point: Any) -> float:
        """The value of one point (m,)."""
        return float(self.population(np.asarray(point, dtype=float)[None])[0])


Search = Callable[[Counted, int], None]
"""Runs a search on a fitness with a seed until Enough is raised, or until it sees no more to gain."""


@dataclass(frozen=True)
class Row:
    """All seeds of one solver on one joint."""

    solver: str
    reached: list[float]
    evaluations: list[int]
    seconds: list[float]
    inside: list[float]
    """Seconds of them inside the fitness."""


def main() -> None:
    """Print one table for each joint."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--joints", default="1,2,3")
    parser.add_argument("--seeds", type=int, default=11)
    parser.add_argument("--evaluations", type=int, default=10_000)
    parser.add_argument("--fitness", choices=["stretched", "penalised"], default="stretched")
    options = parser.parse_args()
    arm = Arm.paper()
    job = Job.paper(arm)
    solvers = dict(own(options.evaluations)) | peers(options.evaluations)
    for joint in (int(number) for number in options.joints.split(",")):
        problem = cases.problem_of(arm, job, joint, options.fitness, 500)
        print(f"\njoint {joint}, {options.fitness}, {options.seeds} seeds")
        print(
            f"  {'solver':<34}{'best s':>9}{'median s':>10}{'worst s':>9}"
            f"{'evaluations':>13}{'seconds':>9}{'in fitness':>12}"
        )
        for solver, search in solvers.items():
            row = measure(solver, search, problem, options)
            best, median, worst = np.quantile(row.reached, (0.0, 0.5, 1.0))
            print(
                f"  {solver:<34}{best:>9.4f}{median:>10.4f}{worst:>9.4f}"
                f"{max(row.evaluations):>13}{np.median(row.seconds):>9.3f}{np.median(row.inside):>12.3f}",
                flush=True,
            )


def measure(solver: str, search: Search, problem: cases.Problem, options: argparse.Namespace) -> Row:
    """Runs a solver with seeds 1, 2, ..."""
    row = Row(solver, [], [], [], [])
    for seed in range(1, options.seeds + 1):
        fitness = Counted(problem, options.evaluations)
        start = time.process_time()
        with redirect_stdout(StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with suppress(Enough):
                search(fitness, seed)
        row.seconds.append(time.process_time() - start)
        row.reached.append(fitness.best)
        row.evaluations.append(fitness.evaluations)
        row.inside.append(fitness.seconds)
    return row


def own(evaluations: int) -> Iterator[tuple[str, Search]]:
    """The six searches of this project, with as many iterations as the evaluations allow."""
    for algorithm in ("acs", "cs", "pso", "hpso", "ga", "iaga"):
        per_iteration = NESTS if algorithm in ("ga", "iaga") else 2 * NESTS
        iterations = evaluations // per_iteration

        def search(
            fitness: Counted, seed: int, algorithm: str = algorithm, iterations: int = iterations
        ) -> None:
            rng = np.random.default_rng(seed)
            settings = optimise.Settings(algorithm, NESTS, iterations)
            optimise.minimise(fitness.population, fitness.bounds, rng, settings)

        yield f"armtempo {algorithm}, {NESTS} x {iterations}", search
    for starts in (1, 3):
        yield f"armtempo gradient, {starts} starts", partial(by_gradients, starts)


def by_gradients(starts: int, fitness: Counted, seed: int) -> None:
    """What ``optimiser = "gradient"`` does: starts to within 1e-3, the best of them to within 1e-8."""
    problem = fitness.problem
    path = FixedPath(problem.points(), problem.degree, [problem.limits], mirrored=True)
    found = interval_search.gradient(path, fitness.bounds, np.random.default_rng(seed), starts).result
    fitness.best = path.optimum(path.of_intervals(found.x), 1e-8).total_s
    fitness.evaluations = starts


def peers(evaluations: int) -> dict[str, Search]:
    """The peers that are installed."""
    found: dict[str, Search] = {}
    for package, add in (
        ("scipy", add_scipy),
        ("nlopt", add_nlopt),
        ("cma", add_cma),
        ("niapy", add_niapy),
        ("mealpy", add_mealpy),
    ):
        try:
            add(found, evaluations)
        except ImportError:
            print(f"left out: {package} is not installed (pip install --group bench)")
    return found


def add_scipy(found: dict[str, Search], evaluations: int) -> None:
    """Differential evolution, whole populations at a time, with its default population and its best; SLSQP."""
    from scipy.optimize import differential_evolution, minimize

    def evolve(popsize: int, fitness: Counted, seed: int) -> None:
        differential_evolution(
            lambda x: fitness.population(np.atleast_2d(x.T)),
            [tuple(pair) for pair in fitness.bounds],
            rng=seed, maxiter=evaluations, tol=0.0, atol=0.0, polish=False, popsize=popsize,
            vectorized=True, updating="deferred",
        )  # fmt: skip

    def descend(fitness: Counted, seed: int) -> None:
        rng = np.random.default_rng(seed)
        while True:
            start = rng.uniform(*fitness.bounds.T)
            minimize(
                lambda x: value_and_slope(fitness, x), start, jac=True, method="SLSQP", bounds=fitness.bounds,
                options={"ftol": 1e-9, "maxiter": 200},
            )  # fmt: skip

    found["scipy differential_evolution"] = partial(evolve, 15)
    found["scipy DE, popsize 4"] = partial(evolve, 4)
    found["scipy SLSQP, many starts"] = descend


def value_and_slope(fitness: Counted, x: Array) -> tuple[float, Array]:
    """Value and forward differences (m,) at x (m,)."""
    values = fitness.population(x + DIFFERENCE * np.vstack([np.zeros(len(x)), np.eye(len(x))]))
    return float(values[0]), (values[1:] - values[0]) / DIFFERENCE


def add_nlopt(found: dict[str, Search], evaluations: int) -> None:
    """nlopt's controlled random search, and its SLSQP from one random start after another."""
    import nlopt

    def prepared(kind: int, fitness: Counted, rng: np.random.Generator) -> tuple[Any, Array]:
        low, high = fitness.bounds.T
        solver = nlopt.opt(kind, len(low))
        solver.set_lower_bounds(low)
        solver.set_upper_bounds(high)
        solver.set_maxeval(evaluations)
        solver.set_exceptions_enabled(False)
        return solver, rng.uniform(low, high)

    def random_search(fitness: Counted, seed: int) -> None:
        nlopt.srand(seed)
        solver, start = prepared(nlopt.GN_CRS2_LM, fitness, np.random.default_rng(seed))
        solver.set_min_objective(lambda x, _: asked(fitness, solver, x, None))
        solver.optimize(start)

    def descend(fitness: Counted, seed: int) -> None:
        rng = np.random.default_rng(seed)
        while fitness.evaluations < evaluations:
            solver, start = prepared(nlopt.LD_SLSQP, fitness, rng)
            solver.set_ftol_rel(1e-9)
            solver.set_min_objective(lambda x, slope, solver=solver: asked(fitness, solver, x, slope))
            solver.optimize(start)

    def asked(fitness: Counted, solver: Any, x: Array, slope: Array | None) -> float:
        try:
            if slope is None or not slope.size:
                return fitness.point(x)
            value, slope[:] = value_and_slope(fitness, x)
        except Enough:
            solver.force_stop()
            return np.inf
        return value

    found["nlopt CRS2-LM"] = random_search
    found["nlopt SLSQP, many starts"] = descend


def add_cma(found: dict[str, Search], evaluations: int) -> None:
    """CMA-ES with its own default population, until it stops by itself and until all evaluations are used."""
    import cma

    never = {"tolfun": 0, "tolx": 0, "tolfunhist": 0, "tolstagnation": 10**9, "tolflatfitness": 10**9}

    def search(fitness: Counted, seed: int, stops: dict[str, float]) -> None:
        low, high = fitness.bounds.T
        start = np.random.default_rng(seed).uniform(low, high)
        settings = {"bounds": [list(low), list(high)], "seed": seed, "verbose": -9, "maxfevals": evaluations}
        strategy = cma.CMAEvolutionStrategy(start, 0.25 * (high[0] - low[0]), {**settings, **stops})
        while not strategy.stop():
            points = strategy.ask()
            strategy.tell(points, fitness.population(np.array(points)).tolist())

    found["cma, stops by itself"] = lambda fitness, seed: search(fitness, seed, {})
    found["cma, all evaluations"] = lambda fitness, seed: search(fitness, seed, never)


def add_niapy(found: dict[str, Search], evaluations: int) -> None:
    """NiaPy's cuckoo search and particle swarm, a point at a time, its only way."""
    from niapy.algorithms.basic import CuckooSearch, ParticleSwarmOptimization
    from niapy.problems import Problem
    from niapy.task import Task

    class Intervals(Problem):  # type: ignore[misc]
        def __init__(self, fitness: Counted) -> None:
            super().__init__(len(fitness.bounds), *fitness.bounds[0])
            self.fitness = fitness

        def _evaluate(self, x: Array) -> float:
            return self.fitness.point(x)

    def run(kind: Any, size: int, fitness: Counted, seed: int) -> None:
        kind(population_size=size, seed=seed).run(Task(Intervals(fitness), max_evals=evaluations))

    found[f"NiaPy CuckooSearch, {NESTS} nests"] = lambda f, seed: run(CuckooSearch, NESTS, f, seed)
    found[f"NiaPy particle swarm, {PARTICLES}"] = lambda f, seed: run(
        ParticleSwarmOptimization, PARTICLES, f, seed
    )


def add_mealpy(found: dict[str, Search], evaluations: int) -> None:
    """mealpy's cuckoo search, particle swarm and genetic algorithm, a point at a time, its only way."""
    from mealpy import CSA, GA, PSO, FloatVar

    def run(kind: Any, size: int, fitness: Counted, seed: int) -> None:
        low, high = fitness.bounds.T
        problem = {
            "obj_func": fitness.point, "bounds": FloatVar(lb=low, ub=high), "minmax": "min", "log_to": None,
        }  # fmt: skip
        kind(epoch=evaluations, pop_size=size).solve(problem, seed=seed)

    found[f"mealpy CSA, {NESTS} nests"] = lambda fitness, seed: run(CSA.OriginalCSA, NESTS, fitness, seed)
    found[f"mealpy PSO, {PARTICLES}"] = lambda fitness, seed: run(PSO.OriginalPSO, PARTICLES, fitness, seed)
    found[f"mealpy GA, {PARTICLES}"] = lambda fitness, seed: run(GA.BaseGA, PARTICLES, fitness, seed)


if __name__ == "__main__":
    main()
