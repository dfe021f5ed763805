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
from armtempo.model.job import Job, Pose
from armtempo.model.plan import Plan, Search
from armtempo.planning import checks, lower_bounds, time_parameterization
from armtempo.planning.time_parameterization import Group, Timed
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
    groups = _groups(points, via, limits, job)
    most = time_parameterization.most_refine(job, len(via) - 1, len(limits))
    timed = time_parameterization.axes(groups, job, most, progress)
    trajectory = _trajectory(job, points, groups, timed)
    reached = extremes.of_joints(trajectory.joints)
    checks.check_reached(arm, reached)
    searches = tuple(_search(group, job, axis) for group, axis in zip(groups, timed, strict=True))
    notes += tuple(note for axis in timed for note in axis.notes)
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


def _groups(points: Array, via: Array, limits: list[Limits], job: Job) -> list[Group]:
    """The joints that move, together or one by one."""
    moving = [int(joint) for joint in np.flatnonzero(np.ptp(via, axis=0) > checks.TOLERANCE)]
    together = [moving] if job.timing == "shared" else [[joint] for joint in moving]
    return [
        Group(tuple(joints), points[:, joints], [limits[joint] for joint in joints]) for joints in together
    ]


def _trajectory(job: Job, points: Array, groups: list[Group], timed: list[Timed]) -> Trajectory:
    """All joints on their time axes; one that does not move takes the longest axis."""
    longest = max(timed, key=lambda axis: axis.total_s)
    axes = {joint: axis for group, axis in zip(groups, timed, strict=True) for joint in group.joints}
    joints = tuple(
        JointSpline(
            job.degree,
            longest.refine,
            np.ascontiguousarray(points[:, joint]),
            axes.get(joint, longest).time_points_s,
        )
        for joint in range(points.shape[1])
    )
    return Trajectory(job.name, joints, job.timing == "shared")


def _search(group: Group, job: Job, timed: Timed) -> Search:
    floor_s, floor_kind = lower_bounds.floor(group.angle_points_deg, job.degree, group.limits)
    return Search(
        joints=group.joints,
        intervals_s=timed.intervals_s,
        total_s=timed.total_s,
        searched_s=timed.searched_s,
        evaluations=timed.found.evaluations,
        history_s=timed.found.history,
        optimum_s=timed.optimum_s,
        floor_s=floor_s,
        floor_kind=floor_kind,
    )
