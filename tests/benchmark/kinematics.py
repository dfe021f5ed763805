"""Poses per second of the closed-form inverse, beside EAIK and the numerical solver, in one run on one core.

    python -m tests.benchmark.kinematics [--poses 100000] [--repeat 5]

EAIK is compared where it is installed (pip install eaik); it is no dependency, not even of the tests. Each
rate is the best of the repetitions. The errors are of the poses that the solutions lead to, over all poses
timed: the position relative to the arm's reach, or an element of the rotation, whichever is larger.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from armtempo.kinematics import Geometry, Ranges, forward, inverse
from armtempo.kinematics.numerical import solve

from tests.host.published_arms import NAMED

SINGLE_POSES = 2000
NUMERICAL_POSES = 50


@dataclass
class Row:
    """One line of the table."""

    solver: str
    poses: int
    per_second: float
    error: float
    solutions: float
    """Mean number of solutions a pose."""


def main() -> None:
    """Print a table for each arm."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, default=100_000)
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()
    for name, geometry in NAMED.items():
        angles = np.random.default_rng(1).uniform(-np.pi, np.pi, (options.poses, 6))
        poses = forward(geometry, angles)
        rows = [*own(geometry, poses, options.repeat), *eaik(geometry, poses, options.repeat)]
        rows.append(numerical(geometry, poses, angles))
        print(f"\n{name}")
        print(
            f"  {'solver':<34}{'poses':>8}{'poses/s':>12}{'us/pose':>10}{'worst error':>13}{'solutions':>11}"
        )
        for row in rows:
            print(
                f"  {row.solver:<34}{row.poses:>8}{row.per_second:>12.0f}{1e6 / row.per_second:>10.2f}"
                f"{row.error:>13.1e}{row.solutions:>11.2f}"
            )


def own(geometry: Geometry, poses: np.ndarray, repeat: int) -> list[Row]:
    """The closed form, in one batch and pose by pose."""
    seconds, solutions = timed(lambda: inverse(geometry, poses), repeat)
    found = solutions.angles_rad
    count = float(np.isfinite(found[..., 5]).sum(axis=1).mean())
    batch = Row(
        "armtempo, all 8, batch", len(poses), len(poses) / seconds, error(geometry, found, poses), count
    )
    some = poses[:SINGLE_POSES]
    seconds, _ = timed(lambda: [inverse(geometry, pose) for pose in some], 3)
    single = Row("armtempo, all 8, one by one", len(some), len(some) / seconds, batch.error, count)
    return [batch, single]


def eaik(geometry: Geometry, poses: np.ndarray, repeat: int) -> list[Row]:
    """EAIK, where it is installed and no joint has an offset (its DH constructor takes none)."""
    if importlib.util.find_spec("eaik") is None:
        print("EAIK is not installed: left out")
        return []
    from eaik.IK_DH import DhRobot

    robot = DhRobot(*map(np.array, (geometry.alpha, geometry.a, geometry.d)))
    offset = np.array(geometry.offset)
    rows = []
    some = poses[:SINGLE_POSES]
    for solver, part, call in (
        ("EAIK, all, batch, 1 thread", poses, lambda: robot.IK_batched(poses, 1)),
        ("EAIK, all, one by one", some, lambda: [robot.IK(pose) for pose in some]),
    ):
        seconds, answers = timed(call, repeat if part is poses else 3)
        found = padded(answers) - offset
        count = float(np.isfinite(found[..., 5]).sum(axis=1).mean())
        rows.append(Row(solver, len(part), len(part) / seconds, error(geometry, found, part), count))
    return rows


def numerical(geometry: Geometry, poses: np.ndarray, angles: np.ndarray) -> Row:
    """The numerical solver, started within 0.3 rad of a solution: one solution a pose."""
    ranges = Ranges(np.full(6, -2 * np.pi), np.full(6, 2 * np.pi))
    nudge = np.random.default_rng(2).uniform(-0.3, 0.3, (NUMERICAL_POSES, 6))
    seconds, answers = timed(
        lambda: [
            solve(geometry, pose, ranges, start)
            for pose, start in zip(poses, angles[:NUMERICAL_POSES] + nudge, strict=False)
        ],
        1,
    )
    found = np.array([answer.angles_rad for answer in answers])[:, None]
    count = float(np.mean([answer.found for answer in answers]))
    part = poses[:NUMERICAL_POSES]
    return Row(
        "least squares, one near the start",
        len(part),
        len(part) / seconds,
        error(geometry, found, part),
        count,
    )


def timed(call: Callable[[], Any], repeat: int) -> tuple[float, Any]:
    """Shortest time of some calls, in s, and the last result."""
    shortest, result = np.inf, None
    for _ in range(repeat):
        start = time.perf_counter()
        result = call()
        shortest = min(shortest, time.perf_counter() - start)
    return float(shortest), result


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
