"""How close a record's brake times come to the shortest brake along the path: ``python -m tests.benchmark.brakes``.

For the shipped motion and random ones, from 20 moments each: the record's time over the shortest one of the board's
law from just that moment, and over that of any law, which an optimiser of its own finds: in how little time can the
rate of the motion's own time go from 1 to 0 (its second derivative constant over each of 24 parts), with acceleration
and jerk within EXCESS times the limits? Linear programs, each linear in the change of the rate, for shorter and
shorter times; what none is found for counts as too short, so the optimum may be missed by a little. The look-ahead
of the board (33 to 75 ms) comes on top of each.

``--parts N``: instead, how close a table would come that holds a shape of N parts for each of its spaces, fit for a
brake that begins at its start, middle or end.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, PlanError
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Limits
from armtempo.planning import brake_time, planner
from armtempo.planning.brake_time import TO_REST
from armtempo.planning.ramp_excess import EXCESS, LONGEST_S, Ramps
from armtempo.splines.trajectory import Trajectory
from armtempo_shared.motion import EVEN_RAMP, REST_ENTRIES
from scipy.optimize import linprog

from tests.host import problems

PARTS = 24
MOMENTS = 20
SHORTER = 0.97
ROUNDS = 12
SAMPLES = 4000
PHASES = 10
SHORTEST_S = 1e-3
SPACES = 5
ROUNDED = 1e-9


def main() -> None:
    """Print the ratios."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--parts", type=int, choices=[n for n in range(4, PARTS) if PARTS % n == 0])
    options = parser.parse_args()
    compare = ratios if options.parts is None else partial(table_ratios, parts=options.parts)
    arm = Arm.paper()
    limits = [joint.limits for joint in arm.driven]
    show("shipped", [compare(planner.plan(arm, Job.paper(arm)).trajectory, limits)])
    show("random", [compare(*motion) for motion in random_motions(options.first, options.count)])


def random_motions(first: int, count: int) -> Iterator[tuple[Trajectory, Sequence[Limits]]]:
    """Polished plans through via points, of those that move and brake within the longest ramp."""
    while count:
        arm, job = problems.random_problem(first)
        first += 1
        limits = [joint.limits for joint in arm.driven]
        if np.all(np.ptp(job.via, axis=0) == 0):
            continue
        try:
            trajectory = planner.plan(arm, replace(job, polish=True, bounds_s=None)).trajectory
        except (PlanError, InputError):
            continue
        if brake_time.of_motion(trajectory, limits).longest_rest_s < LONGEST_S:
            count -= 1
            yield trajectory, limits


def ratios(trajectory: Trajectory, limits: Sequence[Limits]) -> Array:
    """(3, MOMENTS): the record's time over the shortest of its law, over that of any law, and the motion's rest."""
    allowed = np.array([limit.values for limit in limits])
    moments = (np.arange(MOMENTS) + 0.5) / MOMENTS
    record = brake_time.of_motion(trajectory, limits)
    record_s = record.rest_s(moments * trajectory.duration_s)
    ramps = Ramps(trajectory, allowed)
    lawful_s = ramps.shortest_s(
        moments * trajectory.duration_s,
        record_s,
        TO_REST[:1],
        record.rest_shapes(moments * trajectory.duration_s),
        PHASES,
    )
    any_s = [
        Shortest(trajectory, allowed, [moment])(time) for moment, time in zip(moments, lawful_s, strict=True)
    ]
    left_s = trajectory.duration_s * (1.0 - moments)
    return np.array([record_s / lawful_s, record_s / any_s, np.minimum(record_s, left_s) / any_s])


def table_ratios(trajectory: Trajectory, limits: Sequence[Limits], parts: int) -> Array:
    """(1, SPACES): the time of the best shape of so many parts, in some spaces of the table, over that of any law."""
    allowed = np.array([limit.values for limit in limits])
    spaces = np.linspace(1, REST_ENTRIES - 3, SPACES).astype(int)[:, None]
    starts = (spaces + np.array([0.0, 0.5, 1.0])) / (REST_ENTRIES - 1)
    lawful_s = Ramps(trajectory, allowed).shortest_s(
        starts[:, 1] * trajectory.duration_s,
        np.full(SPACES, SHORTEST_S),
        TO_REST[:1],
        np.full(SPACES, EVEN_RAMP),
        PHASES,
    )
    found = []
    for space, known_s in zip(starts, lawful_s, strict=True):
        any_s = Shortest(trajectory, allowed, space[1:2])(known_s)
        shape = Shortest(trajectory, allowed, space, parts)
        found.append(shape(shape.lengthened(any_s)) / any_s)
    return np.array([found])


def show(what: str, found: list[Array]) -> None:
    """Medians over the moments of each motion."""
    medians = np.median(found, axis=2)
    names = ("its own law", "any law", "any law, or the motion's end")
    for name, values in zip(names if len(medians.T) > 1 else names[1:2], medians.T, strict=True):
        middle, high = np.quantile(values, (0.5, 0.9))
        print(f"{what}: over {name}: median {middle:.2f}, nine in ten below {high:.2f}", flush=True)


class Shortest:
    """The shortest brake that may begin at any of some moments, parts of the motion's time."""

    def __init__(
        self, trajectory: Trajectory, allowed: Array, moments: Sequence[float], parts: int = PARTS
    ) -> None:
        self._allowed = allowed[:, 1:]
        self._starts_s = [moment * trajectory.duration_s for moment in moments]
        # Second derivatives (PARTS, parts)
        self._shape = np.kron(np.eye(parts), np.ones((PARTS // parts, 1)))
        self._grid_s = np.linspace(0.0, trajectory.duration_s, SAMPLES)
        motion = [trajectory(self._grid_s, order) for order in (1, 2, 3)]
        self._motion = [*motion, np.gradient(motion[2], self._grid_s, axis=0)]
        nodes = np.arange(PARTS + 1)[:, None] / PARTS
        since = np.clip(nodes - np.arange(PARTS) / PARTS, 0.0, None)  # beginning of each part to each node
        until = np.clip(since - 1.0 / PARTS, 0.0, None)
        # slope of the rate, rate and way at the nodes, per second derivative in each part; both sides of each node
        sums = [(since**n - until**n) / factor for n, factor in ((1, 1.0), (2, 2.0), (3, 6.0))]
        both = np.concatenate([np.arange(PARTS), np.arange(1, PARTS + 1)])
        self._slope, self._rate, self._way = (values[both] for values in sums)
        self._second = np.concatenate([np.eye(PARTS)] * 2)
        self._at = nodes[both, 0]
        self._ends = np.array([sums[0][-1], sums[1][-1]])
        straight = np.interp(np.arange(parts) + 0.5, [0.0, parts], [-6.0, 6.0])
        ends = self._ends @ self._shape
        self._first = self._shape @ (straight - np.linalg.lstsq(ends, ends @ straight - [0.0, -1.0])[0])

    def lengthened(self, time_s: float) -> float:
        """A time from this on that is enough."""
        while self._meet(time_s, self._first) is None:
            time_s /= SHORTER**3
        return time_s

    def __call__(self, known_s: float) -> float:
        """Seconds; ``known_s`` is enough."""
        best, time_s, second = known_s, known_s, self._first
        while True:
            time_s *= SHORTER
            found = self._meet(time_s, second)
            if found is None:
                found = self._meet(time_s, self._first)
            if found is None:
                return best
            best, second = time_s, found

    def _meet(self, time_s: float, second: Array) -> Array | None:
        """Second derivatives of the rate that keep the limits, from others on; None: not found."""
        ratio, slopes = self._ratios(time_s, second)
        reach = 8.0
        for _ in range(ROUNDS):
            worst = np.abs(ratio).max()
            if worst <= EXCESS:
                return second
            step = self._step(ratio, slopes, second, reach)
            tried = None if step is None else self._ratios(time_s, second + step)
            if step is None or tried is None or not np.abs(tried[0]).max() < worst:
                reach /= 3.0
                continue
            second, (ratio, slopes) = second + step, tried
        return None

    def _step(self, ratio: Array, slopes: Array, second: Array, reach: float) -> Array | None:
        """The step within ``reach`` that makes the largest of the linearised ratios least."""
        rate = 1.0 + self._rate @ second
        slopes, by_rate = slopes @ self._shape, self._rate @ self._shape
        rows = [np.column_stack([sign * slopes, np.full(len(slopes), -1.0)]) for sign in (1.0, -1.0)]
        rows += [np.column_stack([sign * by_rate, np.zeros(len(rate))]) for sign in (1.0, -1.0)]
        found = linprog(
            np.append(np.zeros(slopes.shape[1]), 1.0),
            A_ub=np.concatenate(rows),
            b_ub=np.concatenate([-ratio, ratio, 1.0 - rate + ROUNDED, rate + ROUNDED]),
            A_eq=np.column_stack([self._ends @ self._shape, [0.0, 0.0]]),
            b_eq=np.array([0.0, -1.0]) - self._ends @ second,
            bounds=[(-reach, reach)] * slopes.shape[1] + [(0.0, None)],
        )
        return None if found.status else self._shape @ found.x[:-1]

    def _ratios(self, time_s: float, second: Array) -> tuple[Array, Array]:
        """Accelerations and jerks over their limits, and their derivatives by ``second``, from every start."""
        found = [self._ratios_from(start_s, time_s, second) for start_s in self._starts_s]
        return np.concatenate([one for one, _ in found]), np.concatenate([one for _, one in found])

    def _ratios_from(self, start_s: float, time_s: float, second: Array) -> tuple[Array, Array]:
        rate = (1.0 + self._rate @ second)[:, None]
        slope = (self._slope @ second)[:, None] / time_s
        bend = (self._second @ second)[:, None] / time_s**2
        way = start_s + time_s * (self._at + self._way @ second)
        v, a, j, s = (
            np.column_stack([np.interp(way, self._grid_s, row, right=0.0) for row in values.T])
            for values in self._motion
        )
        ratio = (a * rate**2 + v * slope, j * rate**3 + 3 * a * rate * slope + v * bend)
        by = (  # the way, the rate, its slope, its second derivative
            (j * rate**2 + a * slope, 2 * a * rate, v, 0.0 * v),
            (
                s * rate**3 + 3 * j * rate * slope + a * bend,
                3 * j * rate**2 + 3 * a * slope,
                3 * a * rate,
                v,
            ),
        )
        parts = (time_s * self._way, self._rate, self._slope / time_s, self._second / time_s**2)
        slopes = [
            (
                sum(d[:, :, None] * part[:, None, :] for d, part in zip(row, parts, strict=True))
                / limit[:, None]
            )
            for row, limit in zip(by, self._allowed.T, strict=True)
        ]
        flat = np.concatenate([(r / limit).ravel() for r, limit in zip(ratio, self._allowed.T, strict=True)])
        return flat, np.concatenate([np.reshape(values, (-1, PARTS)) for values in slopes])


if __name__ == "__main__":
    main()
