"""Poses a second that ``armtempo.inverse`` and ``inverse_many`` solve, in range and out of it.

    python -m tests.benchmark.inverse [--count 2000]

Random postures within the joint ranges; poses of random postures over whole turns that no posture in range reaches;
poses far out of reach. Processor time on one core, the best of five runs, next to the closed form's alone; poses as
arrays (4, 4).
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import armtempo  # noqa: E402
import numpy as np  # noqa: E402
from armtempo.kinematics import Geometry, inverse_of_pose  # noqa: E402

ARMS = ("ar4", "parol6", "paper")


def groups(arm: armtempo.Arm, count: int, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Poses, (count, 4, 4) each."""
    low, high = np.array([joint.range_deg for joint in arm.joints]).T
    inside = armtempo.forward(arm, rng.uniform(low, high, (count, len(low))))
    anywhere = armtempo.forward(arm, rng.uniform(-180.0, 180.0, (10 * count, len(low))))
    outside = anywhere[~armtempo.inverse_many(arm, anywhere).usable.any(axis=1)][:count]
    far = inside.copy()
    far[:, :3, 3] *= 5.0
    return {"in range": inside, "out of range": outside, "out of reach": far}


def rate(poses: np.ndarray, solve: Callable[[np.ndarray], object], each: bool) -> float:
    """Poses a second."""
    best = np.inf
    for _ in range(5):
        start = time.process_time()
        if each:
            for pose in poses:
                solve(pose)
        else:
            solve(poses)
        best = min(best, time.process_time() - start)
    return len(poses) / best


def main() -> None:
    """A line for each arm and group."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=2000)
    count = parser.parse_args().count
    print(
        f"{'arm':<8}{'poses':<14}{'number':>7}{'inverse':>10}{'inverse_many':>14}{'closed form':>13}  a second"
    )
    for name in ARMS:
        arm = armtempo.Arm.load(name)
        geometry = Geometry.of(arm)
        for label, poses in groups(arm, count, np.random.default_rng(20)).items():
            one = rate(poses, lambda pose, arm=arm: armtempo.inverse(arm, pose), True)
            many = rate(poses, lambda poses, arm=arm: armtempo.inverse_many(arm, poses), False)
            rows = poses.reshape(-1, 16)
            form = rate(rows, lambda row, of=geometry: inverse_of_pose(of, row.tolist()), True)
            print(f"{name:<8}{label:<14}{len(poses):>7}{one:>10.0f}{many:>14.0f}{form:>13.0f}", flush=True)


if __name__ == "__main__":
    main()
