"""Random free jobs that a motion with stops keeps: how many are refused, and why.

    python -m tests.benchmark.refusals [--first 0] [--count 80]

Even seeds: via points that fill tight ranges of one to six joints, a third of them at an end. Odd seeds: moves of 0.02
to 0.5 degrees, some of them with a large one among them. A stop at each via point keeps every one of these jobs, ranges
included, since each joint moves straight from angle to angle: each refusal is a wrong one, and makes it exit with 1.
"""

from __future__ import annotations

import argparse
import os
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402
from armtempo.basics.errors import InputError, PlanError  # noqa: E402
from armtempo.model.arm import Arm  # noqa: E402
from armtempo.model.job import Job  # noqa: E402
from armtempo.planning import planner  # noqa: E402

from tests.host import problems  # noqa: E402
from tests.host.problems import faults  # noqa: E402


def random_job(seed: int) -> tuple[Arm, Job]:
    """A job for an arm with ranges that its via points fill, or with moves far smaller than its limits."""
    rng = np.random.default_rng(seed)
    joints, count = int(rng.integers(1, 7)), int(rng.integers(3, 9))
    limits = np.stack(
        [rng.uniform(20, 80, joints), rng.uniform(20, 80, joints), rng.uniform(80, 300, joints)], 1
    )
    if seed % 2:
        via = np.cumsum(rng.uniform(-1.0, 1.0, (count, joints)) * 10.0 ** rng.uniform(-1.7, -0.3), axis=0)
        if rng.random() < 0.5:
            via[count // 2 :] += rng.uniform(-90.0, 90.0, joints)
        span = (-180.0, 180.0)
    else:
        span = _span(rng)
        via = rng.uniform(*span, (count, joints))
        at = rng.random((count, joints)) < 0.33
        via = np.where(at, np.where(rng.random((count, joints)) < 0.5, *span), via)
        near = rng.random((count, joints)) < 0.2
        via = np.where(near, np.clip(via, *span) * (1.0 - 10.0 ** rng.uniform(-5, -1)), via)
    timing = str(rng.choice(["shared", "per-joint"]))
    job = Job(f"random-{seed}", tuple(map(tuple, via.tolist())), path="free", timing=timing, starts=1)
    return problems.make_arm(limits.tolist(), span), job


def _span(rng: np.random.Generator) -> tuple[float, float]:
    half = float(rng.uniform(5.0, 90.0))
    return -half, half


def main() -> int:
    """Plan and count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=80)
    parser.add_argument("--minutes", type=float, default=np.inf, help="begin no further job after these")
    options = parser.parse_args()
    end = time.monotonic() + 60.0 * options.minutes
    planned, refused, faulty = np.zeros(2, int), np.zeros(2, int), 0
    for seed in range(options.first, options.first + options.count):
        if time.monotonic() > end:
            break
        arm, job = random_job(seed)
        try:
            plan = planner.plan(arm, job)
        except (PlanError, InputError) as error:
            refused[seed % 2] += 1
            print(f"seed {seed}: {job.timing}: refused: {str(error).splitlines()[0]}", flush=True)
            continue
        planned[seed % 2] += 1
        for fault in faults(plan):
            faulty += 1
            print(f"seed {seed}: {fault}", flush=True)
    for number, kind in enumerate(("tight ranges", "small moves")):
        print(f"{kind}: {planned[number]} planned, {refused[number]} refused")
    print(f"{faulty} faults")
    return int(faulty > 0 or refused.sum() > 0)


if __name__ == "__main__":
    sys.exit(main())
