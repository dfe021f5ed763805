"""Particle swarm: J. Kennedy and R. Eberhart, "Particle swarm optimization", ICNN 1995, pp. 1942-1948,
with the inertia weight that falls over the run of Y. Shi and R. Eberhart, "Empirical study of particle
swarm optimization", CEC 1999, pp. 1945-1950.
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
) -> Result:
    """Minimises ``function``; the swarm moves twice an iteration: 2 N evaluations, as in the paper.

    ``own`` and ``common`` pull towards a particle's own best point and the best of all,
    ``top_speed`` is the longest move as a part of the bounds' width.
    """
    tracker = Tracker(function, iterations, progress)
    swarm = Swarm(tracker, bounds, rng, population, top_speed)
    tracker.iteration_done()
    for inertia in np.linspace(inertia_start, inertia_end, iterations):
        swarm.move(inertia, own, common)
        swarm.move(inertia, own, common)
        tracker.iteration_done()
    return tracker.result()
