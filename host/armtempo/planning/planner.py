"""Planning a job for an arm: via points, path, time axes, and the check that every plan must pass."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version

import numpy as np

import armtempo
from armtempo.arrays import Array
from armtempo.model.arm import Arm, Limits
from armtempo.model.job import Job
from armtempo.model.plan import Plan, Search
from armtempo.model.tool_pose import Pose
from armtempo.planning import checks, lower_bounds, time_parameterization
from armtempo.planning.time_parameterization import Timed
from armtempo.progress import Progress
from armtempo.splines import bspline, extremes
from armtempo.splines.trajectory import JointSpline, Trajectory


@np.errstate(all="ignore")  # what overflows ends as not a number, which no check passes
def plan(arm: Arm, job: Job, progress: Progress | None = None) -> Plan:
    """A motion through the job's via points, from rest to rest, as short as the search finds it.

    The same arm, job and seed give the same plan on the same machine and versions. Raises InputError where
    job and arm do not fit each other, PlanError where there is no motion under these limits and ranges.
    """
    limits = checks.limits_of(arm)
    checks.check_job(arm, job)
    via, notes = via_angles(arm, job)
    points = bspline.fit(via, job.degree)
    checks.check_ranges(arm, points, job.degree)
    moving = [int(joint) for joint in np.flatnonzero(np.ptp(via, axis=0) > checks.TOLERANCE)]
    groups = [moving] if job.timing == "shared" else [[joint] for joint in moving]
    timed = []
    for number, joints in enumerate(groups):
        part = None if progress is None else _part(progress, number, len(groups))
        timed.append(_time(points, joints, limits, job, part))
    trajectory = _trajectory(job, points, groups, timed)
    reached = extremes.of_joints(trajectory.joints)
    checks.check_reached(arm, reached)
    searches = tuple(
        _search(points, joints, limits, job, axis) for joints, axis in zip(groups, timed, strict=True)
    )
    return Plan(arm, job, via, notes, trajectory, searches, reached, versions())


@cache
def versions() -> Mapping[str, str]:
    """What a plan's numbers depend on besides its input."""
    return {
        "armtempo": armtempo.__version__,
        "numpy": np.__version__,
        "scipy": version("scipy"),
        "python": platform.python_version(),
        "machine": platform.machine(),
    }


def via_angles(arm: Arm, job: Job) -> tuple[Array, tuple[str, ...]]:
    """Angles of the driven joints at the via points in degrees, (n + 1, J), and notes on poses."""
    if any(isinstance(via, Pose) for via in job.via):
        from armtempo.planning import via_points  # here, because most jobs need no kinematics

        resolved = via_points.resolve(arm, job)
        angles, notes = resolved.via_deg, tuple(note.text for note in resolved.notes)
    else:
        angles, notes = np.array(job.via, dtype=float), ()
    checks.check_via(arm, job, angles)
    return angles, notes


def _part(progress: Progress, number: int, parts: int) -> Progress:
    return lambda done, whole: progress(number + done / whole, parts)


def _time(
    points: Array, joints: list[int], limits: list[Limits], job: Job, progress: Progress | None
) -> Timed:
    """The time axis of these joints; its random numbers depend on the seed and the first joint only."""
    rng = np.random.default_rng([job.seed, joints[0]])
    return time_parameterization.axis(
        points[:, joints], [limits[joint] for joint in joints], job, rng, progress
    )


def _trajectory(job: Job, points: Array, groups: list[list[int]], timed: list[Timed]) -> Trajectory:
    """All joints on their time axes; one that does not move takes the longest axis."""
    longest = max(timed, key=lambda axis: axis.total_s)
    axes = {joint: axis for joints, axis in zip(groups, timed, strict=True) for joint in joints}
    joints = tuple(
        JointSpline(
            job.degree,
            job.refine,
            np.ascontiguousarray(points[:, joint]),
            axes.get(joint, longest).time_points_s,
        )
        for joint in range(points.shape[1])
    )
    return Trajectory(job.name, joints, job.timing == "shared")


def _search(points: Array, joints: list[int], limits: list[Limits], job: Job, timed: Timed) -> Search:
    floor_s, floor_kind = lower_bounds.floor(
        points[:, joints], job.degree, [limits[joint] for joint in joints]
    )
    return Search(
        joints=tuple(joints),
        intervals_s=timed.intervals_s,
        total_s=timed.total_s,
        searched_s=timed.searched_s,
        evaluations=timed.found.evaluations,
        history_s=timed.found.history,
        optimum_s=timed.optimum_s,
        floor_s=floor_s,
        floor_kind=floor_kind,
    )
