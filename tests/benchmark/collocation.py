"""Free paths compared with an independent reference: direct collocation by casadi and ipopt, of the same jobs.

    pip install --group bench
    python -m tests.benchmark.collocation [--jobs 5] [--pieces 40] [--vias 40] [--feeding]

The reference knows nothing of splines: joints are chains of integrators with piecewise constant jerk, ``--pieces``
of equal time between any two via points, all joints at a via point together, speed, acceleration and jerk within their
limits at every knot; acceleration is linear between knots, and speed is bounded where it peaks between them as well.
Its jerk may jump, which a spline's may not, so with enough pieces it is a little faster than any plan.
"""

from __future__ import annotations

import argparse
import os
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import casadi  # noqa: E402
import numpy as np  # noqa: E402
from armtempo.model.arm import Arm  # noqa: E402
from armtempo.model.job import Job  # noqa: E402
from armtempo.planning import planner  # noqa: E402

from tests.host import problems  # noqa: E402


def main() -> None:
    """Print a line for each job."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=5)
    parser.add_argument("--pieces", type=int, default=40)
    parser.add_argument("--vias", type=int, help="via points of each random job; default: 4 to 8")
    parser.add_argument("--feeding", action="store_true")
    options = parser.parse_args()
    print(
        f"{'job':<10}{'vias':>5}{'plan s':>10}{'CPU s':>8}{'reference s':>13}{'CPU s':>8}{'over %':>8}{'CPU ratio':>11}"
    )
    overs, ratios = [], []
    jobs = _jobs(options)
    least_s(planner.plan(*jobs[0][1:]).via_deg, np.full((len(jobs[0][1].driven), 3), 50.0), 10)  # warm, both
    for label, arm, job in jobs:
        start = time.process_time()
        plan = planner.plan(arm, job)
        planned = time.process_time() - start
        limits = np.array([joint.limits.values for joint in arm.driven])
        start = time.process_time()
        reference = least_s(plan.via_deg, limits, options.pieces)
        referred = time.process_time() - start
        over = 100.0 * (plan.total_s / reference - 1.0)
        print(
            f"{label:<10}{len(job.via):>5}{plan.total_s:>10.4f}{planned:>8.2f}{reference:>13.4f}{referred:>8.2f}"
            f"{over:>8.3f}{planned / referred:>11.2f}",
            flush=True,
        )
        overs.append(over)
        ratios.append(planned / referred)
    print(
        f"{len(overs)} jobs: over the reference by {np.median(overs):.3f} % in the median, {max(overs):.3f} % at most; "
        f"CPU ratio {np.median(ratios):.2f} in the median, {max(ratios):.2f} at most"
    )


def _jobs(options: argparse.Namespace) -> list[tuple[str, Arm, Job]]:
    arm = Arm.paper()
    found = [("feeding", arm, Job("feeding", Job.paper(arm).via, path="free"))]
    if options.feeding:
        return found
    for seed in range(options.jobs):
        rng = np.random.default_rng(seed)
        via = rng.uniform(-90, 90, (int(rng.integers(4, 9)) if options.vias is None else options.vias, 3))
        limits = np.stack([rng.uniform(20, 80, 3), rng.uniform(20, 80, 3), rng.uniform(80, 300, 3)], axis=1)
        job = Job(f"random-{seed}", tuple(map(tuple, via.tolist())), path="free", seed=seed)
        found.append((f"random {seed}", problems.make_arm(limits.tolist()), job))
    return found


def least_s(via_deg: np.ndarray, limits: np.ndarray, pieces: int) -> float:
    """Motion time of the reference through via angles (n + 1, J), ``limits`` (J, 3); ValueError without a solution."""
    size = np.maximum(np.ptp(via_deg, axis=0), 1e-9)
    via, (speed, acceleration, jerk) = via_deg / size, (limits / size[:, None]).T
    joints, stretches = via.shape[1], len(via) - 1
    problem = casadi.Opti()
    times = problem.variable(stretches)
    guess = (
        1.5
        * np.max(
            np.abs(np.diff(via, axis=0)) / speed + 2 * np.sqrt(np.abs(np.diff(via, axis=0)) / acceleration),
            axis=1,
        )
        + 0.1
    )
    problem.set_initial(times, guess)
    problem.subject_to(times >= 1e-3)
    q, v, a = (problem.variable(joints) for _ in range(3))
    for state, value in ((q, via[0]), (v, 0.0), (a, 0.0)):
        problem.subject_to(state == value)
    for stretch in range(stretches):
        step = times[stretch] / pieces
        for piece in range(pieces):
            j = problem.variable(joints)
            problem.subject_to(problem.bounded(-jerk, j, jerk))
            here = [problem.variable(joints) for _ in range(3)]
            share = (piece + 1) / pieces
            problem.set_initial(here[0], via[stretch] + share * (via[stretch + 1] - via[stretch]))
            problem.set_initial(here[1], (via[stretch + 1] - via[stretch]) / guess[stretch])
            problem.subject_to(here[0] == q + step * v + step**2 / 2 * a + step**3 / 6 * j)
            problem.subject_to(here[1] == v + step * a + step**2 / 2 * j)
            problem.subject_to(here[2] == a + step * j)
            # Of a quadratic: all three Bernstein coefficients of the speed within its limit.
            problem.subject_to(problem.bounded(-speed, v + step / 2 * a, speed))
            problem.subject_to(problem.bounded(-speed, here[1], speed))
            problem.subject_to(problem.bounded(-acceleration, here[2], acceleration))
            q, v, a = here
        problem.subject_to(q == via[stretch + 1])
    problem.subject_to(v == 0)
    problem.subject_to(a == 0)
    problem.minimize(casadi.sum1(times))
    problem.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes", "max_iter": 2000})
    try:
        return float(np.sum(problem.solve().value(times)))
    except RuntimeError as error:
        raise ValueError(f"no reference: {error}") from None


if __name__ == "__main__":
    main()
