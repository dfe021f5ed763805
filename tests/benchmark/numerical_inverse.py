"""The numerical inverse: what a jog and a search for all postures cost, and how many postures the search misses.

    python -m tests.benchmark.numerical_inverse [--poses 50]

For each arm and what a pose asks of it: ``PoseSolver.nearest`` from 0.05 rad beside the posture (median and worst
time, how often it got there) and ``numerical.search`` from home (median time, mean number of postures). For arms
of the closed form's class all joints move by any angle, and the share of its solutions that the search finds is
printed too.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np
from armtempo.kinematics import Geometry, Ranges, forward, inverse
from armtempo.kinematics.numerical import MovingArm, search
from armtempo.kinematics.solver import PoseSolver
from armtempo.model.arm import Arm
from armtempo.model.tool_pose import WHOLE, Pose

from tests.host.published_arms import NAMED
from tests.host.small_arms import FITTING, FIVE, FOUR, SIX, asked, drawn_posture

BESIDE_RAD = 0.05
SEED = 1
MORE = [(SIX, WHOLE), (SIX, ()), (SIX, ("approach",)), (FOUR, WHOLE), (FOUR, ()), (FIVE, WHOLE)]


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, default=50)
    poses = parser.parse_args().poses
    print(f"seed {SEED}, {poses} poses each")
    print(
        f"{'arm':<16}{'asked':<24}{'nearest: us':>12}{'worst':>8}{'reached':>9}{'all: ms':>10}{'postures':>10}"
    )
    for arm, fixed in [*FITTING, *MORE]:
        print(one_arm(arm, fixed, poses))
    print(f"\n{'arm of the class':<40}{'all: ms':>10}{'starts':>8}{'found of the closed form':>26}")
    for name, geometry in NAMED.items():
        print(of_the_class(name, geometry, poses))


def one_arm(arm: Arm, fixed: tuple[str, ...], poses: int) -> str:
    """The line of an arm."""
    rng = np.random.default_rng(SEED)
    solver = PoseSolver(arm)
    jogs, searches, reached, postures = [], [], 0, []
    for _ in range(poses):
        there = drawn_posture(solver, rng)
        wanted = asked(forward(solver.geometry, there), fixed)
        nudge = rng.uniform(-BESIDE_RAD, BESIDE_RAD, len(there)) * [
            joint.motor is not None for joint in arm.joints
        ]
        start = np.clip(there + nudge, solver.ranges.low, solver.ranges.high).tolist()
        begin = time.perf_counter()
        reached += solver.nearest(wanted, start).success
        middle = time.perf_counter()
        postures.append(len(search(solver.moving, wanted, solver.home_rad).solutions))
        jogs.append(middle - begin)
        searches.append(time.perf_counter() - middle)
    words = " ".join(fixed) or "position only"
    return (
        f"{arm.name:<16}{words:<24}{1e6 * np.median(jogs):>12.0f}{1e6 * max(jogs):>8.0f}{reached:>6}/{poses}"
        f"{1e3 * np.median(searches):>10.1f}{np.mean(postures):>10.1f}"
    )


def of_the_class(name: str, geometry: Geometry, poses: int) -> str:
    """The line of an arm that the closed form serves too."""
    rng = np.random.default_rng(SEED)
    factor = 1.0 if geometry.reach > 50.0 else 1000.0  # published in m
    in_mm = replace(
        geometry,
        d=tuple(factor * length for length in geometry.d),
        a=tuple(factor * length for length in geometry.a),
    )
    arm = MovingArm(in_mm, Ranges(np.full(6, -2 * np.pi), np.full(6, 2 * np.pi)), tuple(range(6)))
    seconds, starts, found, there = [], [], 0, 0
    for _ in range(poses):
        pose = forward(in_mm, rng.uniform(-np.pi, np.pi, 6))
        solutions = inverse(in_mm, pose)
        closed = solutions.angles_rad[0][solutions.outcome[0] == 0]
        begin = time.perf_counter()
        answer = search(arm, Pose.of_matrix(pose), np.zeros(6))
        seconds.append(time.perf_counter() - begin)
        starts.append(answer.starts)
        angles = np.array([solution.angles_rad for solution in answer.solutions])
        apart = np.abs(np.remainder(angles[:, None] - closed + np.pi, 2 * np.pi) - np.pi).max(axis=2)
        found += int((apart.min(axis=0) < 1e-4).sum())
        there += len(closed)
    return f"{name:<40}{1e3 * np.median(seconds):>10.1f}{np.mean(starts):>8.0f}{f'{found} of {there}':>26}"


if __name__ == "__main__":
    main()
