"""Particle swarm: J. Kennedy and R. Eberhart, "Particle swarm optimization", ICNN 1995, pp. 1942-1948,
with the linearly decreasing inertia weight of Y. Shi and R. Eberhart, "Empirical study of particle swarm
optimization", CEC 1999, pp. 1945-1950.
"""

from __future__ import annotations

import numpy as np

from armtempo.optimise import swarm
from armtempo.optimise.task import Result, Task

PARAMETERS = swarm.PARAMETERS


def search(
    task: Task, *, inertia_start: float, inertia_end: float, own: float, common: float, top_speed: float
) -> Result:
    """Minimise; the swarm moves twice per iteration: 2 N evaluations, as in the paper."""
    particles = swarm.Swarm(task, top_speed)
    for inertia in np.linspace(inertia_start, inertia_end, task.iterations):
        particles.move(inertia, own, common)
        particles.move(inertia, own, common)
        particles.tracker.iteration_done()
    return particles.tracker.result()
