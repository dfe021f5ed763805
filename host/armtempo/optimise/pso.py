"""Particle swarm: J. Kennedy and R. Eberhart, "Particle swarm optimization", ICNN 1995, pp. 1942-1948,
with the linearly decreasing inertia weight of Y. Shi and R. Eberhart, "Empirical study of particle swarm
optimization", CEC 1999, pp. 1945-1950.
"""

from __future__ import annotations

import numpy as np

from armtempo.optimise.task import Number, Parameter, Result, Task, Tracker

PARAMETERS: dict[str, Parameter] = {
    "inertia_start": Number(0.9, 0.0, 2.0, "inertia in the first iteration"),
    "inertia_end": Number(0.4, 0.0, 2.0, "inertia in the last iteration"),
    "own": Number(2.0, 0.0, 10.0, "acceleration towards a particle's own best point"),
    "common": Number(2.0, 0.0, 10.0, "acceleration towards the best point of all"),
    "top_speed": Number(0.2, 0.001, 1.0, "longest move as a fraction of the bounds' width"),
}


class Swarm:
    """Positions, velocities, values and best positions of the particles, initially random within the bounds."""

    def __init__(self, task: Task, top_speed: float) -> None:
        self.tracker = Tracker(task)
        self._rng = task.rng
        self._low, self._high = task.bounds.T
        self._top_speed = top_speed * (self._high - self._low)
        self.positions = self._rng.uniform(self._low, self._high, (task.population, len(task.bounds)))
        self.velocities = self._rng.uniform(-self._top_speed, self._top_speed, self.positions.shape)
        self.values = self.tracker.evaluate(self.positions)
        self._seen, self._seen_values = self.positions.copy(), self.values.copy()
        self.tracker.iteration_done()

    def move(self, inertia: float, own: float, common: float) -> None:
        """Move every particle once (N evaluations); at a bound it stops."""
        own_pull = own * self._rng.random(self.positions.shape) * (self._seen - self.positions)
        common_pull = common * self._rng.random(self.positions.shape) * (self.tracker.x - self.positions)
        velocities = inertia * self.velocities + own_pull + common_pull
        self.velocities = np.clip(velocities, -self._top_speed, self._top_speed)
        target = self.positions + self.velocities
        self.positions = np.clip(target, self._low, self._high)
        self.velocities[target != self.positions] = 0.0
        self.values = self.tracker.evaluate(self.positions)
        better = self.values < self._seen_values
        self._seen[better], self._seen_values[better] = self.positions[better], self.values[better]

    def select(self, rivals: int) -> None:
        """Copy positions and velocities of the better half over the worse one, which keeps its best positions.

        Particles are ranked by how many of ``rivals`` random others they beat.
        """
        population = len(self.values)
        drawn = self._rng.integers(0, population, (population, rivals))
        score = np.count_nonzero(self.values[:, None] < self.values[drawn], axis=1)
        order = np.argsort(-score, kind="stable")
        half = population // 2
        best, worst = order[:half], order[population - half :]
        for each in (self.positions, self.velocities, self.values):
            each[worst] = each[best]


def search(
    task: Task, *, inertia_start: float, inertia_end: float, own: float, common: float, top_speed: float
) -> Result:
    """Minimise; the swarm moves twice per iteration: 2 N evaluations, as in the paper."""
    particles = Swarm(task, top_speed)
    for inertia in np.linspace(inertia_start, inertia_end, task.iterations):
        particles.move(inertia, own, common)
        particles.move(inertia, own, common)
        particles.tracker.iteration_done()
    return particles.tracker.result()
