"""Random arcs of the tool with tolerances from wide to narrow, compared with the fastest motion along the exact arc.

    python -m tests.benchmark.arcs [--first 0] [--count 40]

The reference is the optimal time axis of the spline through 257 postures on the arc, with four time segments for
each of its segments. Exits with 1 if a plan takes more than 0.5 % longer than that, or longer than one with a narrower
tolerance, or if separate code finds a fault in it.
"""

from __future__ import annotations

import argparse
import os
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402
from armtempo.basics.errors import PlanError  # noqa: E402
from armtempo.model.arm import Arm  # noqa: E402
from armtempo.model.job import Job  # noqa: E402
from armtempo.model.tool_pose import Pose  # noqa: E402
from armtempo.model.tool_segment import ToolSegment  # noqa: E402
from armtempo.planning import planner  # noqa: E402
from armtempo.planning.fixed_path import FixedPath  # noqa: E402
from armtempo.planning.line import line_path  # noqa: E402
from armtempo.planning.line.line_path import DEGREE  # noqa: E402
from armtempo.splines import bspline  # noqa: E402

from tests.host.problems import faults  # noqa: E402
from tests.host.random_lines import line_faults, tool_poses  # noqa: E402

TOLERANCES_MM = (1.3, 0.3, 0.03)
_SLOWER, _SAME = 1.005, 1.0 + 1e-9
_POSTURES, _REFINE, _GAP = 257, 4, 1e-4


def arc(seed: int, tolerance_mm: float) -> tuple[Arm, Job]:
    """An arc of the SCARA or of the paper's arm."""
    rng = np.random.default_rng(seed)
    arm = Arm.paper() if seed % 2 else Arm.of("scara")
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    low, high = np.maximum(low, -170.0), np.minimum(high, 288.0)
    here = 0.5 * (low + high) + 0.3 * (high - low) * rng.uniform(-1.0, 1.0, len(low))
    there = np.clip(here + rng.uniform(-30.0, 30.0, len(here)), low, high)
    between = 0.5 * (here + there) + rng.uniform(-4.0, 4.0, len(here))
    end, through = tool_poses(arm, np.array([there, between]))
    middle = tuple(through[:3, 3].tolist())
    segment = ToolSegment(1, True, middle, tolerance_mm=tolerance_mm, tolerance_deg=90.0)
    via = (tuple(here.tolist()), Pose(tuple(map(tuple, end.tolist())), fixed=()))
    return arm, Job("arc", via=via, tool_segments=(segment,))


def reference_s(arm: Arm, job: Job, via_deg: np.ndarray) -> float:
    """The motion time along the exact arc."""
    (led,) = line_path.led_legs(arm, job, via_deg).values()
    angles = led.followed.at(led.distances(_POSTURES - 1))
    moving = np.ptp(angles, axis=0) > 1e-9
    limits = [joint.limits for joint, moves in zip(arm.driven, moving, strict=True) if moves]
    path = FixedPath(bspline.fit(angles[:, moving], DEGREE), DEGREE, limits, _REFINE)
    return path.optimum(np.ones(path.variables.differences), _GAP).total_s


def main() -> None:
    """Plan, compare, and print what is wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=40)
    options = parser.parse_args()
    overs, seconds, refused, faulty = [], [], 0, 0
    for seed in range(options.first, options.first + options.count):
        times, wrong = [], []
        for tolerance_mm in TOLERANCES_MM:
            arm, job = arc(seed, tolerance_mm)
            start = time.process_time()
            try:
                plan = planner.plan(arm, job)
            except PlanError:
                break
            seconds.append(time.process_time() - start)
            times.append(plan.total_s)
            wrong += faults(plan, at_via_deg=1e-3) + line_faults(plan)
        if len(times) < len(TOLERANCES_MM):
            refused += 1
            continue
        over = np.array(times) / reference_s(arm, job, plan.via_deg)
        overs.append(over.max())
        if wrong or over.max() > _SLOWER or times[0] > times[1] * _SAME or times[1] > times[2] * _SAME:
            faulty += 1
            print(
                f"seed {seed}: {np.round(times, 5)} s, {np.round(over, 5)} of the exact arc {wrong}",
                flush=True,
            )
    print(
        f"{len(overs)} arcs ({refused} refused), {faulty} faulty; of the exact arc: median {np.median(overs):.5f}, "
        f"most {max(overs):.5f}; CPU seconds a plan: median {np.median(seconds):.2f}"
    )
    sys.exit(faulty > 0)


if __name__ == "__main__":
    main()
