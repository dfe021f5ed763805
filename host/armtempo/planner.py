"""Planning a job for an arm: via points, path, time axes, and the check that every plan must pass."""

from __future__ import annotations

import math
import platform
from collections.abc import Callable
from importlib.metadata import version

import numpy as np
from armtempo_shared.limits import MAX_SEGMENTS, MAX_STEP_RATE, MAX_STEP_RATE_SUM

import armtempo
from armtempo import extremes, optimise, spline, timeaxis, timing, vias
from armtempo.arm import Arm, Joint, Limits
from armtempo.errors import InputError, PlanError
from armtempo.extremes import Extremes
from armtempo.job import Job, Pose
from armtempo.plan import Plan, Search
from armtempo.spline import Array
from armtempo.trajectory import JointSpline, Trajectory

TOLERANCE = 1e-9
"""What rounding may leave: largest excess over a limit, relative, and over a range, in degrees."""

Progress = Callable[[float, float], None]
"""Called with the work done and the whole of it."""


def plan(arm: Arm, job: Job, progress: Progress | None = None) -> Plan:
    """A motion through the job's via points, from rest to rest, as short as the search finds it.

    The same arm, job and seed give the same plan on the same machine and versions. Raises InputError where
    job and arm do not fit each other, PlanError where there is no motion under these limits and ranges.
    """
    limits = _checked_limits(arm)
    _check_job(arm, job)
    via = via_angles(arm, job)
    points = spline.fit(via, job.degree)
    _check_ranges(arm, points, job.degree)
    moving = [int(joint) for joint in np.flatnonzero(np.ptp(via, axis=0) > TOLERANCE)]
    if not moving:
        raise PlanError(
            f"job {job.name!r}: all via points are the same, so nothing moves; change at least one angle"
        )
    groups = [moving] if job.timing == "shared" else [[joint] for joint in moving]
    searches = []
    for number, joints in enumerate(groups):
        rng = np.random.default_rng([job.seed, joints[0]])
        part = None if progress is None else _part(progress, number, len(groups))
        timed = timing.axis(points[:, joints], [limits[joint] for joint in joints], job, rng, part)
        searches.append(_search(tuple(joints), timed))
    trajectory = _trajectory(job, points, searches)
    reached = tuple(extremes.of_joint(joint) for joint in trajectory.joints)
    _check(arm, limits, reached)
    return Plan(arm, job, via, trajectory, tuple(searches), reached, versions())


def versions() -> dict[str, str]:
    """What a plan's numbers depend on besides its input."""
    return {
        "armtempo": armtempo.__version__,
        "numpy": np.__version__,
        "scipy": version("scipy"),
        "python": platform.python_version(),
        "machine": platform.machine(),
    }


def via_angles(arm: Arm, job: Job) -> Array:
    """Angles of the driven joints at the via points, poses resolved, degrees: (n + 1, J)."""
    if any(isinstance(via, Pose) for via in job.via):
        via = vias.resolve(arm, job).via_deg
    else:
        via = np.array(job.via, dtype=float)
    if via.ndim != 2 or len(via) < 2 or via.shape[1] != len(arm.driven):
        raise InputError(
            f"job {job.name!r}: needs at least 2 via points with {len(arm.driven)} angles each, "
            "one for each driven joint"
        )
    if not np.all(np.isfinite(via)):
        raise InputError(f"job {job.name!r}: a via angle is not a finite number")
    return via


def _part(progress: Progress, number: int, parts: int) -> Progress:
    return lambda done, whole: progress(number + done / whole, parts)


def _checked_limits(arm: Arm) -> list[Limits]:
    """The limits of the driven joints; each must be positive, and its speed one that the board can step."""
    limits = []
    for joint in arm.driven:
        if joint.limits is None:
            raise InputError(f"arm {arm.name!r}: {joint.name} has a motor but no limits; add a limits table")
        values = joint.limits.values
        if not all(math.isfinite(value) and value > 0 for value in values):
            raise InputError(
                f"arm {arm.name!r}: the limits of {joint.name} must be positive numbers, not {values}"
            )
        _check_step_rate(arm, joint, joint.limits.speed_deg_s)
        limits.append(joint.limits)
    if not limits:
        raise InputError(f"arm {arm.name!r}: no joint has a motor, so there is nothing to plan")
    return limits


def _check_step_rate(arm: Arm, joint: Joint, speed_deg_s: float) -> None:
    assert joint.motor is not None
    rate = speed_deg_s * joint.motor.steps_per_deg
    if rate > MAX_STEP_RATE:
        raise InputError(
            f"arm {arm.name!r}: {joint.name} at its speed limit of {speed_deg_s:g} deg/s needs {rate:.0f} "
            f"steps/s, the board does {MAX_STEP_RATE} at most; check the unit, lower the limit, or use "
            "fewer microsteps"
        )


def _check_job(arm: Arm, job: Job) -> None:
    if job.timing not in ("per-joint", "shared"):
        raise InputError(f"job {job.name!r}: timing {job.timing!r} must be 'per-joint' or 'shared'")
    if job.refine < 1 or (len(job.via) - 1) * job.refine > MAX_SEGMENTS:
        raise InputError(
            f"job {job.name!r}: {len(job.via) - 1} segments with refine {job.refine} make more than the "
            f"board's {MAX_SEGMENTS}; lower refine or use fewer via points"
        )
    kind = job.parameters.get("fitness", timing.FITNESS[0])
    if kind not in timing.FITNESS:
        raise InputError(f"job {job.name!r}: fitness {kind!r} must be one of {', '.join(timing.FITNESS)}")
    optimise.defaults(job.optimiser)


def _check_ranges(arm: Arm, points: Array, degree: int) -> None:
    """The path between the via points must stay in range too."""
    low, high = extremes.range_of(np.moveaxis(spline.polynomials(points, degree), 2, 0))
    for joint, lowest, highest in zip(arm.driven, low, high, strict=True):
        least, most = joint.range_deg
        if lowest < least - TOLERANCE or highest > most + TOLERANCE:
            raise PlanError(
                f"{joint.name}: the path reaches {lowest:.3f} to {highest:.3f} degrees, its range is "
                f"{least:g} to {most:g}; move the via points away from the end of the range, or add one "
                "where it swings out"
            )


def _search(joints: tuple[int, ...], timed: timing.Timed) -> Search:
    found = timed.found
    total = float(timed.intervals_s.sum())
    return Search(
        joints, timed.intervals_s, total, timed.searched_s, found.evaluations, found.history, 0.0, "none"
    )


def _trajectory(job: Job, points: Array, searches: list[Search]) -> Trajectory:
    """All joints on their time axes; one that does not move takes the longest axis."""
    longest = max(searches, key=lambda search: search.total_s)
    axes = {joint: search.intervals_s for search in searches for joint in search.joints}
    joints = tuple(
        JointSpline(
            job.degree,
            job.refine,
            np.ascontiguousarray(points[:, joint]),
            timeaxis.control_points(axes.get(joint, longest.intervals_s), job.degree),
        )
        for joint in range(points.shape[1])
    )
    return Trajectory(job.name, joints, job.timing == "shared")


def _check(arm: Arm, limits: list[Limits], reached: tuple[Extremes, ...]) -> None:
    """No plan leaves here that exceeds a limit, or the board's step rates."""
    rates = 0.0
    for joint, limit, extreme in zip(arm.driven, limits, reached, strict=True):
        if not np.all(extreme.values <= np.array(limit.values) * (1 + TOLERANCE)):
            raise PlanError(
                f"{joint.name}: the plan reaches {extreme.values}, over its limits {limit.values}"
            )
        assert joint.motor is not None
        rates += extreme.speed_deg_s * joint.motor.steps_per_deg
    if rates > MAX_STEP_RATE_SUM:
        raise PlanError(
            f"the joints together could need {rates:.0f} steps/s, the board does {MAX_STEP_RATE_SUM} "
            "at most; lower the speed limits or use fewer microsteps"
        )
