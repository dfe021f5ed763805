"""Default plans compared with stopping at every via point, as ruckig computes it, and with their lower bounds.

    pip install --group bench
    python -m tests.benchmark.stopping [--first 0] [--count 200]

Picks with short approaches, points on arcs, recordings with jitter, and uneven distances, for the paper's arm. Exits
with 1 if a plan takes more than 0.1 % longer than stopping, less than its lower bound, or exceeds a limit or misses a
via point by separate code (scipy's B-splines, 40 samples a segment).
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from itertools import pairwise

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402
import ruckig  # noqa: E402
from armtempo.model.arm import Arm  # noqa: E402
from armtempo.model.job import Job  # noqa: E402
from armtempo.planning import planner  # noqa: E402

from tests.host import problems  # noqa: E402

_SLOWER = 1.001
KINDS = ("pick", "arc", "recording", "uneven")


def via_points(kind: str, rng: np.random.Generator) -> np.ndarray:
    """Via angles (n + 1, 3) of the paper's arm, well inside of its ranges."""
    low, high = np.array([joint.range_deg for joint in Arm.paper().driven]).T
    middle, half = 0.5 * (low + high), 0.35 * (high - low)
    start, end = middle + rng.uniform(-1.0, 1.0, (2, 3)) * half
    if kind == "pick":
        up = rng.uniform(-1.0, 1.0, (2, 3)) * rng.uniform(0.5, 8.0)
        return np.array([start, start + up[0], end + up[1], end])
    if kind == "arc":
        turn = np.linspace(0.0, rng.uniform(1.0, 5.0), int(rng.integers(5, 12)))[:, None]
        return middle + 0.5 * half * np.concatenate(
            [np.cos(turn), np.sin(turn), 0.3 * np.sin(2.0 * turn)], axis=1
        )
    if kind == "recording":
        part = np.linspace(0.0, 1.0, int(rng.integers(8, 16)))[:, None]
        return start + part * (end - start) + rng.normal(0.0, 0.3, (len(part), 3))
    part = np.concatenate([[0.0], np.cumsum(np.exp(rng.normal(0.0, 1.5, int(rng.integers(2, 6)))))])[:, None]
    return start + part / part[-1] * (end - start) + rng.normal(0.0, 1.0, (len(part), 3))


def stopping_s(via_deg: np.ndarray, limits: np.ndarray) -> float:
    """The sum of the times from rest to rest, by ruckig; ``limits``: (J, 3)."""
    total = 0.0
    for here, there in pairwise(via_deg):
        ask = ruckig.InputParameter(len(limits))
        ask.current_position, ask.target_position = here.tolist(), there.tolist()
        ask.max_velocity, ask.max_acceleration, ask.max_jerk = limits.T.tolist()
        found = ruckig.Trajectory(len(limits))
        ruckig.Ruckig(len(limits)).calculate(ask, found)
        total += found.duration
    return total


def main() -> None:
    """Plan, compare, and print what is slower."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=200)
    options = parser.parse_args()
    arm, ratios, seconds, faulty = Arm.paper(), [], [], 0
    limits = np.array([joint.limits.values for joint in arm.driven])
    for seed in range(options.first, options.first + options.count):
        kind = KINDS[seed % len(KINDS)]
        via = via_points(kind, np.random.default_rng(seed))
        start = time.process_time()
        plan = planner.plan(arm, Job("any", via_deg=via.tolist()))
        seconds.append(time.process_time() - start)
        ratios.append(plan.total_s / stopping_s(via, limits))
        wrong = problems.faults(plan)
        if ratios[-1] > _SLOWER or plan.total_s < plan.searches[0].lower_bound_s or wrong:
            faulty += 1
            print(
                f"seed {seed}, {kind}: {plan.total_s:.4f} s, {ratios[-1]:.4f} of stopping {wrong}", flush=True
            )
    print(
        f"{len(ratios)} jobs, {faulty} faulty; of stopping: median {np.median(ratios):.3f}, most {max(ratios):.4f}; "
        f"CPU seconds a plan: median {np.median(seconds):.2f}, longest {max(seconds):.2f}"
    )
    sys.exit(faulty > 0)


if __name__ == "__main__":
    main()
