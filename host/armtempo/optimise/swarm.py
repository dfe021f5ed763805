"""A swarm of particles: where they are, how fast, and the best place each has seen."""

from __future__ import annotations

import numpy as np

from armtempo.optimise.tracker import Array, Tracker


class Swarm:
    """Positions, velocities, values and memories of N particles, started at random in ``bounds`` (d, 2)."""

    def __init__(
        self, tracker: Tracker, bounds: Array, rng: np.random.Generator, population: int, top_speed: float
    ) -> None:
        self._tracker = tracker
        self._rng = rng
        self._low, self._high = bounds.T
        self._top_speed = top_speed * (self._high - self._low)
        self.positions = rng.uniform(self._low, self._high, (population, len(bounds)))
        self.velocities = rng.uniform(-self._top_speed, self._top_speed, self.positions.shape)
        self.values = tracker.evaluate(self.positions)
        self._seen, self._seen_values = self.positions.copy(), self.values.copy()

    def move(self, inertia: float, own: float, common: float) -> None:
        """One move of everybody and its N evaluations; who hits a bound stops there."""
        own_pull = own * self._rng.random(self.positions.shape) * (self._seen - self.positions)
        common_pull = common * self._rng.random(self.positions.shape) * (self._tracker.x - self.positions)
        velocities = inertia * self.velocities + own_pull + common_pull
        self.velocities = np.clip(velocities, -self._top_speed, self._top_speed)
        target = self.positions + self.velocities
        self.positions = np.clip(target, self._low, self._high)
        self.velocities[target != self.positions] = 0.0
        self.values = self._tracker.evaluate(self.positions)
        better = self.values < self._seen_values
        self._seen[better], self._seen_values[better] = self.positions[better], self.values[better]

    def select(self, rivals: int) -> None:
        """Copies places and velocities of the better half over the worse one; memories stay.

        Better is who beats more of ``rivals`` others drawn at random.
        """
        population = len(self.values)
        drawn = self._rng.integers(0, population, (population, rivals))
        score = np.count_nonzero(self.values[:, None] < self.values[drawn], axis=1)
        order = np.argsort(-score, kind="stable")
        half = population // 2
        best, worst = order[:half], order[population - half :]
        for each in (self.positions, self.velocities, self.values):
            each[worst] = each[best]
