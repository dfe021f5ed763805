"""Floors of random jobs with 2 to 500 via points against plans: none may be above; how near they are.

    python -m tests.benchmark.floors [--first 0] [--count 1000] [--minutes M] [--free]

Shared timing, ``refine`` as high as 16 where the board's record has room, so that the plans are near what the path
allows. ``--free``: free paths of 2 to 6 joints through 3 to 20 via points, with the planner's defaults.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import replace

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402
from armtempo.basics.errors import InputError  # noqa: E402
from armtempo.model.arm import Arm  # noqa: E402
from armtempo.model.job import Job  # noqa: E402
from armtempo.planning import planner, time_parameterization  # noqa: E402

from tests.host import problems  # noqa: E402
from tests.host.test_floors import random_motion  # noqa: E402

REFINE = 16


def main() -> None:
    """Plan, compare, and print what is above and how far below the others are."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--minutes", type=float, default=np.inf, help="begin no further job after these")
    parser.add_argument("--free", action="store_true", help="free paths")
    options = parser.parse_args()
    end = time.monotonic() + 60.0 * options.minutes
    over, above, too_large, vias = [], 0, 0, []
    start = time.process_time()
    for seed in range(options.first, options.first + options.count):
        if time.monotonic() > end:
            break
        arm, job = _free_motion(seed) if options.free else _fine_motion(seed)
        try:
            plan = planner.plan(arm, job)
        except InputError:  # its record is larger than the board takes
            too_large += 1
            continue
        search = plan.searches[0]
        if not 0.0 < search.floor_s <= plan.total_s:
            above += 1
            print(f"seed {seed}: floor {search.floor_s:.9g} s, plan {plan.total_s:.9g} s", flush=True)
        over.append(100.0 * (plan.total_s / search.floor_s - 1.0))
        vias.append(len(job.via))
    quantiles = np.quantile(over, (0.1, 0.5, 0.9))
    print(f"{len(over)} plans, {min(vias)} to {max(vias)} via points: {above} floors above their plan")
    print(f"not planned, as their records are too large: {too_large}")
    print(
        "over the floor: "
        + ", ".join(
            f"{name} {value:.2f} %" for name, value in zip(("10 %", "median", "90 %"), quantiles, strict=True)
        )
        + f"; within 2 %: {100.0 * np.mean(np.array(over) < 2.0):.0f} % of them"
    )
    print(f"CPU: {time.process_time() - start:.0f} s")


def _fine_motion(seed: int) -> tuple[Arm, Job]:
    arm, job = random_motion(seed, most=500)
    most = time_parameterization.most_refine(job, len(job.via) - 1, len(arm.driven))
    return arm, replace(job, refine=min(REFINE, most), optimiser="gradient", starts=1)


def _free_motion(seed: int) -> tuple[Arm, Job]:
    rng = np.random.default_rng(seed)
    joints = int(rng.integers(2, 7))
    via = rng.uniform(-90, 90, (int(rng.integers(3, 21)), joints))
    limits = rng.uniform([20, 20, 80], [80, 80, 300], (joints, 3))
    return problems.make_arm(limits.tolist()), Job(
        "free", tuple(map(tuple, via.tolist())), path="free", seed=seed
    )


if __name__ == "__main__":
    main()
