"""Motion time in corridors of random jobs: never slower than on the spline, nor in a wider one than in a narrower.

    python -m tests.benchmark.corridors [--first N] [--count N] [--minutes M]

Jobs with 3 to 8 via points for the paper's arm or PAROL6, in three corridors each, of mm or degrees. Exits with 1 where
a plan is slower than on the spline, or by more than 0.1 % than in a narrower corridor.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import replace

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402
from armtempo.basics.errors import PlanError  # noqa: E402
from armtempo.model.arm import Arm  # noqa: E402
from armtempo.model.job import Job  # noqa: E402
from armtempo.planning import planner  # noqa: E402

ALLOWED = 1e-3
"""How much slower, relative, a plan may be in a wider corridor."""


def random_corridors(seed: int) -> tuple[Arm, Job, list[float]]:
    """An arm, a job on the spline, and corridors from narrow to wide, in the unit of the job's parameter ``unit``."""
    rng = np.random.default_rng(seed)
    arm = Arm.paper() if rng.random() < 0.7 else Arm.load("parol6")
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    still = rng.random(len(middle)) < 0.3
    still[rng.integers(len(still))] = False
    via = middle + half * np.where(still, 0.0, rng.uniform(-0.5, 0.5, (int(rng.integers(3, 9)), len(middle))))
    widths = sorted(10.0 ** rng.uniform(-1.5, 2, 3))
    return (
        arm,
        Job(f"random-{seed}", via_deg=via.tolist(), seed=seed, path="through"),
        [float(width) for width in widths],
    )


def times(seed: int) -> Iterator[tuple[float, float]]:
    """Corridors, 0 first, and the motion times in them; none where the spline itself leaves a range."""
    arm, job, widths = random_corridors(seed)
    try:
        yield 0.0, planner.plan(arm, job).total_s
    except PlanError:
        return
    for width in widths:
        own = {"corridor_mm": width} if seed % 2 else {"corridor_deg": 0.1 * width}
        yield width, planner.plan(arm, replace(job, path="free", **own)).total_s


def faults(found: list[tuple[float, float]]) -> list[str]:
    """What is slower than it may be."""
    said = []
    for number, (width, total) in enumerate(found[1:], 1):
        if total > found[0][1] * (1 + 1e-9):
            said.append(f"corridor {width:.3g}: {total:.4f} s, on the spline {found[0][1]:.4f} s")
        narrower, least = min(found[1:number], key=lambda one: one[1], default=(0.0, np.inf))
        if total > least * (1 + ALLOWED):
            said.append(f"corridor {width:.3g}: {total:.4f} s, in {narrower:.3g} {least:.4f} s")
    return said


def main() -> int:
    """Print a line for each job and each fault."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--minutes", type=float, default=np.inf)
    options = parser.parse_args()
    end = time.monotonic() + 60 * options.minutes
    corridors, wrong = 0, 0
    for seed in range(options.first, options.first + options.count):
        if time.monotonic() > end:
            break
        start = time.process_time()
        found = list(times(seed))
        said = faults(found)
        corridors += max(len(found) - 1, 0)
        wrong += len(said)
        line = "  ".join(f"{width:.3g}: {total:.4f}" for width, total in found)
        print(f"seed {seed}: {line}  CPU {time.process_time() - start:.1f}", *said, sep="\n  ", flush=True)
    print(f"{corridors} corridors, {wrong} faults")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
