"""Random jobs planned one after the other and looked at by an evaluation that shares no code with the planner.

    python -m tests.benchmark.random_plans [--path free|through] [--search] [--first 0] [--count 100]

Looks for limits exceeded by more than 1e-9 anywhere (40 samples a segment), via points missed, ranges left, ends not
at rest, floors above the plan and polished plans without a bound. Prints each fault with its seed, and a summary.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import replace

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402
from armtempo.basics.errors import InputError, PlanError  # noqa: E402
from armtempo.model.arm import Arm  # noqa: E402
from armtempo.model.job import Job  # noqa: E402
from armtempo.model.plan import Plan  # noqa: E402
from armtempo.planning import planner  # noqa: E402

from tests.host import problems  # noqa: E402
from tests.host.problems import faults  # noqa: E402


def main() -> None:
    """Plan and look."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--path", choices=["free", "through"], default="free")
    parser.add_argument(
        "--search", action="store_true", help="the search alone, unpolished, for --path through"
    )
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--minutes", type=float, default=np.inf, help="begin no further job after these")
    options = parser.parse_args()
    end = time.monotonic() + 60.0 * options.minutes
    counts = {"planned": 0, "refused": 0, "nothing moves": 0, "faulty": 0}
    seconds = []
    for seed in range(options.first, options.first + options.count):
        if time.monotonic() > end:
            break
        arm, job = _job(options.path, seed, not options.search)
        if np.all(np.ptp(job.via, axis=0) == 0):
            counts["nothing moves"] += 1
            continue
        start = time.process_time()
        try:
            plan = planner.plan(arm, job)
        except (PlanError, InputError) as error:
            counts["refused"] += 1
            print(f"seed {seed}: refused: {error}", flush=True)
            continue
        seconds.append(time.process_time() - start)
        counts["planned"] += 1
        found = faults(plan) + _bounds(plan)
        counts["faulty"] += bool(found)
        for fault in found:
            print(f"seed {seed}: {fault}", flush=True)
    print(", ".join(f"{count} {what}" for what, count in counts.items()))
    print(f"CPU seconds a plan: median {np.median(seconds):.2f}, longest {max(seconds):.2f}")


def _job(path: str, seed: int, polish: bool) -> tuple[Arm, Job]:
    if path == "free":
        return problems.random_free_problem(seed)
    arm, job = problems.random_problem(seed)
    return arm, replace(job, polish=True, bounds_s=None) if polish else job


def _bounds(plan: Plan) -> list[str]:
    found = []
    for search in plan.searches:
        if not 0.0 < search.floor_s <= search.total_s:
            found.append(f"floor {search.floor_s:.9g} s, plan {search.total_s:.9g} s")
        if plan.job.path == "through" and plan.job.polish and not 0.0 < search.optimum_s <= search.total_s:
            found.append(f"bound {search.optimum_s:.9g} s, plan {search.total_s:.9g} s")
    return found


if __name__ == "__main__":
    main()
