"""Poses per second of the closed-form inverse, beside EAIK, in one run on one core.

    python -m tests.benchmark.kinematics [--poses 100000] [--repeat 5]

EAIK is compared where it is installed (pip install eaik); it is no dependency, not even of the tests. Each
rate is the best of the repetitions, which take turns so that all see the same machine. The errors are of the
poses that the solutions lead to, over all poses timed: the position relative to the arm's reach, or an element
of the rotation, whichever is larger. Other arms, and the numerical solver: numerical_inverse.py.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from armtempo.kinematics import Geometry, forward, inverse, inverse_of_pose

from tests.host.published_arms import NAMED

SINGLE_POSES = 2000
BATCH, ONE, EAIK_BATCH, EAIK_ONE = "batch", "numbers", "EAIK batch", "EAIK one"


@dataclass
class Solver:
    """A way of solving poses."""

    name: str
    poses: np.ndarray
    call: Callable[[], Any]
    angles: Callable[[Any], np.ndarray]
    """(N, 8, 6) of what the call gives, NaN where there are fewer."""
    seconds: float = np.inf
    answer: Any = None


def main() -> None:
    """Print a table for each arm."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, default=100_000)
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()
    for name, geometry in NAMED.items():
        angles = np.random.default_rng(1).uniform(-np.pi, np.pi, (options.poses, 6))
        poses = forward(geometry, angles)
        solvers = own(geometry, poses) | eaik(geometry, poses)
        for _ in range(options.repeat):
            for solver in solvers.values():
                start = time.perf_counter()
                solver.answer = solver.call()
                solver.seconds = min(solver.seconds, time.perf_counter() - start)
        report(name, geometry, solvers)


def own(geometry: Geometry, poses: np.ndarray) -> dict[str, Solver]:
    """The closed form: in one batch, and pose by pose as arrays and as plain numbers."""
    some = poses[:SINGLE_POSES]
    numbers = [pose.ravel().tolist() for pose in some]
    return {
        BATCH: Solver(
            "armtempo, all 8, batch", poses, lambda: inverse(geometry, poses), lambda it: it.angles_rad
        ),
        "arrays": Solver(
            "armtempo, all 8, one by one, arrays",
            some,
            lambda: [inverse(geometry, pose) for pose in some],
            lambda it: np.array([each.angles_rad[0] for each in it]),
        ),
        ONE: Solver(
            "armtempo, all 8, one by one, numbers",
            some,
            lambda: [inverse_of_pose(geometry, pose) for pose in numbers],
            lambda it: np.array([each.angles_rad for each in it]),
        ),
    }


def eaik(geometry: Geometry, poses: np.ndarray) -> dict[str, Solver]:
    """EAIK, where it is installed; the joints' offsets are taken off, as its DH constructor takes none."""
    if importlib.util.find_spec("eaik") is None:
        print("EAIK is not installed: left out")
        return {}
    from eaik.IK_DH import DhRobot

    robot = DhRobot(*map(np.array, (geometry.alpha, geometry.a, geometry.d)))
    offset = np.array(geometry.offset)
    some = poses[:SINGLE_POSES]
    return {
        EAIK_BATCH: Solver(
            "EAIK, all, batch, 1 thread",
            poses,
            lambda: robot.IK_batched(poses, 1),
            lambda it: padded(it) - offset,
        ),
        EAIK_ONE: Solver(
            "EAIK, all, one by one",
            some,
            lambda: [robot.IK(pose) for pose in some],
            lambda it: padded(it) - offset,
        ),
    }


def report(name: str, geometry: Geometry, solvers: dict[str, Solver]) -> None:
    """Print the arm's table and the ratios to EAIK."""
    print(f"\n{name}")
    print(f"  {'solver':<38}{'poses':>8}{'poses/s':>12}{'us/pose':>10}{'worst error':>13}{'solutions':>11}")
    for solver in solvers.values():
        found, count = solver.angles(solver.answer), len(solver.poses)
        solutions = float(np.isfinite(found[..., 5]).sum(axis=1).mean())
        print(
            f"  {solver.name:<38}{count:>8}{count / solver.seconds:>12.0f}{1e6 * solver.seconds / count:>10.2f}"
            f"{error(geometry, found, solver.poses):>13.1e}{solutions:>11.2f}"
        )
    for mine, theirs in ((BATCH, EAIK_BATCH), (ONE, EAIK_ONE)):
        if theirs in solvers:
            ratio = solvers[theirs].seconds / solvers[mine].seconds
            print(f"  {solvers[mine].name}: {ratio:.2f} times the poses of {solvers[theirs].name}")


def padded(answers: Any) -> np.ndarray:
    """EAIK's exact solutions as (N, 8, 6), NaN where there are fewer than eight."""
    found = np.full((len(answers), 8, 6), np.nan)
    for row, answer in zip(found, answers, strict=True):
        exact = np.array(answer.Q).reshape(-1, 6)[~np.array(answer.is_LS, dtype=bool).reshape(-1)]
        row[: len(exact)] = exact[:8]
    return found


def error(geometry: Geometry, found: np.ndarray, poses: np.ndarray) -> float:
    """Largest error of the poses that (N, any, 6) angles lead to; NaN angles do not count."""
    difference = np.abs(forward(geometry, found) - poses[:, None])
    difference[..., :3, 3] /= geometry.reach
    return float(np.nanmax(difference))


if __name__ == "__main__":
    main()
