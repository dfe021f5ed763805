"""The planning problems of tests/data/problems.toml, and random ones, as arms and jobs."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from armtempo.model.arm import Arm
from armtempo.model.job import Job, Stop
from armtempo.model.parts import Joint, Limits, Motor
from armtempo.splines import bspline
from armtempo.splines.trajectory import JointSpline

FILE = Path(__file__).parents[1] / "data" / "problems.toml"


@dataclass(frozen=True)
class Problem:
    name: str
    arm: Arm
    job: Job
    expect: str
    best_s: tuple[float, ...]


def make_arm(
    limits: Sequence[Sequence[float]], range_deg: tuple[float, float] = (-1e9, 1e9), microsteps: int = 1
) -> Arm:
    """An arm of joints with these limits, each with a motor."""
    joints = [
        Joint(
            name=f"joint {number}",
            d_mm=0.0,
            a_mm=100.0,
            alpha_deg=0.0,
            theta_offset_deg=0.0,
            range_deg=range_deg,
            limits=Limits(*limit),
            motor=Motor(number, 200, microsteps, 1.0),
        )
        for number, limit in enumerate(limits, 1)
    ]
    return Arm("test arm", tuple(joints))


def load() -> list[Problem]:
    """All problems of the file."""
    with FILE.open("rb") as file:
        return [_problem(entry) for entry in tomllib.load(file)["problem"]]


def _problem(entry: dict[str, Any]) -> Problem:
    low, high = entry.pop("range_deg", (-1e9, 1e9))
    arm = make_arm(entry.pop("limits"), (low, high), entry.pop("microsteps", 1))
    expect, best_s = entry.pop("expect", "plan"), tuple(entry.pop("best_s", ()))
    via = tuple(tuple(row) for row in entry.pop("via_deg"))
    settings = {"timing": "per-joint", "refine": 1, "polish": False, "bounds_s": (0.1, 3.0), **entry}
    return Problem(entry["name"], arm, Job(via=via, **settings), expect, best_s)


def random_problem(seed: int) -> tuple[Arm, Job]:
    """A job from any corner: repeats, reversals, straight lines, tiny and huge, tight and loose."""
    rng = np.random.default_rng(seed)
    joints = int(rng.choice([1, 1, 2, 2, 3, 6]))
    count = int(rng.choice([2, 3, 4, 5, 7, 12]))
    via = rng.normal(0.0, 10.0 ** rng.uniform(-6, 4), (count, joints)) * 10.0 ** rng.uniform(-2, 0, joints)
    kind = rng.integers(0, 9)
    if kind == 0:
        via[1:] = via[1]
    elif kind == 1:
        via[count // 2] = via[count // 2 - 1]
    elif kind == 2:
        via = np.cumsum(np.abs(via), axis=0)
    elif kind == 3:
        via = np.abs(via) * (-1.0) ** np.arange(count)[:, None]
    elif kind == 4:
        via[:, rng.integers(0, joints)] = 5.0
    elif kind == 5:
        via = np.round(via)
    elif kind == 6:
        via += 1e3
    elif kind == 7:
        via = np.repeat(via[:1], count, axis=0) + np.arange(count)[:, None] * rng.normal(0, 10, joints)
    limits = 10.0 ** rng.uniform([-2, -2, -2], [2.7, 4, 6], (joints, 3))
    job = Job(
        name="random",
        via=tuple(map(tuple, via.tolist())),
        degree=int(rng.choice([3, 5])),
        timing=str(rng.choice(["shared", "per-joint"])),
        refine=1,
        polish=False,
        population=4,
        iterations=1,
        seed=seed,
        bounds_s=(0.1, 3.0),
    )
    return make_arm(limits.tolist()), job


def random_free_problem(seed: int) -> tuple[Arm, Job]:
    """The same with a free path: stops, dwells, corridors, fixed and automatic numbers of pieces."""
    arm, job = random_problem(seed)
    rng = np.random.default_rng([seed, 1])
    count = len(job.via)
    refine: int | str = "auto" if rng.random() < 0.3 else int(rng.integers(3, 9))
    job = replace(job, path="free", degree=5, refine=refine, starts=int(rng.integers(1, 3)))
    if job.timing != "shared":
        return arm, job
    if rng.random() < 0.3:
        widest = float(np.ptp(np.array(job.via)))
        return arm, replace(job, corridor_deg=widest * 10.0 ** rng.uniform(-3, -1))
    if count > 2 and rng.random() < 0.5:
        vias = sorted(rng.choice(np.arange(1, count - 1), size=min(2, count - 2), replace=False).tolist())
        return arm, replace(job, stops=tuple(Stop(via, float(rng.choice([0.0, 0.5]))) for via in vias))
    return arm, job


FEEDING = np.array(
    [
        [0, -60, 40],
        [20, -75, 50],
        [40, -110, 70],
        [90, -85, 40],
        [130, -60, 10],
        [160, -45, -20],
        [180, -38, -52],
    ],
    dtype=float,
)

LIMITS = [Limits(50, 50, 150), Limits(40, 30, 120), Limits(60, 40, 150)]


def dense(joint: JointSpline, order: int, count: int = 400) -> float:
    """Largest magnitude on a fine grid of u, both sides of each knot."""
    u = np.tile(np.linspace(0, 1, count), len(joint.time_polynomials))
    segment = np.repeat(np.arange(len(joint.time_polynomials)), count)

    def at(pieces: np.ndarray, n: int) -> np.ndarray:
        return bspline.evaluate(bspline.derivative(pieces, n), segment, u)

    q = [at(joint.angle_polynomials, n) for n in range(4)]
    t = [at(joint.time_polynomials, n) for n in range(4)]
    values = [
        q[1] / t[1],
        (q[2] * t[1] - q[1] * t[2]) / t[1] ** 3,
        (q[3] * t[1] ** 2 - 3 * q[2] * t[1] * t[2] + 3 * q[1] * t[2] ** 2 - q[1] * t[1] * t[3]) / t[1] ** 5,
    ]
    return float(np.abs(values[order - 1]).max())
