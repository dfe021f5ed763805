"""Free paths compared with an independent reference: direct collocation by casadi and ipopt, of the same jobs.

    pip install --group bench
    python -m tests.benchmark.collocation [--jobs 5] [--pieces 40] [--vias 40] [--joints 6] [--feeding]

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
    parser.add_argument("--joints", type=int, help="joints of each random job; default: 3 to 6")
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
        vias = int(rng.integers(4, 9)) if options.vias is None else options.vias
        joints = int(rng.integers(3, 7)) if options.joints is None else options.joints
        found.append((f"random {seed}", *problems.spread_out(seed, joints, vias)))
    return found


def least_s(via_deg: np.ndarray, limits: np.ndarray, pieces: int) -> float:
    """Motion time of the reference through via angles (n + 1, J), ``limits`` (J, 3); ValueError without a solution."""
    size = np.maximum(np.ptp(via_deg, axis=0), 1e-9)
    via, (speed, acceleration, jerk) = via_deg / size, (limits / size[:, None]).T
    joints, stretches = via.shape[1], len(via) - 1
    steps = stretches * pieces
    times = casadi.SX.sym("t", stretches)
    q, v, a = (casadi.SX.sym(name, joints, steps + 1) for name in "qva")
    j = casadi.SX.sym("j", joints, steps)
    step = casadi.vertcat(*[casadi.repmat(times[number] / pieces, pieces) for number in range(stretches)])
    h = casadi.repmat(step.T, joints, 1)
    q0, v0, a0 = (each[:, :-1] for each in (q, v, a))
    chained = casadi.vertcat(
        casadi.vec(q[:, 1:] - (q0 + h * v0 + h**2 / 2 * a0 + h**3 / 6 * j)),
        casadi.vec(v[:, 1:] - (v0 + h * a0 + h**2 / 2 * j)),
        casadi.vec(a[:, 1:] - (a0 + h * j)),
    )
    between = casadi.vec(v0 + h / 2 * a0)  # with the knots, all three Bernstein coefficients of a quadratic
    most = {
        name: np.repeat(limit[:, None], steps + 1, axis=1)
        for name, limit in (("v", speed), ("a", acceleration))
    }
    most["v"][:, [0, -1]] = most["a"][:, [0, -1]] = 0.0
    low = np.full((joints, steps + 1), -np.inf)
    low[:, ::pieces] = via.T
    high = np.where(np.isfinite(low), low, np.inf)
    jerks = np.repeat(jerk[:, None], steps, axis=1)
    distances = np.abs(np.diff(via, axis=0))
    guess = 1.5 * np.max(distances / speed + 2 * np.sqrt(distances / acceleration), axis=1) + 0.1
    place = np.linspace(0, stretches, steps + 1)
    start = np.array([np.interp(place, np.arange(stretches + 1), column) for column in via.T])
    slope = np.repeat(np.diff(via, axis=0) / guess[:, None], pieces, axis=0).T

    def flat(first: np.ndarray, *rest: np.ndarray) -> np.ndarray:
        return np.concatenate([first, *(each.ravel(order="F") for each in rest)])

    solver = casadi.nlpsol(
        "reference",
        "ipopt",
        {
            "x": casadi.vertcat(times, *map(casadi.vec, (q, v, a, j))),
            "f": casadi.sum1(times),
            "g": casadi.vertcat(chained, between),
        },
        {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "max_iter": 2000}},
    )
    zeros, ends = np.zeros(3 * joints * steps), np.tile(speed, steps)
    found = solver(
        x0=flat(guess, start, np.pad(slope, ((0, 0), (0, 1))), np.zeros_like(start), 0.0 * jerks),
        lbx=flat(np.full(stretches, 1e-3), low, -most["v"], -most["a"], -jerks),
        ubx=flat(np.full(stretches, np.inf), high, most["v"], most["a"], jerks),
        lbg=np.concatenate([zeros, -ends]),
        ubg=np.concatenate([zeros, ends]),
    )
    if not solver.stats()["success"]:
        raise ValueError(f"no reference: {solver.stats()['return_status']}")
    return float(found["f"])


if __name__ == "__main__":
    main()
