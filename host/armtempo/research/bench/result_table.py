"""Comparison of searches as tables: Table 4, and the convergence of Fig. 6 with its scatter over seeds."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.research.bench.cases import Trial

PAPER = {
    "ga": {10: (10.491, 31.2), 50: (8.498, 164.8), 100: (6.766, 318.5), 500: (6.161, 1652.8)},
    "iaga": {10: (10.550, 34.9), 50: (7.411, 171.0), 100: (6.416, 339.9), 500: (6.304, 2327.8)},
    "pso": {10: (6.722, 66.7), 50: (6.338, 318.2), 100: (6.250, 633.4), 500: (6.146, 3158.3)},
    "hpso": {10: (6.469, 65.1), 50: (6.162, 318.2), 100: (6.126, 634.0), 500: (6.129, 3169.6)},
    "cs": {10: (6.047, 61.5), 50: (6.069, 300.2), 100: (6.064, 602.8), 500: (6.058, 3015.7)},
    "acs": {10: (6.034, 63.3), 50: (6.045, 310.7), 100: (6.047, 615.5), 500: (6.054, 3095.7)},
}
"""Table 4: fitness reached and seconds taken, by algorithm and population, for joint 1."""

QUANTILES = (0.0, 0.25, 0.5, 0.75, 1.0)
_CURVE_HEAD = (
    "algorithm",
    "population",
    "iteration",
    "best_s",
    "quartile1_s",
    "median_s",
    "quartile3_s",
    "worst_s",
)


@dataclass(frozen=True)
class Row:
    """All seeds of one algorithm and population; ``curves`` (5, iterations + 1): QUANTILES over the seeds."""

    algorithm: str
    population: int
    seeds: int
    best_s: float
    median_s: float
    worst_s: float
    evaluations: int
    """Most that a run took."""
    seconds: float
    """Median of a run's computing."""
    curves: Array


def rows(runs: Iterable[Trial], iterations: int) -> list[Row]:
    """One row for each algorithm and population, in the order of Table 4."""
    groups: dict[tuple[str, int], list[Trial]] = {}
    for run in runs:
        groups.setdefault((run.case.algorithm, run.case.population), []).append(run)
    order = list(PAPER)
    keys = sorted(groups, key=lambda key: (order.index(key[0]) if key[0] in order else len(order), key))
    return [_row(*key, groups[key], iterations) for key in keys]


def _row(algorithm: str, population: int, runs: Sequence[Trial], iterations: int) -> Row:
    reached = [run.best_s for run in runs]
    return Row(
        algorithm,
        population,
        len(runs),
        min(reached),
        float(np.median(reached)),
        max(reached),
        max(run.evaluations for run in runs),
        float(np.median([run.seconds for run in runs])),
        np.quantile([run.history(iterations) for run in runs], QUANTILES, axis=0),
    )


def table_csv(found: Sequence[Row], with_paper: bool) -> str:
    """Table 4 as CSV; ``with_paper`` puts the paper's figures beside it."""
    head = ["algorithm", "population", "seeds", "best_s", "median_s", "worst_s", "evaluations", "seconds"]
    lines: list[Sequence[object]] = [head + ["paper_best_s", "paper_seconds"] * with_paper]
    for row in found:
        line: list[object] = [row.algorithm, row.population, row.seeds]
        line += [f"{value:.6f}" for value in (row.best_s, row.median_s, row.worst_s)]
        line += [row.evaluations, f"{row.seconds:.4f}"]
        if with_paper:
            line += PAPER.get(row.algorithm, {}).get(row.population, ("", ""))
        lines.append(line)
    return _csv(lines)


def curves_csv(found: Sequence[Row]) -> str:
    """Fig. 6 as CSV: best, quartiles, median and worst over the seeds after each iteration."""
    lines: list[Sequence[object]] = [_CURVE_HEAD]
    for row in found:
        for iteration, values in enumerate(row.curves.T):
            lines.append([row.algorithm, row.population, iteration, *(f"{value:.6f}" for value in values)])
    return _csv(lines)


def text(found: Sequence[Row], with_paper: bool) -> list[str]:
    """Table 4 as lines for a terminal."""
    head = "algorithm  population  seeds    best s  median s   worst s  evaluations  seconds"
    lines = [head + "   paper s" * with_paper]
    for row in found:
        line = f"{row.algorithm:<9}  {row.population:>10}  {row.seeds:>5}"
        line += "".join(f"  {value:>8.4f}" for value in (row.best_s, row.median_s, row.worst_s))
        line += f"  {row.evaluations:>11}  {row.seconds:>7.2f}"
        paper = PAPER.get(row.algorithm, {}).get(row.population)
        lines.append(line + (f"  {paper[0]:>8.3f}" if with_paper and paper else ""))
    return lines


def _csv(lines: Iterable[Sequence[object]]) -> str:
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows(lines)
    return file.getvalue()
