"""Motion time, bound and CPU time of plans: the shipped motion in many ways, and growth with via points and refine.

    python -m tests.benchmark.plan_times [--large]

CPU seconds of one run on one core; compare them within the run only.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import replace

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402
from armtempo.model.arm import Arm  # noqa: E402
from armtempo.model.job import Job  # noqa: E402
from armtempo.planning import planner  # noqa: E402
from armtempo.report import text_summary  # noqa: E402

from tests.host import problems  # noqa: E402


def main() -> None:
    """Print a line for each plan."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--large", action="store_true", help="300 and 500 via points too")
    options = parser.parse_args()
    arm = Arm.paper()
    paper = Job.paper(arm)
    planner.plan(arm, replace(paper, iterations=5, polish=True))  # so that everything is loaded
    planner.plan(arm, Job("first", paper.via, path="free", refine=4, starts=1))
    print(f"{'job':<34}{'time s':>10}{'bound s':>10}{'over %':>8}{'CPU s':>8}{'segments':>10}{'record':>8}")
    spline = Job("feed", paper.via, path="through")
    _print("paper: per-joint, refine 1, acs", arm, paper)
    for refine in (1, 8, 64):
        _print(f"through, refine {refine}", arm, replace(spline, refine=refine))
    _print("through, refine auto", arm, spline)
    _print("through, auto, gradient", arm, replace(spline, optimiser="gradient"))
    free = Job("feed", paper.via)
    _print("the defaults: free, 3 starts", arm, free)
    _print("free, 1 start", arm, replace(free, starts=1))
    _print("free, per-joint", arm, replace(free, timing="per-joint"))
    for joints, vias in ((6, 7), (6, 12), (3, 50)):
        arm_of, many = problems.spread_out(0, joints, vias)
        _print(f"free, {joints} joints, {vias} via points", arm_of, many)
    equal = problems.make_arm([[50.0, 50.0, 150.0]] * 3)
    for vias, refine in ((10, 4), (30, 4), (100, 4), *(((300, 1), (500, 1)) if options.large else ())):
        via = np.random.default_rng(1).normal(0, 40, (vias, 3))
        many = Job(
            "many",
            tuple(map(tuple, via.tolist())),
            refine=refine,
            optimiser="gradient",
            starts=1,
            path="through",
        )
        _print(f"through, {vias} via points, refine {refine}", equal, many)


def _print(label: str, arm: Arm, job: Job) -> None:
    start = time.process_time()
    plan = planner.plan(arm, job)
    seconds = time.process_time() - start
    bound = max(search.lower_bound_s for search in plan.searches)
    if not plan.trajectory.shared:
        bound = max(plan.searches, key=lambda search: search.total_s).lower_bound_s
    segments = len(plan.trajectory.joints[0].time_points_s) - job.degree
    print(
        f"{label:<34}{plan.total_s:>10.4f}{bound:>10.4f}{100 * (plan.total_s / bound - 1):>8.2f}{seconds:>8.2f}"
        f"{segments:>10}{text_summary.record_bytes(plan):>8}",
        flush=True,
    )


if __name__ == "__main__":
    main()
