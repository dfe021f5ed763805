"""Hybrid particle swarm: P. J. Angeline, "Using selection to improve particle swarm optimization",
IEEE International Conference on Evolutionary Computation 1998, pp. 84-89. Before each move the better
half of the swarm is copied over the other half, whose memories stay: the swarm of ``pso`` with the
selection of evolutionary programming, at no further evaluation.
"""

from __future__ import annotations

import numpy as np

from armtempo.optimise.swarm import Swarm
from armtempo.optimise.tracker import Array, Function, Progress, Result, Tracker

PARAMETERS: dict[str, float | str | bool] = {
    "inertia_start": 0.9,
    "inertia_end": 0.4,
    "own": 2.0,
    "common": 2.0,
    "top_speed": 0.2,
    "rivals": 5,
}


def search(
    function: Function,
    bounds: Array,
    rng: np.random.Generator,
    population: int,
    iterations: int,
    progress: Progress | None = None,
    *,
    inertia_start: float = 0.9,
    inertia_end: float = 0.4,
    own: float = 2.0,
    common: float = 2.0,
    top_speed: float = 0.2,
    rivals: float = 5,
) -> Result:
    """Minimises ``function``; the swarm moves twice an iteration: 2 N evaluations, as in the paper.

    Each particle scores against ``rivals`` others drawn at random; the rest as in ``pso``.
    """
    tracker = Tracker(function, iterations, progress)
    swarm = Swarm(tracker, bounds, rng, population, top_speed)
    tracker.iteration_done()
    for inertia in np.linspace(inertia_start, inertia_end, iterations):
        for _ in range(2):
            swarm.select(int(rivals))
            swarm.move(inertia, own, common)
        tracker.iteration_done()
    return tracker.result()
