"""Hybrid particle swarm: P. J. Angeline, "Using selection to improve particle swarm optimization",
IEEE International Conference on Evolutionary Computation 1998, pp. 84-89. It is ``pso`` with the selection of
evolutionary programming, which needs no evaluations: before each move the better half of the swarm is copied
over the other half, which keeps its best positions.
"""

from __future__ import annotations

import numpy as np

from armtempo.optimise import pso
from armtempo.optimise.task import Number, Result, Task

PARAMETERS = {**pso.PARAMETERS, "rivals": Number(5, 1, 1000, "others that a particle is scored against")}


def search(
    task: Task,
    *,
    inertia_start: float,
    inertia_end: float,
    own: float,
    common: float,
    top_speed: float,
    rivals: int,
) -> Result:
    """Minimise; the swarm moves twice per iteration: 2 N evaluations, as in the paper.

    Each particle is compared with ``rivals`` random others; the rest as in ``pso``.
    """
    particles = pso.Swarm(task, top_speed)
    for inertia in np.linspace(inertia_start, inertia_end, task.iterations):
        for _ in range(2):
            particles.select(rivals)
            particles.move(inertia, own, common)
        particles.tracker.iteration_done()
    return particles.tracker.result()
