"""Planning problems of tests/data/problems.toml and random ones, and a plan checked without the planner's splines."""

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
from armtempo.model.plan import Plan
from armtempo.splines import bspline
from armtempo.splines.trajectory import JointSpline
from scipy.interpolate import BSpline

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
    settings = {
        "path": "through",
        "timing": "per-joint",
        "refine": 1,
        "polish": False,
        "bounds_s": (0.1, 3.0),
        **entry,
    }
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
        path="through",
    )
    return make_arm(limits.tolist()), job


def spread_out(seed: int, joints: int, vias: int) -> tuple[Arm, Job]:
    """A free path through random via angles between -90 and 90 degrees."""
    rng = np.random.default_rng(seed)
    via = rng.uniform(-90, 90, (vias, joints))
    limits = np.stack(
        [rng.uniform(20, 80, joints), rng.uniform(20, 80, joints), rng.uniform(80, 300, joints)]
    )
    job = Job(f"random-{seed}", tuple(map(tuple, via.tolist())), path="free", seed=seed)
    return make_arm(limits.T.tolist()), job


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


def tight_free_problem(seed: int) -> tuple[Arm, Job]:
    """A job for an arm with ranges that its via points fill, or with moves far smaller than its limits."""
    rng = np.random.default_rng(seed)
    joints, count = int(rng.integers(1, 7)), int(rng.integers(3, 9))
    limits = np.stack(
        [rng.uniform(20, 80, joints), rng.uniform(20, 80, joints), rng.uniform(80, 300, joints)], 1
    )
    if seed % 2:
        via = np.cumsum(rng.uniform(-1.0, 1.0, (count, joints)) * 10.0 ** rng.uniform(-1.7, -0.3), axis=0)
        if rng.random() < 0.5:
            via[count // 2 :] += rng.uniform(-90.0, 90.0, joints)
        span = (-180.0, 180.0)
    else:
        half = float(rng.uniform(5.0, 90.0))
        span = (-half, half)
        via = rng.uniform(*span, (count, joints))
        at = rng.random((count, joints)) < 0.33
        via = np.where(at, np.where(rng.random((count, joints)) < 0.5, *span), via)
        near = rng.random((count, joints)) < 0.2
        via = np.where(near, np.clip(via, *span) * (1.0 - 10.0 ** rng.uniform(-5, -1)), via)
    timing = str(rng.choice(["shared", "per-joint"]))
    job = Job(f"random-{seed}", tuple(map(tuple, via.tolist())), path="free", timing=timing, starts=1)
    return make_arm(limits.tolist(), span), job


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


# A plan looked at without the planner's own splines and bounds: scipy's B-splines, sampled densely


POINTS = 40
"""Samples in a segment of the time axis."""


@dataclass(frozen=True)
class Sampled:
    """A joint at many points of its spline parameter u, in order."""

    u: np.ndarray
    time_s: np.ndarray
    angle_deg: np.ndarray
    rates: np.ndarray
    """Speed, acceleration, jerk: (3, K)."""


def sampled(spline: JointSpline, points: int = POINTS) -> Sampled:
    """By the chain rule from derivatives by u."""
    degree = spline.degree
    segments = len(spline.angle_points_deg) - degree
    angle = _bspline(spline.angle_points_deg, degree, 1.0)
    time = _bspline(spline.time_points_s, degree, 1.0 / spline.refine)
    u = np.linspace(0.0, segments, segments * spline.refine * points + 1)
    u[-1] = np.nextafter(segments, 0.0)
    q, q1, q2, q3 = (angle(u, order) for order in range(4))
    t, t1, t2, t3 = (time(u, order) for order in range(4))
    speed = q1 / t1
    acceleration = (q2 - speed * t2) / t1**2
    jerk = (q3 - 3.0 * acceleration * t1 * t2 - speed * t3) / t1**3
    return Sampled(u, t, q, np.array([speed, acceleration, jerk]))


def _bspline(points: np.ndarray, degree: int, step: float) -> BSpline:
    knots = step * np.arange(-degree, len(points) + 1)
    return BSpline(knots, points, degree)


def faults(plan: Plan, at_via_deg: float = 1e-7, points: int = POINTS) -> list[str]:
    """What is wrong with a plan; empty if nothing is. Poses with a tolerance are not checked."""
    found = []
    shared = plan.trajectory.shared
    for number, (joint, spline) in enumerate(zip(plan.arm.driven, plan.trajectory.joints, strict=True)):
        at = sampled(spline, points)
        size = max(1.0, float(np.abs(at.angle_deg).max()))
        limits = np.array(joint.limits.values)[:, None]
        excess = np.abs(at.rates) / limits - 1.0
        if excess.max() > 1e-9:
            excess -= _rounding(spline, at, points) / limits
        if excess.max() > 1e-9:
            found.append(f"{joint.name}: a limit is exceeded by {excess.max():.2e} of it")
        if np.any(np.diff(at.time_s) <= 0.0):
            found.append(f"{joint.name}: time does not increase")
        low, high = joint.range_deg
        if at.angle_deg.min() < low - 1e-9 * size or at.angle_deg.max() > high + 1e-9 * size:
            found.append(f"{joint.name}: leaves its range")
        found += _at_vias(plan, number, at_via_deg * size)
        found += _at_stops(plan, number)
        ends = np.abs(at.rates[: 2 if spline.degree == 5 else 1][:, [0, -1]])
        allowed = 1e-5 * limits[: len(ends)]
        if np.any(ends > allowed):
            allowed = allowed + _rounding(spline, at, points)[: len(ends), [0, -1]]
        if np.any(ends > allowed):
            found.append(f"{joint.name}: is not at rest at its ends")
        if shared and not np.array_equal(spline.time_points_s, plan.trajectory.joints[0].time_points_s):
            found.append(f"{joint.name}: has a time axis of its own")
    return found


def _at_stops(plan: Plan, number: int) -> list[str]:
    """Dwells that are shorter than asked for, or in which the joint moves."""
    spline, found = plan.trajectory.joints[number], []
    time = _bspline(spline.time_points_s, spline.degree, 1.0 / spline.refine)
    angle = _bspline(spline.angle_points_deg, spline.degree, 1.0)
    for stop in plan.job.stops:
        if stop.dwell_s and spline.via_segments:
            u = float(spline.via_segments[stop.via]) + np.linspace(0.0, np.ceil(5.0 / spline.refine), 21)
            lasts_s = float(time(u[-1]) - time(u[0]))
            moves_deg = float(np.ptp(angle(u)))
            if lasts_s < stop.dwell_s * (1 - 1e-9) or moves_deg > 1e-9 * max(1.0, np.abs(angle(u)).max()):
                found.append(f"joint {number + 1}: dwells for {lasts_s:.9g} s and moves {moves_deg:.2e} deg")
    return found


def _rounding(spline: JointSpline, at: Sampled, points: int) -> np.ndarray:
    """What the last bit of each control point, a 64-bit float, does to the rates: (3, K).

    Much if a segment far from angle 0 or late in a motion takes hardly any time, as between repeated via points.
    """
    rng = np.random.default_rng(1)
    largest = np.zeros_like(at.rates)
    for _ in range(8):
        angle_deg, time_s = (
            values + rng.integers(-1, 2, len(values)) * np.spacing(np.abs(values).max())
            for values in (spline.angle_points_deg, spline.time_points_s)
        )
        other = sampled(replace(spline, angle_points_deg=angle_deg, time_points_s=time_s), points)
        largest = np.maximum(largest, np.abs(other.rates - at.rates))
    return 3.0 * largest


def _at_vias(plan: Plan, number: int, nearest_deg: float) -> list[str]:
    spline = plan.trajectory.joints[number]
    angle = _bspline(spline.angle_points_deg, spline.degree, 1.0)
    knots = spline.via_segments or range(len(plan.via_deg))
    at = np.minimum(np.array(knots, dtype=float), np.nextafter(knots[-1], 0.0))
    off = np.abs(angle(at) - plan.via_deg[:, number]).max()
    return [f"joint {number + 1}: passes a via point by {off:.2e} deg"] if off > nearest_deg else []
