"""Fig. 6: how the searches converge, one field for each population, drawn with matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from armtempo.report.plots import COLOURS, new_figure, theme
from armtempo.research.bench.result_table import PAPER, Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HEADROOM = 1.5
"""Top of the time axis, as a multiple of the best time of all."""


def convergence(found: Sequence[Row]) -> Figure:
    """Median over the seeds as a line, the middle half as a band, best to worst as a lighter one."""
    populations = sorted({row.population for row in found})
    columns = min(2, len(populations))
    lines = -(-len(populations) // columns)
    figure, axes = new_figure(lines, columns, 4.5 * columns + 0.5, 3.2 * lines + 0.5)
    floor = min(row.best_s for row in found)
    order = list(PAPER)
    for population, axis in zip(populations, axes.flat, strict=False):
        for row in (row for row in found if row.population == population):
            colour = COLOURS[order.index(row.algorithm) if row.algorithm in order else -1]
            iterations = np.arange(row.curves.shape[1])
            best, low, median, high, worst = row.curves
            axis.fill_between(iterations, best, worst, color=colour, alpha=0.1, linewidth=0)
            axis.fill_between(iterations, low, high, color=colour, alpha=0.25, linewidth=0)
            axis.plot(iterations, median, color=colour, label=row.algorithm.upper())
        axis.set_title(f"population {population}")
        axis.set_xlabel("iteration")
        axis.set_ylabel("fitness (s)")
        axis.set_ylim(0.99 * floor, _HEADROOM * floor)
    for axis in axes.flat[len(populations) :]:
        axis.set_visible(False)
    axes.flat[0].legend(frameon=False)
    for axis in axes.flat:
        theme(axis)
    return figure
